"""The controller's whole state as plain data, and back."""

from collections import deque
from dataclasses import asdict
from math import inf
from typing import Any

from kempelen.twin.grbl.core import Core
from kempelen.twin.grbl.gcode import Op, ParserState
from kempelen.twin.grbl.homing import HomingCycle
from kempelen.twin.grbl.settings import Eeprom, Vec
from kempelen.twin.grbl.status import Alarm
from kempelen.twin.grbl.words import Modes

_PLAIN = (
    "time", "rest_since", "state", "flood", "spindle", "rpm", "flags", "suspend", "alarm_told",
    "critical", "moving", "soft_limit", "asleep", "spindle_stopped", "spindle_override", "probe_touched",
)  # fmt: skip
_TIMES = ("pause_end", "start_at")


def snapshot(core: Core) -> dict[str, Any]:
    """RAM, EEPROM, faults and the machine's truth, JSON-able."""
    core.follow()
    return {
        "plain": {name: getattr(core, name) for name in _PLAIN},
        "times": {name: _finite(getattr(core, name)) for name in _TIMES},
        "alarm": int(core.alarm),
        "overrides": sorted(core.overrides),
        "agenda": [list(op) for op in core.agenda],
        "reader": core.reader.snapshot(),
        "probe": list(core.probe_position),
        "homed": list(core.homed),
        "reports": [core.status.offset_due, core.status.override_due],
        "parser": asdict(core.parser.state),
        "planner": core.planner.snapshot(),
        "stepper": core.stepper.snapshot(),
        "homing": core.homing and core.homing.snapshot(),
        "uart": core.uart.snapshot(),
        "machine": core.machine.snapshot(),
        "eeprom": core.eeprom.snapshot(),
        "faults": core.faults.snapshot(),
    }


def restore(core: Core, state: dict[str, Any]) -> None:
    """The inverse of `snapshot`."""
    for name, value in state["plain"].items():
        setattr(core, name, value)
    for name, value in state["times"].items():
        setattr(core, name, _infinite(value))
    core.alarm = Alarm(state["alarm"])
    core.overrides = set(state["overrides"])
    core.agenda = deque(_op(op) for op in state["agenda"])
    core.reader.restore(state["reader"])
    core.homed = [int(count) for count in state["homed"]]
    core.probe_position = _vec(state["probe"])
    core.status.offset_due, core.status.override_due = state["reports"]
    _restore_eeprom(core.eeprom, Eeprom.from_snapshot(state["eeprom"], core.eeprom.dialect))
    core.parser.state = _parser_state(state["parser"])
    core.planner.restore(state["planner"])
    core.stepper.restore(state["stepper"])
    core.uart.restore(state["uart"])
    core.machine.restore(state["machine"])
    core.faults.restore(state["faults"])
    core.homing = None
    if state["homing"] is not None:
        core.homing = HomingCycle(core.eeprom.settings, core.machine, int(state["homing"]["alone"]))
        core.homing.restore(state["homing"])


def _restore_eeprom(eeprom: Eeprom, kept: Eeprom) -> None:
    """In place: other parts hold on to it."""
    eeprom.settings.replace(kept.settings.values)
    eeprom.defaults = kept.defaults
    eeprom.offsets = kept.offsets
    eeprom.startup = kept.startup
    eeprom.build_info = kept.build_info


def _parser_state(state: dict[str, Any]) -> ParserState:
    position, system, offset = (_vec(state[name]) for name in ("position", "system", "offset"))
    parser = ParserState(Modes(**state["modes"]), position, system, offset)
    parser.feed, parser.speed = float(state["feed"]), float(state["speed"])
    parser.tool = int(state["tool"])
    parser.tool_length = float(state["tool_length"])
    return parser


def _op(op: list[Any]) -> Op:
    return tuple(_vec(part) if isinstance(part, list) else part for part in op)


def _vec(values: Any) -> Vec:
    return tuple(float(value) for value in values)


def _finite(value: float) -> float | str:
    return value if -inf < value < inf else str(value)


def _infinite(value: float | str) -> float:
    return float(value)
