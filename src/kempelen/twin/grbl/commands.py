"""Lines that begin with ``$``. Source: GRBL wiki "Grbl v1.1 Commands"."""

from collections.abc import Callable

from kempelen.twin.grbl import reports
from kempelen.twin.grbl.core import Core
from kempelen.twin.grbl.gcode import Op
from kempelen.twin.grbl.settings import STARTUP_LINES
from kempelen.twin.grbl.status import State, Status
from kempelen.twin.grbl.words import GcodeError, read_number

SLEEP_OP: Op = ("sleep",)
_MAX_SETTING = 255
_RESTORES = frozenset({"$RST=$", "$RST=#", "$RST=*"})
_SETTING_BYTES = 5  # a float and the checksum, at worst
_ALL_BYTES = 200
_SINGLE_AXIS = 2  # bit of $22: an axis may be homed alone


def execute(core: Core, line: str) -> list[Op]:
    """Do what can be done at once; the operations that remain, the answer excluded.

    Args:
        core: The controller.
        line: Stripped and in upper case, with its ``$``.

    Raises:
        GcodeError: refused.
    """
    kind = line[1:2]
    if not kind:
        core.say(reports.HELP)
        return []
    if kind == "J":
        if core.state not in {State.IDLE, State.JOG}:
            raise GcodeError(Status.NOT_IDLE)
        if line[2:3] != "=":
            raise GcodeError(Status.INVALID_STATEMENT)
        return core.parser.parse(line[3:], jog=True)
    if kind in "$GCX":
        if len(line) > 2:  # noqa: PLR2004 - nothing may follow the letter
            raise GcodeError(Status.INVALID_STATEMENT)
        return _short(core, kind)
    if core.state not in {State.IDLE, State.ALARM}:
        raise GcodeError(Status.NOT_IDLE)
    return _AT_REST.get(kind, _setting)(core, line)


def _short(core: Core, kind: str) -> list[Op]:
    if kind == "$":
        if core.state in {State.RUN, State.HOLD}:
            raise GcodeError(Status.NOT_IDLE)
        core.say(core.eeprom.settings.listing())
    elif kind == "G":
        core.say(reports.modes(core.parser.state, inches=core.eeprom.settings.inches))
    elif kind == "C":
        _toggle_check_mode(core)
    elif core.state == State.ALARM:
        core.say(reports.UNLOCKED)
        core.state = State.IDLE
    return []


def _toggle_check_mode(core: Core) -> None:
    if core.state == State.CHECK:
        core.reset()
        core.say(reports.CHECK_OFF)
    elif core.state == State.IDLE:
        core.state = State.CHECK
        core.say(reports.CHECK_ON)
    else:
        raise GcodeError(Status.NOT_IDLE)


def _parameters(core: Core, line: str) -> list[Op]:
    _exactly(line, "$#")
    core.say(
        reports.parameters(core.eeprom, core.parser.state, core.probe_position, touched=core.probe_touched)
    )
    return []


def _home(core: Core, line: str) -> list[Op]:
    if not core.eeprom.settings[22]:
        raise GcodeError(Status.SETTING_DISABLED)
    axes = core.eeprom.dialect.axes
    if core.eeprom.dialect.cycles and len(line) == len("$HX") and line[2] in axes:
        if not int(core.eeprom.settings[22]) & _SINGLE_AXIS:
            raise GcodeError(Status.SETTING_DISABLED)
        return [("home", axes.index(line[2])), ("homed",)]
    _exactly(line, "$H")
    return [("home", -1), ("homed",)]


def _sleep(_core: Core, line: str) -> list[Op]:
    _exactly(line, "$SLP")
    return [SLEEP_OP]


def _restore(_core: Core, line: str) -> list[Op]:
    if line not in _RESTORES:
        raise GcodeError(Status.INVALID_STATEMENT)
    return [("restore", line[5])]


def _exactly(line: str, wanted: str) -> None:
    if line != wanted:
        raise GcodeError(Status.INVALID_STATEMENT)


def _build_info(core: Core, line: str) -> list[Op]:
    if line == "$I":
        core.say(reports.build_info(core.eeprom))
        return []
    if line[2] != "=":
        raise GcodeError(Status.INVALID_STATEMENT)
    return [("build info", line[3:])]


def _startup(core: Core, line: str) -> list[Op]:
    if line == "$N":
        core.say(reports.startup_lines(core.eeprom))
        return []
    if core.state != State.IDLE:
        raise GcodeError(Status.NOT_IDLE)
    number, at = read_number(line, 2)
    if line[at : at + 1] != "=":
        raise GcodeError(Status.INVALID_STATEMENT)
    if not 0 <= int(number) < STARTUP_LINES:
        raise GcodeError(Status.INVALID_STATEMENT)  # the firmware would write beyond its EEPROM area
    text = line[at + 1 :]
    ops = core.parser.parse(text)
    return [*ops, ("keep", int(number), text)]


def _setting(_core: Core, line: str) -> list[Op]:
    number, at = read_number(line, 1)
    if line[at : at + 1] != "=":
        raise GcodeError(Status.INVALID_STATEMENT)
    value, at = read_number(line, at + 1)
    if at != len(line) or number > _MAX_SETTING or number < 0:
        raise GcodeError(Status.INVALID_STATEMENT)
    return [("setting", int(number), value)]


# only while Idle or in Alarm; any other letter can but be a setting's number
_AT_REST: dict[str, Callable[[Core, str], list[Op]]] = {
    "#": _parameters,
    "H": _home,
    "S": _sleep,
    "I": _build_info,
    "R": _restore,
    "N": _startup,
}


def bytes_written(op: str) -> int:
    """How many EEPROM bytes an operation writes, about."""
    return _ALL_BYTES if op == "restore" else _SETTING_BYTES
