"""G-code lines: words in, a list of operations out, with GRBL's own order of checks.

Nothing is executed here. A line that passes changes the parser's state at once, as far as the next line's
meaning depends on it, and yields the operations that the main program then carries out one by one.
Source: GRBL 1.1h's supported G-codes and error codes; NIST RS274/NGC version 3, section 3.8 for the order.
"""

import re
from dataclasses import dataclass
from typing import Any

from kempelen.twin.grbl.arcs import ArcError, arc_from_centre, arc_from_radius, arc_points
from kempelen.twin.grbl.settings import AXES, G28_INDEX, G30_INDEX, Eeprom, Vec
from kempelen.twin.grbl.status import Status

Op = tuple[Any, ...]
MM_PER_INCH = 25.4
ZERO: Vec = (0.0, 0.0, 0.0)

SEEK, LINEAR, ARC_CW, ARC_CCW, NO_MOTION = 0, 10, 20, 30, 800
PROBES = (382, 383, 384, 385)
_PROBES_QUIET = (383, 385)
PROBES_AWAY = (384, 385)
FLOW_RUN, FLOW_PAUSE, FLOW_END = 0, 1, 2

_MAX_LINE_NUMBER = 10_000_000
_MAX_TOOL = 255
_SYSTEMS = 6
_BYTE = 0xFF
_OFFSETS_CHANGE: Op = ("wco",)
SYNC: Op = ("sync",)

# letters of modal groups, as bits
_G0, _G1, _G2, _G3, _G4, _G5, _G6, _G7, _G8, _G12, _G13, _M4, _M7, _M8 = (1 << n for n in range(14))
_JOG_GROUPS = _G0 | _G3 | _G6

_MOTION, _NON_MODAL, _TOOL_LENGTH = "motion", "non-modal", "tool length"

# hundredfold code -> (modal group, attribute of the block, its value, axis command)
_G_CODES: dict[int, tuple[int, str, Any, str]] = {
    0: (_G1, "motion", SEEK, _MOTION),
    100: (_G1, "motion", LINEAR, _MOTION),
    200: (_G1, "motion", ARC_CW, _MOTION),
    300: (_G1, "motion", ARC_CCW, _MOTION),
    400: (_G0, "non_modal", "G4", ""),
    1000: (_G0, "non_modal", "G10", _NON_MODAL),
    1700: (_G2, "plane", 0, ""),
    1800: (_G2, "plane", 1, ""),
    1900: (_G2, "plane", 2, ""),
    2000: (_G6, "inches", True, ""),
    2100: (_G6, "inches", False, ""),
    2800: (_G0, "non_modal", "G28", _NON_MODAL),
    2810: (_G0, "non_modal", "G28.1", ""),
    3000: (_G0, "non_modal", "G30", _NON_MODAL),
    3010: (_G0, "non_modal", "G30.1", ""),
    3820: (_G1, "motion", 382, _MOTION),
    3830: (_G1, "motion", 383, _MOTION),
    3840: (_G1, "motion", 384, _MOTION),
    3850: (_G1, "motion", 385, _MOTION),
    4000: (_G7, "", None, ""),
    4310: (_G8, "tool_length", True, _TOOL_LENGTH),
    4900: (_G8, "tool_length", False, _TOOL_LENGTH),
    5300: (_G0, "non_modal", "G53", ""),
    6100: (_G13, "", None, ""),
    8000: (_G1, "motion", NO_MOTION, ""),
    9000: (_G3, "relative", False, ""),
    9100: (_G3, "relative", True, ""),
    9110: (_G4, "", None, ""),
    9200: (_G0, "non_modal", "G92", _NON_MODAL),
    9210: (_G0, "non_modal", "G92.1", ""),
    9300: (_G5, "inverse", True, ""),
    9400: (_G5, "inverse", False, ""),
} | {5400 + 100 * n: (_G12, "system", n, "") for n in range(_SYSTEMS)}

