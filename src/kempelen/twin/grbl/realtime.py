"""What the firmware does at each of its checkpoints: alarms, real-time commands, holds and resumes.

Source: GRBL wiki "Grbl v1.1 Commands" and "Interface"; what is looked at first is as in the firmware.
"""

from enum import Enum
from math import inf

from kempelen.twin.grbl import reports
from kempelen.twin.grbl.core import (
    AJAR,
    ALARM_S,
    CANCEL,
    DOOR,
    FULL_OVERRIDE,
    HELD,
    HOLD,
    JOG_CANCEL,
    MOTION_CANCEL,
    RESET,
    RESTORE,
    RESTORED,
    RETRACTED,
    SLEEP,
    START,
    STATUS,
    STOP,
    Core,
)  # fmt: skip
from kempelen.twin.grbl.status import Alarm, State

_FEED = {0x90: FULL_OVERRIDE, 0x91: 10, 0x92: -10, 0x93: 1, 0x94: -1}
_RAPID = {0x95: FULL_OVERRIDE, 0x96: 50, 0x97: 25}
_SPINDLE = {0x99: FULL_OVERRIDE, 0x9A: 10, 0x9B: -10, 0x9C: 1, 0x9D: -1}
_SPINDLE_STOP, _FLOOD_TOGGLE = 0x9E, 0xA0
_LEAST_OVERRIDE, _MOST_OVERRIDE = 10, 200
_FLAGS = {0x18: RESET, ord("?"): STATUS, ord("~"): START, ord("!"): HOLD, 0x84: DOOR, 0x85: CANCEL}
BYTES = frozenset(_FLAGS) | set(_FEED) | set(_RAPID) | set(_SPINDLE) | {_SPINDLE_STOP, _FLOOD_TOGGLE}

_SPINDLE_DELAY_S, _COOLANT_DELAY_S = 4.0, 1.0  # after the door has been closed
_STOPPING = CANCEL | HOLD | DOOR | SLEEP
_MOVES = frozenset({State.RUN, State.JOG})
_HOLDABLE = frozenset({State.HOLD, State.DOOR, State.SLEEP})
_COOLANT_STATES = frozenset({State.IDLE, State.RUN, State.HOLD, State.JOG})


class Outcome(Enum):
    """What the main program may do after a checkpoint."""

    GO = "go on"
    WAIT = "wait"
    RESTARTED = "begin anew"


