"""A GRBL 1.1h board as seen from the wire, with a simulated machine behind it.

No I/O and no clock of its own: bytes are handed in and out, time passes when it is told to.
"""

import re
from math import inf
from typing import Any

from kempelen.twin.grbl.core import CANCEL, HELD, HOLD, START, STOP, Core
from kempelen.twin.grbl.faults import Faults
from kempelen.twin.grbl.homing import HomingCycle
from kempelen.twin.grbl.keeping import restore, snapshot
from kempelen.twin.grbl.machine import Machine
from kempelen.twin.grbl.program import Program
from kempelen.twin.grbl.realtime import BYTES, Realtime
from kempelen.twin.grbl.settings import Eeprom, Vec
from kempelen.twin.grbl.status import Alarm, State

_REALTIME = re.compile(b"[" + b"".join(re.escape(bytes((byte,))) for byte in sorted(BYTES)) + b"]")
_REALTIME_BYTES = bytes(sorted(BYTES))
_FEW_BLOCKS = 12  # below this the planner's look-ahead begins to cost speed


class VirtualGrbl:
    """The virtual controller.

    Args:
        machine: What it drives; its position is the true one at power-up.
        eeprom: Its memory; None for the defaults of a machine with that travel.
        faults: What goes wrong; None for nothing.
        baud: Speed of the serial line, bit/s; 0 for one without delay.

    Attributes:
        faults: May be changed at any time.
    """

    def __init__(
        self, machine: Machine, *, eeprom: Eeprom | None = None, faults: Faults | None = None, baud: int = 0
    ) -> None:
        self.faults = faults or Faults()
        self._core = Core(machine, eeprom or Eeprom.for_travel(machine.travel), self.faults, baud)
        self._realtime = Realtime(self._core)
        self._program = Program(self._core, self._realtime)
        self._core.power_up()

    # --- outside view --------------------------------------------------------------------------------------

    @property
    def position_mm(self) -> Vec:
        """Where the axes truly are, mm, in the machine frame of a correct homing."""
        return self._core.machine.position

    @property
    def flood_on(self) -> bool:
        """The coolant output."""
        return self._core.flood

    @property
    def spindle_on(self) -> bool:
        """The spindle output."""
        return bool(self._core.spindle)

    @property
    def spindle_rpm(self) -> float:
        """Its speed, rpm."""
        return self._core.rpm

    @property
    def time_s(self) -> float:
        """Since power-up."""
        return self._core.time

    @property
    def state(self) -> str:
        """As in the status report: Idle, Run, Hold, Jog, Home, Alarm, Check, Door or Sleep."""
        return self._core.state

    @property
    def homings(self) -> int:
        """How often every axis has been homed together or one by one."""
        return min(self._core.homed)

    @property
    def dropped(self) -> int:
        """Received bytes lost for want of room or attention, for tests and reports."""
        return self._core.uart.dropped

    @property
    def eeprom(self) -> Eeprom:
        """What survives a power cycle."""
        return self._core.eeprom

    # --- the wire ------------------------------------------------------------------------------------------

    def receive(self, data: bytes) -> None:
        """Bytes from the host: real-time ones act at once, others wait in the ring or are lost."""
        core = self._core
        data = self.faults.garbled_in(data)
        self._hear(core.uart.send(data, core.time))

    def _hear(self, data: bytes) -> None:
        core = self._core
        if _REALTIME.search(data):
            for match in _REALTIME.finditer(data):
                self._realtime.receive(match.group()[0])
            data = data.translate(None, _REALTIME_BYTES)
        if not data:
            return
        taken = core.uart.store(data, core.time)
        while taken < len(data):
            self._program.run()  # the processor is quicker than the wire: it reads on while bytes come in
            more = core.uart.store(data[taken:], core.time)
            if not more:
                core.uart.dropped += len(data) - taken
                return
            taken += more

    def take_output(self) -> bytes:
        """What has reached the host since the last call."""
        return self._core.uart.take(self._core.time)

    def reset_by_dtr(self) -> None:
        """The host has opened the port: RAM is lost, the boot loader takes its time, then the banner."""
        self._core.power_up()

    # --- time ----------------------------------------------------------------------------------------------

    def advance(self, dt: float) -> None:
        """Let ``dt`` seconds pass; with 0 what has arrived is still read and answered."""
        core = self._core
        self._apply_faults()
        end = core.time + dt
        while True:
            self._program.run()
            left = end - core.time
            if left <= 0.0:
                break
            self._pass(min(left, self._until_event()), end)
        core.follow()

    def _until_event(self) -> float:
        """Seconds until something happens by itself."""
        core = self._core
        due = min(core.start_at, core.uart.next_arrival())
        if core.pause_end > core.time:
            due = min(due, core.pause_end)
        left = due - core.time
        if core.homing is not None:
            left = min(left, core.homing.time_left())
        elif core.moving:
            left = min(left, self._planned_time())
        return max(left, 0.0)

    def _planned_time(self) -> float:
        core = self._core
        if core.planner.blocks:
            if core.stepper.plan():
                self._watch_switches()
            return core.stepper.time_left()
        return 0.0

    def _watch_switches(self) -> None:
        """Find out whether a limit switch will change along the block."""
        core = self._core
        block = core.stepper.block
        if block is None or not core.eeprom.settings.hard_limits:
            return
        machine = core.machine
        machine.follow(core.stepper.sync())
        done = block.length - block.left
        trip = min(machine.distance_to_change(axis, block.unit) for axis in range(len(block.unit)))
        core.stepper.trip = done + trip if done + trip < block.length else inf

    def _pass(self, dt: float, end: float) -> None:
        """Let ``dt`` seconds pass, no longer than until the next event, and let that happen."""
        core = self._core
        homing = core.homing
        core.time = end if dt == end - core.time else min(core.time + dt, end)
        if homing is not None:
            due = dt >= homing.time_left()
            homing.run(dt)
            if due:
                homing.event()
        elif core.moving:
            due = dt >= core.stepper.time_left()
            core.stepper.run(dt)
            if due or not core.planner.blocks:
                self._motion_event()
        if homing is not None:
            self._homing_ended(homing)
        if core.start_at <= core.time:
            core.start_at = inf
            if core.state == State.IDLE:
                core.flags |= START
        arrived = core.uart.arrived(core.time)
        if arrived:
            self._hear(arrived)

    def _motion_event(self) -> None:
        core = self._core
        if core.stepper.tripped():
            self._hard_limit()
            return
        if not core.planner.blocks or core.stepper.finish():
            core.moving = False
            core.rest_since = core.time
            core.flags |= STOP
        core.machine.follow(core.stepper.position)

    def _hard_limit(self) -> None:
        core = self._core
        core.follow()
        if core.state != State.ALARM and not core.alarm:
            core.reset()
            core.alarm = Alarm.HARD_LIMIT

    def _homing_ended(self, homing: HomingCycle) -> None:
        core = self._core
        if homing.failure:
            core.alarm = homing.failure
            core.reset()
        elif homing.done:
            core.end_homing()
            core.flags &= ~(HOLD | START | CANCEL)  # homing looks at resets and status requests only
            core.call_position(homing.origin())
            for axis in homing.axes:
                core.homed[axis] += 1

    def _apply_faults(self) -> None:
        core, faults = self._core, self.faults
        machine = core.machine
        if faults.stalled != machine.stalled or faults.dead_switches != machine.dead_switches:
            core.follow()
            machine.stalled = set(faults.stalled)
            machine.dead_switches = set(faults.dead_switches)
            self._watch_switches()
        lost = faults.take_lost_steps()
        if lost:
            self._slip(lost)
        if faults.take_reset():
            core.power_up()

    def _slip(self, lost: list[int]) -> None:
        core = self._core
        machine, settings = core.machine, core.eeprom.settings
        core.follow()
        pressed = machine.pressed()
        for axis, steps in enumerate(lost):
            machine.slip(axis, steps / settings.steps[axis])
        if settings.hard_limits and core.homing is None and machine.pressed() != pressed:
            self._hard_limit()
        self._watch_switches()

    # --- for the loop --------------------------------------------------------------------------------------

    def starving(self) -> bool:
        """Whether the machine would go faster if only the host sent more."""
        core = self._core
        queued = len(core.planner.blocks)
        moving = core.moving or core.start_at < inf
        return moving and not core.suspend and queued < _FEW_BLOCKS and not core.uart.ring and not core.agenda

    def idle(self) -> bool:
        """Whether nothing would happen if only time passed."""
        core = self._core
        if core.moving or core.homing is not None or core.start_at < inf or core.pause_end > core.time:
            return False
        if not core.uart.quiet(core.time):
            return False
        if core.critical:
            return True
        if core.flags or core.alarm or core.overrides:
            return False
        if core.suspend:
            return bool(core.suspend & HELD)
        return not core.agenda and not core.uart.ring

    @property
    def settled_at(self) -> float:
        """When the last motion, dwell or other occupation ended, s."""
        return max(self._core.rest_since, self._core.pause_end)

    def assume_homed(self) -> None:
        """Skip homing: boot at once, and know the true position (for measurements)."""
        core = self._core
        core.pause_end = core.time
        core.call_position(core.machine.position)
        self._program.run()
        core.state = State.IDLE
        core.uart.power_cycle()  # nobody was there to hear the banner

    def snapshot(self) -> dict[str, Any]:
        """RAM, EEPROM, faults and the machine's truth, JSON-able."""
        return snapshot(self._core)

    def restore(self, state: dict[str, Any]) -> None:
        """Go on exactly where `snapshot` was taken."""
        restore(self._core, state)