_M_CODES: dict[int, tuple[int, str, Any]] = {
    0: (_M4, "flow", FLOW_PAUSE),
    1: (_M4, "", None),
    2: (_M4, "flow", FLOW_END),
    30: (_M4, "flow", FLOW_END),
    3: (_M7, "spindle", 3),
    4: (_M7, "spindle", 4),
    5: (_M7, "spindle", 0),
    8: (_M8, "flood", True),
    9: (_M8, "flood", False),
}
_KNOWN_G = frozenset(code // 100 for code in _G_CODES)
_DECIMALS_OWN_ERROR = frozenset({28, 30, 38, 43, 61, 90, 91, 92})
_CONFLICTING = frozenset({0, 1, 2, 3, 38, 43, 49})
_VALUE_LETTERS = frozenset("FIJKLNPRSTXYZ")
_NOT_NEGATIVE = frozenset("FNPTS")
_PLANES = ((0, 1, 2), (2, 0, 1), (1, 2, 0))
_IJK = "IJK"

_WORD = re.compile(r"([A-Z])([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")


class GcodeError(Exception):
    """A line that GRBL refuses.

    Args:
        status: The error's number.
    """

    def __init__(self, status: Status) -> None:
        super().__init__(status)
        self.status = status


@dataclass(slots=True)
class Modes:
    """What one line leaves for the next.

    Attributes:
        motion: Ten times the G-code of the motion mode.
        inverse: G93.
        inches: G20.
        relative: G91.
        plane: 0 to 2 for G17 to G19.
        system: 0 to 5 for G54 to G59.
        spindle: 0, 3 or 4.
        flood: M8.
    """

    motion: int = SEEK
    inverse: bool = False
    inches: bool = False
    relative: bool = False
    plane: int = 0
    system: int = 0
    spindle: int = 0
    flood: bool = False


@dataclass(slots=True)
class ParserState:
    """The parser's memory, lost at a reset.

    Attributes:
        modes: Modal groups.
        feed: F, mm/min (1/min in G93).
        speed: S, rpm.
        tool: T.
        position: (x, y, z) where the last line ends, machine frame, mm.
        system: Offset of the active coordinate system, mm.
        offset: G92, mm.
        tool_length: G43.1, mm.
    """

    modes: Modes
    feed: float = 0.0
    speed: float = 0.0
    tool: int = 0
    position: Vec = ZERO
    system: Vec = ZERO
    offset: Vec = ZERO
    tool_length: float = 0.0

    @property
    def work_offset(self) -> Vec:
        """What to subtract from a machine position to get the work position, mm."""
        (sx, sy, sz), (ox, oy, oz) = self.system, self.offset
        return (sx + ox, sy + oy, sz + oz + self.tool_length)


class _Line:
    """One line's words, sorted."""

    __slots__ = (
        "axis_command", "centre", "feed", "flood", "flow", "groups", "inches", "inverse", "motion",
        "non_modal", "plane", "relative", "spindle", "system", "system_offset", "target", "tool_length",
        "unused", "values",
    )  # fmt: skip

    def __init__(self, modes: Modes) -> None:
        self.motion = modes.motion
        self.inverse = modes.inverse
        self.inches = modes.inches
        self.relative = modes.relative
        self.plane = modes.plane
        self.system = modes.system
        self.flow = FLOW_RUN
        self.spindle = modes.spindle
        self.flood = modes.flood
        self.tool_length = False
        self.groups = 0
        self.non_modal = ""
        self.axis_command = ""
        self.values: dict[str, float] = {}
        self.feed = 0.0
        self.system_offset = ZERO
        self.target = ZERO
        self.centre = (0.0, 0.0)
        self.unused: set[str] = set()

    @property
    def axes(self) -> list[int]:
        """Which axis words were given."""
        values = self.values
        return [axis for axis in range(3) if AXES[axis] in values]


def _read(text: str, line: _Line) -> None:
    """Sort the words of ``text`` into ``line``."""
    at, end = 0, len(text)
    match = _WORD.match
    while at < end:
        found = match(text, at)
        if found is None:
            raise GcodeError(
                Status.BAD_NUMBER_FORMAT if "A" <= text[at] <= "Z" else Status.EXPECTED_COMMAND_LETTER
            )
        letter, number = found.groups()
        value = float(number)
        if letter == "G":
            _take_g(line, value)
        elif letter == "M":
            _take_m(line, value)
        else:
            _take_value(line, letter, value)
        at = found.end()


def _take_g(line: _Line, value: float) -> None:
    whole = int(value)
    hundredfold = whole * 100 + round(100 * (value - whole))
    if whole == 49:  # noqa: PLR2004 - G49 ignores its decimals
        hundredfold = 4900
    entry = _G_CODES.get(hundredfold)
    if line.axis_command and (whole in _CONFLICTING or (entry and entry[3])):
        raise GcodeError(Status.AXIS_COMMAND_CONFLICT)
    if entry is None:
        own = whole in _DECIMALS_OWN_ERROR or whole not in _KNOWN_G
        raise GcodeError(Status.UNSUPPORTED_COMMAND if own else Status.VALUE_NOT_INTEGER)
    group, attribute, setting, axis_command = entry
    if line.groups & group:
        raise GcodeError(Status.MODAL_GROUP_VIOLATION)
    line.groups |= group
    if attribute:
        setattr(line, attribute, setting)
    if axis_command:
        line.axis_command = axis_command


def _take_m(line: _Line, value: float) -> None:
    whole = int(value)
    if round(100 * (value - whole)):
        raise GcodeError(Status.VALUE_NOT_INTEGER)
    entry = _M_CODES.get(whole)
    if entry is None:
        raise GcodeError(Status.UNSUPPORTED_COMMAND)
    group, attribute, setting = entry
    if line.groups & group:
        raise GcodeError(Status.MODAL_GROUP_VIOLATION)
    line.groups |= group
    if attribute:
        setattr(line, attribute, setting)


def _take_value(line: _Line, letter: str, value: float) -> None:
    if letter not in _VALUE_LETTERS:
        raise GcodeError(Status.UNSUPPORTED_COMMAND)
    if letter == "T" and value > _MAX_TOOL:
        raise GcodeError(Status.MAX_VALUE_EXCEEDED)
    if letter in line.values:
        raise GcodeError(Status.WORD_REPEATED)
    if value < 0.0 and letter in _NOT_NEGATIVE:
        raise GcodeError(Status.NEGATIVE_VALUE)
    line.values[letter] = value


class Parser:
    """Turns lines into operations.

    Args:
        eeprom: Where coordinate systems are kept.

    Attributes:
        state: What it remembers between lines.
    """

    __slots__ = ("_eeprom", "state")

    def __init__(self, eeprom: Eeprom) -> None:
        self._eeprom = eeprom
        self.reset(ZERO)

    def reset(self, position: Vec) -> None:
        """Start-up modes, at ``position`` (machine frame, mm)."""
        self.state = ParserState(Modes(), position=position, system=self._eeprom.offsets[0])

    def parse(self, text: str, *, jog: bool = False) -> list[Op]:
        """The operations of one line, stripped of spaces and comments, in upper case.

        Args:
            text: Without ``$J=`` when it is a jog.
            jog: Whether it is one.

        Raises:
            GcodeError: GRBL would refuse it; nothing has changed.
        """
        line = _Line(self.state.modes)
        if jog:
            line.motion, line.inverse = LINEAR, False
        _read(text, line)
        self._check(line, jog=jog)
        return self._jog(line) if jog else self._operations(line)

    # --- checks, in GRBL's order ---------------------------------------------------------------------------

    def _check(self, line: _Line, *, jog: bool) -> None:
        values = line.values
        axes = line.axes
        if axes and not line.axis_command:
            line.axis_command = _MOTION
        if values.get("N", 0.0) > _MAX_LINE_NUMBER:
            raise GcodeError(Status.INVALID_LINE_NUMBER)
        line.unused = set(values)
        self._check_feed(line, jog=jog)
        if line.non_modal == "G4":
            if "P" not in values:
                raise GcodeError(Status.VALUE_WORD_MISSING)
            line.unused.discard("P")
        for axis in axes if line.inches else ():
            values[AXES[axis]] *= MM_PER_INCH
        if line.axis_command == _TOOL_LENGTH and line.tool_length and axes != [2]:
            raise GcodeError(Status.G43_DYNAMIC_AXIS)
        line.system_offset = self.state.system
        if line.groups & _G12 and line.system != self.state.modes.system:
            line.system_offset = self._eeprom.offsets[line.system]
        self._check_non_modal(line, axes)
        self._check_motion(line, axes)
        line.unused -= {"N", "F"} if jog else {"N", "F", "S", "T"}
        if line.axis_command:
            line.unused -= {"X", "Y", "Z"}
        if line.unused:
            raise GcodeError(Status.UNUSED_WORDS)

    def _check_feed(self, line: _Line, *, jog: bool) -> None:
        given = line.values.get("F")
        if jog and given is None:
            raise GcodeError(Status.UNDEFINED_FEED_RATE)
        if line.inverse:
            needed = line.axis_command == _MOTION and line.motion not in {NO_MOTION, SEEK}
            if needed and given is None:
                raise GcodeError(Status.UNDEFINED_FEED_RATE)
            line.feed = given or 0.0
        elif given is None:
            line.feed = 0.0 if self.state.modes.inverse else self.state.feed
        else:
            line.feed = given * MM_PER_INCH if line.inches else given

    def _check_non_modal(self, line: _Line, axes: list[int]) -> None:
        if line.non_modal == "G10":
            self._check_g10(line, axes)
        elif line.non_modal == "G92":
            if not axes:
                raise GcodeError(Status.NO_AXIS_WORDS)
            line.target = self._shifted(line, axes, line.system_offset, self.state.offset)
        else:
            if line.axis_command != _TOOL_LENGTH and axes:
                line.target = self._target(line, axes)
            if line.non_modal in {"G28", "G30"} and not axes:
                line.axis_command = ""
            if line.non_modal == "G53" and line.motion not in {SEEK, LINEAR}:
                raise GcodeError(Status.G53_INVALID_MOTION)

    def _check_g10(self, line: _Line, axes: list[int]) -> None:
        values = line.values
        if not axes:
            raise GcodeError(Status.NO_AXIS_WORDS)
        if "P" not in values and "L" not in values:
            raise GcodeError(Status.VALUE_WORD_MISSING)
        number = int(values.get("P", 0.0))
        if number > _SYSTEMS:
            raise GcodeError(Status.UNSUPPORTED_COORDINATES)
        mode = int(values.get("L", 0.0))
        if mode not in {2, 20} or (mode == 2 and "R" in values):  # noqa: PLR2004 - G10 L2
            raise GcodeError(Status.UNSUPPORTED_COMMAND)
        line.unused -= {"L", "P"}
        stored = self._eeprom.offsets[number - 1 if number else line.system]
        if mode == 2:  # noqa: PLR2004 - G10 L2
            line.target = self._merged(stored, {axis: values[AXES[axis]] for axis in axes})
        else:
            line.target = self._shifted(line, axes, self.state.offset, stored)

    def _shifted(self, line: _Line, axes: list[int], known: Vec, kept: Vec) -> Vec:
        """The offset that makes the given axis words the present work position; others are ``kept``."""
        state = self.state
        new = {}
        for axis in axes:
            tool = state.tool_length if axis == 2 else 0.0  # noqa: PLR2004 - z
            new[axis] = state.position[axis] - known[axis] - line.values[AXES[axis]] - tool
        return self._merged(kept, new)

    @staticmethod
    def _merged(kept: Vec, new: dict[int, float]) -> Vec:
        return (new.get(0, kept[0]), new.get(1, kept[1]), new.get(2, kept[2]))

    def _target(self, line: _Line, axes: list[int]) -> Vec:
        state = self.state
        target = list(state.position)
        values, system, offset = line.values, line.system_offset, state.offset
        absolute = line.non_modal == "G53"
        for axis in axes:
            value = values[AXES[axis]]
            if absolute:
                target[axis] = value
            elif line.relative:
                target[axis] += value
            else:
                target[axis] = value + system[axis] + offset[axis]
                if axis == 2:  # noqa: PLR2004 - z
                    target[axis] += state.tool_length
        return (target[0], target[1], target[2])

    def _check_motion(self, line: _Line, axes: list[int]) -> None:
        if line.motion == NO_MOTION:
            if axes:
                raise GcodeError(Status.AXIS_WORDS_EXIST)
            return
        if line.axis_command != _MOTION:
            return
        if line.motion != SEEK and line.feed == 0.0:
            raise GcodeError(Status.UNDEFINED_FEED_RATE)
        if line.motion in {SEEK, LINEAR}:
            if not axes:
                line.axis_command = ""
            return
        if not axes:
            raise GcodeError(Status.NO_AXIS_WORDS)
        if line.motion in PROBES:
            if line.target == self.state.position:
                raise GcodeError(Status.INVALID_TARGET)
        else:
            self._check_arc(line, axes)

    def _check_arc(self, line: _Line, axes: list[int]) -> None:
        first, second, _ = _PLANES[line.plane]
        if first not in axes and second not in axes:
            raise GcodeError(Status.NO_AXIS_WORDS_IN_PLANE)
        values = line.values
        scale = MM_PER_INCH if line.inches else 1.0
        start, target = self.state.position, line.target
        chord = (target[first] - start[first], target[second] - start[second])
        try:
            if "R" in values:
                line.unused.discard("R")
                if target == start:
                    raise GcodeError(Status.INVALID_TARGET)
                centre = arc_from_radius(chord, values["R"] * scale, clockwise=line.motion == ARC_CW)
            else:
                if _IJK[first] not in values and _IJK[second] not in values:
                    raise GcodeError(Status.NO_OFFSETS_IN_PLANE)
                line.unused -= set(_IJK)
                centre = (values.get(_IJK[first], 0.0) * scale, values.get(_IJK[second], 0.0) * scale)
                arc_from_centre(chord, centre)
        except ArcError as error:
            raise GcodeError(error.status) from None
        line.centre = centre

    # --- operations, in GRBL's order -----------------------------------------------------------------------

    def _jog(self, line: _Line) -> list[Op]:
        if line.groups & ~_JOG_GROUPS or line.non_modal not in {"", "G53"}:
            raise GcodeError(Status.INVALID_JOG)
        return [("jog", line.target, line.feed / 60.0), ("jogging",), ("at", line.target)]

    def _operations(self, line: _Line) -> list[Op]:
        state, modes, values = self.state, self.state.modes, line.values
        ops: list[Op] = []
        modes.inverse = line.inverse
        state.feed = line.feed
        speed = values.get("S", state.speed)
        if speed != state.speed and modes.spindle:
            ops += [SYNC, ("spindle", modes.spindle, speed)]
        state.speed = speed
        state.tool = int(values.get("T", 0.0))  # GRBL forgets the tool on every line without T
        if line.spindle != modes.spindle:
            ops += [SYNC, ("spindle", line.spindle, speed)]
        if line.flood != modes.flood:
            ops += [SYNC, ("coolant", line.flood)]
        if line.non_modal == "G4":
            ops += [SYNC, ("dwell", values["P"])]
        modes.plane, modes.inches, modes.relative = line.plane, line.inches, line.relative
        self._change_offsets(line, ops)
        if line.non_modal:
            self._add_non_modal(line, ops)
        modes.motion = line.motion
        if line.axis_command == _MOTION and line.motion != NO_MOTION and line.non_modal not in {"G28", "G30"}:
            self._add_motion(line, ops)
        if line.flow:
            ops += [SYNC, ("flow", line.flow)]
        return ops

    def _change_offsets(self, line: _Line, ops: list[Op]) -> None:
        state = self.state
        if line.axis_command == _TOOL_LENGTH:
            length = line.values["Z"] if line.tool_length else 0.0
            if length != state.tool_length:
                state.tool_length = length
                ops += [SYNC, _OFFSETS_CHANGE]
        if line.system != state.modes.system:
            state.modes.system = line.system
            state.system = line.system_offset
            ops += [SYNC, _OFFSETS_CHANGE]

    def _add_non_modal(self, line: _Line, ops: list[Op]) -> None:
        state, kind = self.state, line.non_modal
        if kind == "G10":
            number = int(line.values.get("P", 0.0))
            index = number - 1 if number else line.system
            ops += [SYNC, ("write", index, line.target)]
            if index == state.modes.system:
                ops += [("system", line.target), SYNC, _OFFSETS_CHANGE]
        elif kind in {"G28", "G30"}:
            self._go_home(line, ops)
        elif kind in {"G28.1", "G30.1"}:
            ops += [SYNC, ("write", G28_INDEX if kind == "G28.1" else G30_INDEX, state.position)]
        elif kind in {"G92", "G92.1"}:
            state.offset = line.target if kind == "G92" else ZERO
            ops += [SYNC, _OFFSETS_CHANGE]

    def _go_home(self, line: _Line, ops: list[Op]) -> None:
        stored = self._eeprom.offsets[G28_INDEX if line.non_modal == "G28" else G30_INDEX]
        if line.axis_command:
            ops.append(("line", line.target, 0.0, True, False))
            stored = self._merged(self.state.position, {axis: stored[axis] for axis in line.axes})
        ops.append(("line", stored, 0.0, True, False))
        self.state.position = stored

    def _add_motion(self, line: _Line, ops: list[Op]) -> None:
        state, target = self.state, line.target
        rate = line.feed / 60.0
        if line.motion in {SEEK, LINEAR}:
            ops.append(("line", target, rate, line.motion == SEEK, line.inverse))
        elif line.motion in PROBES:
            quiet, away = line.motion in _PROBES_QUIET, line.motion in PROBES_AWAY
            ops += [SYNC, ("probe", target, rate, quiet, away)]
            return
        else:
            points = arc_points(
                state.position,
                target,
                line.centre,
                _PLANES[line.plane],
                clockwise=line.motion == ARC_CW,
                tolerance=self._eeprom.settings[12],
            )
            if line.inverse:  # the time asked for is that of the whole arc
                rate *= len(points)
            ops += [("line", point, rate, False, line.inverse) for point in points]
        state.position = target
