"""The controller's memory and the few actions that every part of it shares."""

from collections import deque
from math import inf

from kempelen.twin.grbl import reports
from kempelen.twin.grbl.faults import Faults
from kempelen.twin.grbl.gcode import Op, Parser
from kempelen.twin.grbl.homing import HomingCycle
from kempelen.twin.grbl.machine import Machine
from kempelen.twin.grbl.motion import Stepper
from kempelen.twin.grbl.planner import Planner
from kempelen.twin.grbl.reader import LineReader
from kempelen.twin.grbl.settings import Eeprom, Vec
from kempelen.twin.grbl.status import Alarm, State
from kempelen.twin.grbl.uart import Uart

# what interrupts leave for the main program, as bits
RESET, STATUS, START, STOP, HOLD, DOOR, CANCEL, SLEEP = (1 << n for n in range(8))
# why the main program is suspended, as bits
HELD, RETRACTED, RESTORE, RESTORED, AJAR, MOTION_CANCEL, JOG_CANCEL = (1 << n for n in range(7))

BOOT_S = 1.5
ALARM_S = 0.5
FULL_OVERRIDE = 100


class Core:
    """Everything that the parts of the virtual controller work on.

    Attributes:
        time: s since power-up.
        rest_since: When the last motion ended, s.
        homed: How often each axis has been homed.
        state: One of `State`.
        flags: What interrupts have asked for.
        overrides: Override bytes received and not yet acted on.
        suspend: Why the main program stands still.
        alarm: Raised and not yet dealt with.
        alarm_told: Its message is out.
        critical: Only a reset helps now.
        moving: The stepper interrupt is running.
        soft_limit: The motion is being stopped because of a target beyond the travel.
        agenda: Operations of the line at work, its answer last.
        pause_end: Until when the main program is busy with itself, s.
        start_at: When a queued motion will begin by itself, s; infinity for never.
        flood: The coolant output.
        spindle: The spindle output: 0, 3 or 4.
        rpm: Its speed.
        asleep: ``[MSG:Sleeping]`` has been said.
        spindle_stopped: By its override, during a hold.
    """

    def __init__(self, machine: Machine, eeprom: Eeprom, faults: Faults, baud: int) -> None:
        self.machine = machine
        self.eeprom = eeprom
        self.faults = faults
        self.uart = Uart(baud, eeprom.dialect.ring)
        self.parser = Parser(eeprom)
        self.planner = Planner(eeprom.settings)
        self.stepper = Stepper(self.planner)
        self.time = 0.0
        self.rest_since = 0.0
        self.homed = [0] * len(eeprom.dialect.axes)
        self.state = State.IDLE
        self.flood = False
        self.spindle = 0
        self.rpm = 0.0
        self._forget()

    def _forget(self) -> None:
        self.flags = 0
        self.overrides: set[int] = set()
        self.suspend = 0
        self.alarm = Alarm.NONE
        self.alarm_told = False
        self.critical = False
        self.moving = False
        self.soft_limit = False
        self.asleep = False
        self.spindle_stopped = False
        self.spindle_override = FULL_OVERRIDE
        self.planner.feed_override = FULL_OVERRIDE
        self.planner.rapid_override = FULL_OVERRIDE
        self.status = reports.StatusReport()
        self.agenda: deque[Op] = deque()
        self.pause_end = -inf
        self.start_at = inf
        self.homing: HomingCycle | None = None
        self.probe_position: Vec = self.eeprom.zero
        self.probe_touched = False
        self.reader = LineReader()

    # --- the board -----------------------------------------------------------------------------------------

    def power_up(self) -> None:
        """Begin with nothing but the EEPROM: position unknown, motors let go, boot loader first."""
        self.machine.cut_off(self.velocity())
        self._forget()
        self.uart.power_cycle()
        self.stepper.reset()
        self.de_energise()
        self.planner.reset()
        self.stepper.position = self.eeprom.zero
        self.machine.rename(self.eeprom.zero)
        self.state = State.ALARM if self.eeprom.settings[22] else State.IDLE
        self.flags = RESET
        self.pause_end = self.time + BOOT_S

    def restart(self) -> None:
        """After a reset: forget everything but the position and whether there was an alarm; greet."""
        if self.agenda and self.agenda[-1][0] == "answer":
            self.say("ok\r\n")  # the line that was at work returns before the reset takes hold
        self._forget()
        self.uart.clear()
        self.de_energise()
        self.planner.reset()
        self.stepper.reset()
        self.sync_position()
        self.parser.reset(self.stepper.position)
        self.say(self.eeprom.dialect.banner)
        if self.eeprom.settings.hard_limits and self.machine.pressed():
            self.state = State.ALARM
            self.say(reports.CHECK_LIMITS)
        if self.state in {State.ALARM, State.SLEEP}:
            self.state = State.ALARM
            self.say(reports.LOCKED)
        else:
            self.state = State.IDLE
            self.agenda.extend(self.startup_ops())

    def startup_ops(self) -> list[Op]:
        """To run what is kept under ``$N``."""
        return [("startup", number) for number, line in enumerate(self.eeprom.startup) if line]

    def reset(self) -> None:
        """What 0x18 and limit switches do at once, whatever the main program is at."""
        if self.flags & RESET:
            return
        self.flags |= RESET
        self.de_energise()
        if self.state == State.HOME:
            self.alarm = self.alarm or Alarm.HOMING_RESET
            self.end_homing()
        elif self.state in {State.RUN, State.JOG} or self.stepper.holding:
            self.alarm = Alarm.ABORT_CYCLE
            self.kill_motion()

    def end_homing(self) -> None:
        """The stepper takes over where homing has left the motors."""
        self.homing = None
        self.stepper.position = self.machine.motor

    def kill_motion(self) -> None:
        """Stop the step pulses; the carriage slides on a little."""
        self.follow()
        self.machine.cut_off(self.velocity())
        self.stepper.reset()
        self.moving = False

    def velocity(self) -> Vec:
        """Of the axes, mm/s."""
        return self.stepper.velocity() if self.moving else self.eeprom.zero

    def follow(self) -> None:
        """Let the carriage be where the motors are."""
        if self.homing is None:
            self.machine.follow(self.stepper.sync())

    def sync_position(self) -> None:
        """Planner and stepper take over the motors' position, to the step."""
        steps = self.eeprom.settings.steps
        counts = tuple(round(p * s) for p, s in zip(self.stepper.position, steps, strict=True))
        self.planner.position = counts
        self.stepper.position = tuple(n / s for n, s in zip(counts, steps, strict=True))

    def call_position(self, position: Vec) -> None:
        """From now on the present place is called ``position``, mm."""
        self.stepper.position = position
        self.machine.rename(position)
        self.sync_position()
        self.parser.state.position = self.stepper.position

    def de_energise(self) -> None:
        """Spindle and coolant off."""
        self.flood = False
        self.spindle, self.rpm = 0, 0.0

    # --- outputs -------------------------------------------------------------------------------------------

    def set_flood(self, *, on: bool) -> None:
        """Switch the coolant output."""
        self.flood = on
        self.status.override_due = 0

    def set_spindle(self, mode: int, rpm: float) -> None:
        """Switch the spindle output."""
        self.spindle = mode
        limits = self.eeprom.settings
        wanted = rpm * self.spindle_override / FULL_OVERRIDE
        self.rpm = min(max(wanted, limits[31]), limits[30]) if mode and wanted else 0.0
        self.status.override_due = 0

    # --- answers -------------------------------------------------------------------------------------------

    def say(self, text: str) -> None:
        """Send a text to the host."""
        if text == "ok\r\n" and self.faults.swallows_ok():
            return
        data = self.faults.garbled_out(text.encode("latin-1"))
        self.uart.transmit(data, self.time, self.faults.reply_delay_s)

    def report(self) -> None:
        """Answer ``?``."""
        settings = self.eeprom.settings
        steps = settings.steps
        position = tuple(round(p * s) / s for p, s in zip(self.stepper.sync(), steps, strict=True))
        speed = self.stepper.speed * 60.0 if self.moving else 0.0
        self.say(
            self.status.text(
                *self._state_names(),
                position,
                self.parser.state.work_offset,
                mask=int(settings[10]),
                inches=settings.inches,
                buffers=(settings.dialect.blocks - len(self.planner.blocks), self.uart.room),
                feed=(speed, self.rpm),
                pins=self.machine.pressed(),
                overrides=(self.planner.feed_override, self.planner.rapid_override, self.spindle_override),
                accessories={0: "", 3: "S", 4: "C"}[self.spindle] + "F" * self.flood,
            )
        )

    def _state_names(self) -> tuple[str, str]:
        if self.state == State.HOLD:
            return State.HOLD, ":0" if self.suspend & HELD else ":1"
        if self.state != State.DOOR:
            return self.state, ""
        if self.suspend & RESTORE:
            return State.DOOR, ":3"
        if not self.suspend & RETRACTED:
            return State.DOOR, ":2"
        return State.DOOR, ":1" if self.suspend & AJAR else ":0"