class Realtime:
    """The checkpoint.

    Args:
        core: The controller.
    """

    def __init__(self, core: Core) -> None:
        self._core = core

    def receive(self, byte: int) -> None:
        """A real-time byte has arrived; acted on in the interrupt or at the next checkpoint."""
        core = self._core
        flag = _FLAGS.get(byte, 0)
        if flag == RESET:
            core.reset()
        elif flag == CANCEL:
            if core.state == State.JOG:  # in any other state it is ignored
                core.flags |= CANCEL
        elif flag:
            core.flags |= flag
            if flag == DOOR and core.state == State.HOME:
                core.reset()
                core.alarm = Alarm.HOMING_DOOR
        else:
            core.overrides.add(byte)

    def checkpoint(self) -> Outcome:
        """Deal with everything that has come up."""
        core = self._core
        while core.flags or core.alarm or core.suspend or core.overrides:
            if core.pause_end > core.time or (core.alarm and not self._alarm()):
                return Outcome.WAIT
            if core.flags & RESET:
                core.restart()
                return Outcome.RESTARTED
            self._flags()
            if core.overrides:
                self._overrides()
            if core.suspend and not self._suspended():
                return Outcome.WAIT
        return Outcome.GO

    def _alarm(self) -> bool:
        """Lock and tell why; False while the firmware is busy with that."""
        core = self._core
        if not core.alarm_told:
            core.alarm_told = True
            core.state = State.ALARM
            core.say(f"ALARM:{core.alarm.value}\r\n")
            core.pause_end = core.time + ALARM_S
            return False
        if core.alarm in {Alarm.HARD_LIMIT, Alarm.SOFT_LIMIT}:
            if not core.critical:
                core.critical = True
                core.say(reports.CRITICAL)
                core.flags &= ~RESET
            if not core.flags & RESET:
                return False
        core.alarm, core.alarm_told, core.critical = Alarm.NONE, False, False
        return True

    def _flags(self) -> None:
        core = self._core
        flags = core.flags
        if flags & STATUS:
            core.flags &= ~STATUS
            core.report()
        if flags & _STOPPING:
            core.flags &= ~_STOPPING
            self._stopping(flags)
        if flags & START:
            core.flags &= ~START
            if not flags & (HOLD | CANCEL | DOOR):
                self._start()
        if flags & STOP:
            core.flags &= ~STOP
            self._stopped()

    def _stopping(self, flags: int) -> None:
        core = self._core
        if core.state not in {State.ALARM, State.CHECK}:
            if core.state in _MOVES and not core.suspend & (MOTION_CANCEL | JOG_CANCEL):
                core.stepper.hold()
                if core.state == State.JOG and not flags & SLEEP:
                    core.suspend |= JOG_CANCEL
            if core.state == State.IDLE:
                core.suspend = HELD
            if flags & CANCEL and core.state != State.JOG:
                core.suspend |= MOTION_CANCEL
            if flags & HOLD and core.state not in {State.DOOR, State.JOG, State.SLEEP}:
                core.state = State.HOLD
            if flags & DOOR:
                self._door()
        if flags & SLEEP:
            if core.state == State.ALARM:
                core.suspend |= RETRACTED | HELD
            core.state = State.SLEEP

    def _door(self) -> None:
        core = self._core
        core.say(reports.CHECK_DOOR)
        if not core.suspend & JOG_CANCEL:
            if core.state == State.DOOR and core.suspend & RESTORE:
                core.suspend &= ~(RETRACTED | RESTORE | RESTORED)
            if core.state != State.SLEEP:
                core.state = State.DOOR
        core.suspend |= AJAR

    def _start(self) -> None:
        core = self._core
        if core.state == State.DOOR and not core.suspend & AJAR:
            if core.suspend & RESTORED:
                core.state = State.IDLE
            elif core.suspend & RETRACTED:
                core.suspend |= RESTORE
        if core.state != State.IDLE and not (core.state == State.HOLD and core.suspend & HELD):
            return
        if core.state == State.HOLD and core.spindle_stopped:
            core.say(reports.RESTORING_SPINDLE)
            self._restore_spindle()
        core.stepper.holding = False
        core.start_at = inf
        if core.planner.blocks and not core.suspend & MOTION_CANCEL:
            core.state = State.RUN
            core.moving = True
        else:
            core.state = State.IDLE
        core.suspend = 0

    def _stopped(self) -> None:
        """The stepper has come to rest: end of the queue, of a hold or of a cancelled jog."""
        core = self._core
        holding = core.stepper.holding
        core.stepper.rest()
        if core.state in _HOLDABLE and not core.soft_limit and not core.suspend & JOG_CANCEL:
            core.planner.replan()
            if holding:
                core.suspend |= HELD
            return
        if core.suspend & JOG_CANCEL:
            core.planner.reset()
            core.sync_position()
            core.parser.state.position = core.stepper.position
        if core.suspend & AJAR:
            core.suspend = (core.suspend & ~JOG_CANCEL) | HELD
            core.state = State.DOOR
        else:
            core.suspend = 0
            core.state = State.IDLE

    # --- suspended -----------------------------------------------------------------------------------------

    def _suspended(self) -> bool:
        """One round of the loop in which a hold is waited out; True when something has come of it."""
        core = self._core
        if not core.suspend & HELD or core.state not in {State.DOOR, State.SLEEP}:
            return False
        if not core.suspend & RETRACTED:
            core.spindle_stopped = False
            core.set_spindle(0, 0.0)
            core.set_flood(on=False)
            core.suspend |= RETRACTED
            return True
        if core.state == State.SLEEP:
            if not core.asleep:
                core.asleep = True
                core.say(reports.SLEEPING)
                core.de_energise()
            return False
        core.suspend &= ~AJAR  # a byte, not a switch, has opened it
        return bool(core.suspend & RESTORE) and self._restore()

    def _restore(self) -> bool:
        """Switch on again what the door has switched off, one after the other."""
        core = self._core
        modes = core.parser.state.modes
        if modes.spindle and not core.spindle:
            core.set_spindle(modes.spindle, core.parser.state.speed)
            core.pause_end = core.time + _SPINDLE_DELAY_S
        elif modes.flood and not core.flood:
            core.set_flood(on=True)
            core.pause_end = core.time + _COOLANT_DELAY_S
        else:
            core.suspend |= RESTORED
            core.flags |= START
        return True

    # --- overrides -----------------------------------------------------------------------------------------

    def _overrides(self) -> None:
        core = self._core
        given, core.overrides = core.overrides, set()
        planner = core.planner
        feed = self._summed(planner.feed_override, given, _FEED, 0x90)
        rapid = planner.rapid_override
        for byte, value in _RAPID.items():
            if byte in given:
                rapid = value
        if (feed, rapid) != (planner.feed_override, planner.rapid_override):
            planner.feed_override, planner.rapid_override = feed, rapid
            core.status.override_due = 0
            core.stepper.sync()
            planner.override()
        spindle = self._summed(core.spindle_override, given, _SPINDLE, 0x99)
        if spindle != core.spindle_override:
            core.spindle_override = spindle
            if core.spindle:
                core.set_spindle(core.spindle, core.parser.state.speed)
            core.status.override_due = 0
        if _SPINDLE_STOP in given and core.state == State.HOLD:
            self._toggle_spindle()
        if _FLOOD_TOGGLE in given and core.state in _COOLANT_STATES:
            modes = core.parser.state.modes
            modes.flood = not modes.flood
            core.set_flood(on=modes.flood)

    @staticmethod
    def _summed(value: int, given: set[int], steps: dict[int, int], reset: int) -> int:
        if reset in given:
            value = FULL_OVERRIDE
        value += sum(step for byte, step in steps.items() if byte in given and byte != reset)
        return min(max(value, _LEAST_OVERRIDE), _MOST_OVERRIDE)

    def _toggle_spindle(self) -> None:
        core = self._core
        if core.spindle_stopped:
            self._restore_spindle()
        elif core.spindle:
            core.spindle_stopped = True
            core.set_spindle(0, 0.0)

    def _restore_spindle(self) -> None:
        core = self._core
        core.spindle_stopped = False
        core.set_spindle(core.parser.state.modes.spindle, core.parser.state.speed)
