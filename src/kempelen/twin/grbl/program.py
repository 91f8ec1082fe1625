"""The firmware's main program: reads lines, carries out their operations one by one, answers.

Wherever the firmware would sit in a loop, an operation says "not yet" and is asked again later; that is what
makes the controller's whole state plain data.
"""

from collections.abc import Callable
from math import ceil, inf
from typing import Any

from kempelen.twin.grbl import commands, reports
from kempelen.twin.grbl.core import HOLD, SLEEP, START, Core
from kempelen.twin.grbl.homing import HomingCycle
from kempelen.twin.grbl.realtime import Outcome, Realtime
from kempelen.twin.grbl.settings import Vec
from kempelen.twin.grbl.status import Alarm, State, Status
from kempelen.twin.grbl.words import FLOW_PAUSE, LINEAR, GcodeError

_START_DELAY_S = 0.002  # from a line's ok until its motion begins: "ok, then Idle" is true that long
_DWELL_STEP_S = 0.05  # the firmware looks up from a dwell that often
_DWELL_ROUNDING = 1e-6
_MAX_DWELL_STEPS = 0xFFFF
_BLOCKED = frozenset({State.ALARM, State.JOG})


class Program:
    """Runs until there is nothing to do at this instant.

    Args:
        core: The controller.
        realtime: Its checkpoint.
    """

    def __init__(self, core: Core, realtime: Realtime) -> None:
        self._core = core
        self._realtime = realtime
        self._handlers: dict[str, Callable[..., bool]] = {
            "line": self._line,
            "jog": self._jog,
            "jogging": self._jogging,
            "at": self._at,
            "sync": self._sync,
            "spindle": self._spindle,
            "coolant": self._coolant,
            "dwell": self._dwell,
            "wco": self._offsets_changed,
            "system": self._system,
            "write": self._write,
            "setting": self._setting,
            "keep": self._keep,
            "build info": self._build_info,
            "restore": self._restore,
            "restored": self._restored,
            "pause": self._paused,
            "flow": self._flow,
            "probe": self._probe,
            "probed": self._probed,
            "soft limit": self._soft_limit,
            "home": self._home,
            "homed": self._homed,
            "sleep": self._sleep,
            "startup": self._startup,
            "say": self._say,
            "answer": self._answer,
        }

    def run(self) -> None:
        """Go on until the main program would have to wait."""
        core = self._core
        while core.pause_end <= core.time:
            if core.homing is not None:
                return
            outcome = self._realtime.checkpoint()
            if outcome is Outcome.WAIT:
                return
            if outcome is Outcome.RESTARTED:
                continue
            if core.agenda:
                if not self._step():
                    return
            elif not self._read():
                self._start_by_itself()
                return

    def _step(self) -> bool:
        """Work at the first operation; False when it has to wait."""
        core = self._core
        op = core.agenda[0]
        if not self._handlers[op[0]](*op[1:]):
            return bool(core.flags)
        if core.agenda and core.agenda[0] is op:
            core.agenda.popleft()
        return True

    def _replace(self, *ops: tuple[Any, ...]) -> None:
        """Let other operations take the place of the first one."""
        self._core.agenda.popleft()
        self._core.agenda.extendleft(reversed(ops))

    def _start_by_itself(self) -> None:
        """The main loop is idle: what is queued begins to move."""
        core = self._core
        if core.planner.blocks and core.state == State.IDLE and core.start_at == inf:
            core.start_at = core.time + _START_DELAY_S

    # --- reading -------------------------------------------------------------------------------------------

    def _read(self) -> bool:
        """Take up the next line; False when there is none."""
        core = self._core
        if not core.uart.ring:
            return False
        line = core.reader.take(core.uart.ring)
        if line is None:
            return False
        core.agenda.append(("answer", self._execute_line(*line)))
        if core.agenda[0] is commands.SLEEP_OP:
            core.agenda.rotate(1)  # the answer is out before it falls asleep
        return True

    def _execute_line(self, text: str, overflow: bool) -> int:  # noqa: FBT001 - data
        core = self._core
        if overflow:
            return Status.OVERFLOW
        try:
            if text.startswith("$"):
                core.agenda.extend(commands.execute(core, text))
            elif text and core.state in _BLOCKED:
                return Status.LOCKED
            elif text:
                core.agenda.extend(core.parser.parse(text))
        except GcodeError as error:
            return error.status
        return Status.OK

    def _answer(self, status: int) -> bool:
        self._core.say(Status(status).answer())
        return True

    def _startup(self, number: int) -> bool:
        """One of the lines kept under ``$N``; echoed with its answer."""
        core = self._core
        line = core.eeprom.startup[number]
        try:
            ops = core.parser.parse(line)
        except GcodeError as error:
            core.say(f">{line}:error:{error.status.value}\r\n")
            return True
        self._replace(*ops, ("say", f">{line}:ok\r\n"))
        return True

    def _say(self, text: str) -> bool:
        self._core.say(text)
        return True

    # --- motion --------------------------------------------------------------------------------------------

    def _line(self, target: Vec, rate: float, rapid: bool, inverse: bool) -> bool:  # noqa: FBT001 - data
        core = self._core
        if core.eeprom.settings.soft_limits and self._beyond(target):
            core.soft_limit = True
            if core.state == State.RUN:
                core.flags |= HOLD
            self._replace(("soft limit",))
            return True
        if core.state == State.CHECK:
            return True
        if not self._room():
            return False
        core.planner.append(target, rate, rapid=rapid, inverse=inverse, fixed=False)
        return True

    def _room(self) -> bool:
        """Whether the planner takes another block; a full one sets off the motion."""
        core = self._core
        if core.planner.full:
            if core.state == State.IDLE:
                core.flags |= START
            return False
        return True

    def _beyond(self, target: Vec) -> bool:
        travel = self._core.eeprom.settings.travel
        return any(not -length <= place <= 0.0 for place, length in zip(target, travel, strict=True))

    def _soft_limit(self) -> bool:
        core = self._core
        if core.state not in {State.IDLE, State.CHECK}:
            return False
        core.reset()
        core.alarm = Alarm.SOFT_LIMIT
        return True

    def _jog(self, target: Vec, rate: float) -> bool:
        core = self._core
        if core.eeprom.settings.soft_limits and self._beyond(target):
            core.agenda.clear()
            core.agenda.append(("answer", Status.TRAVEL_EXCEEDED))
            return True
        if not self._room():
            return False
        core.planner.append(target, rate, rapid=False, inverse=False, fixed=True)
        return True

    def _jogging(self) -> bool:
        core = self._core
        if core.state == State.IDLE and core.planner.blocks:
            core.state = State.JOG
            core.moving = True
            core.start_at = inf
        return True

    def _at(self, position: Vec) -> bool:
        self._core.parser.state.position = position
        return True

    def _sync(self) -> bool:
        core = self._core
        if not core.planner.blocks and core.state != State.RUN:
            return True
        if core.state == State.IDLE:
            core.flags |= START
        return False

    def _probe(self, target: Vec, rate: float, quiet: bool, away: bool) -> bool:  # noqa: FBT001 - data
        """There is no probe: towards one never touches, away from one is an error at once."""
        core = self._core
        if core.state == State.CHECK:
            return True
        core.probe_touched = False
        if away:
            core.alarm = Alarm.PROBE_INITIAL
            return True
        self._replace(("line", target, rate, False, False), ("sync",), ("probed", quiet))
        return True

    def _probed(self, quiet: bool) -> bool:  # noqa: FBT001 - data
        core = self._core
        if quiet:
            core.probe_position = core.stepper.position
        else:
            core.alarm = Alarm.PROBE_CONTACT
        core.parser.state.position = core.stepper.position
        inches = core.eeprom.settings.inches
        core.say(reports.probe_result(core.probe_position, touched=False, inches=inches))
        return True

    # --- outputs, time and memory --------------------------------------------------------------------------

    def _spindle(self, mode: int, rpm: float) -> bool:
        core = self._core
        core.parser.state.modes.spindle = mode
        if core.state != State.CHECK:
            core.set_spindle(mode, rpm)
        return True

    def _coolant(self, on: bool) -> bool:  # noqa: FBT001 - data
        core = self._core
        core.parser.state.modes.flood = on
        if core.state != State.CHECK:
            core.set_flood(on=on)
        return True

    def _dwell(self, seconds: float) -> bool:
        core = self._core
        steps = ceil(seconds / _DWELL_STEP_S - _DWELL_ROUNDING) & _MAX_DWELL_STEPS
        if core.state != State.CHECK and steps:
            self._replace(("pause", steps))
        return True

    def _paused(self, steps: int) -> bool:
        core = self._core
        if steps == 0:
            return True
        self._replace(("pause", steps - 1))
        core.pause_end = core.time + _DWELL_STEP_S
        return True

    def _offsets_changed(self) -> bool:
        self._core.status.offset_due = 0
        return True

    def _system(self, offset: Vec) -> bool:
        self._core.parser.state.system = offset
        return True

    def _write(self, index: int, offset: Vec) -> bool:
        self._stall(self._core.eeprom.write_offset(index, offset))
        return True

    def _stall(self, writes: int) -> None:
        """Writing EEPROM keeps the processor from listening."""
        core = self._core
        if writes:
            core.pause_end = core.time + core.uart.shut_ear(core.time, writes)

    def _setting(self, number: int, value: float) -> bool:
        core = self._core
        settings = core.eeprom.settings
        before = dict(settings.values)
        status = settings.store(number, value)
        core.agenda.clear()
        core.agenda.append(("answer", status))
        if settings.values != before:
            self._stall(commands.bytes_written("setting"))
        return True

    def _keep(self, number: int, text: str) -> bool:
        self._core.eeprom.startup[number] = text
        self._stall(len(text) + 1)
        return True

    def _build_info(self, text: str) -> bool:
        self._core.eeprom.build_info = text
        self._stall(len(text) + 1)
        return True

    def _restore(self, what: str) -> bool:
        core = self._core
        core.eeprom.restore(what)
        self._stall(commands.bytes_written("restore"))
        self._replace(("restored",))
        return True

    def _sleep(self) -> bool:
        self._core.flags |= SLEEP
        return True

    def _restored(self) -> bool:
        core = self._core
        core.say(reports.RESTORING)
        core.reset()
        return True

    def _flow(self, kind: int) -> bool:
        core = self._core
        checking = core.state == State.CHECK
        if kind == FLOW_PAUSE:
            if not checking:
                core.flags |= HOLD
            return True
        state = core.parser.state
        modes = state.modes
        modes.motion, modes.plane, modes.relative, modes.inverse, modes.system = LINEAR, 0, False, False, 0
        modes.spindle, modes.flood = 0, False
        core.planner.feed_override = core.planner.rapid_override = core.spindle_override = 100
        if not checking:
            state.system = core.eeprom.offsets[0]
            core.status.offset_due = 0
            core.set_spindle(0, 0.0)
            core.set_flood(on=False)
        core.say(reports.PROGRAM_END)
        return True

    # --- homing --------------------------------------------------------------------------------------------

    def _home(self, axis: int) -> bool:
        core = self._core
        if core.state != State.HOME:
            core.state = State.HOME
            core.homing = HomingCycle(core.eeprom.settings, core.machine, axis)
            return False
        return core.homing is None

    def _homed(self) -> bool:
        core = self._core
        core.state = State.IDLE
        self._replace(*core.startup_ops())
        return True
