"""G-code lines: words in, a list of operations out, with GRBL's own order of checks.

Nothing is executed here. A line that passes changes the parser's state at once, as far as the next line's
meaning depends on it, and yields the operations that the main program then carries out one by one.
Source: GRBL 1.1h's supported G-codes and error codes; NIST RS274/NGC version 3, section 3.8 for the order.
"""

from dataclasses import dataclass
from typing import Any

from kempelen.twin.grbl.arcs import arc_from_radius, arc_points, check_centre
from kempelen.twin.grbl.settings import G28_INDEX, G30_INDEX, Eeprom, Vec
from kempelen.twin.grbl.status import Status
from kempelen.twin.grbl.words import (
    ARC_CW,
    G12,
    IJK,
    JOG_GROUPS,
    LINEAR,
    MM_PER_INCH,
    MOTION,
    NO_MOTION,
    PLANES,
    SEEK,
    SYSTEMS,
    TOOL_LENGTH,
    GcodeError,
    Line,
    Modes,
    read_words,
)  # fmt: skip

Op = tuple[Any, ...]

_PROBES = (382, 383, 384, 385)
_PROBES_QUIET = (383, 385)
_PROBES_AWAY = (384, 385)
_MAX_LINE_NUMBER = 10_000_000
TOOL_AXIS = 2  # z: along which a tool has a length
_OFFSETS_CHANGE: Op = ("wco",)
_SYNC: Op = ("sync",)


@dataclass(slots=True)
class ParserState:
    """The parser's memory, lost at a reset.

    Attributes:
        modes: Modal groups.
        feed: F, mm/min (1/min in G93).
        speed: S, rpm.
        tool: T.
        position: Where the last line ends, machine frame, mm.
        system: Offset of the active coordinate system, mm.
        offset: G92, mm.
        tool_length: G43.1, mm.
    """

    modes: Modes
    position: Vec
    system: Vec
    offset: Vec
    feed: float = 0.0
    speed: float = 0.0
    tool: int = 0
    tool_length: float = 0.0

    @property
    def work_offset(self) -> Vec:
        """What to subtract from a machine position to get the work position, mm."""
        return tuple(
            system + offset + (self.tool_length if axis == TOOL_AXIS else 0.0)
            for axis, (system, offset) in enumerate(zip(self.system, self.offset, strict=True))
        )


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
        self.reset(eeprom.zero)

    def reset(self, position: Vec) -> None:
        """Start-up modes, at ``position`` (machine frame, mm)."""
        self.state = ParserState(Modes(), position, self._eeprom.offsets[0], self._eeprom.zero)

    def parse(self, text: str, *, jog: bool = False) -> list[Op]:
        """The operations of one line, stripped of spaces and comments, in upper case.

        Args:
            text: Without ``$J=`` when it is a jog.
            jog: Whether it is one.

        Raises:
            GcodeError: GRBL would refuse it; nothing has changed.
        """
        line = Line(self.state.modes, self._eeprom.dialect.axes)
        if jog:
            line.motion, line.inverse = LINEAR, False
        read_words(text, line)
        self._check(line, jog=jog)
        return self._jog(line) if jog else self._operations(line)

    # --- checks, in GRBL's order ---------------------------------------------------------------------------

    def _check(self, line: Line, *, jog: bool) -> None:
        values = line.values
        axes = line.axes
        if axes and not line.axis_command:
            line.axis_command = MOTION
        if values.get("N", 0.0) > _MAX_LINE_NUMBER:
            raise GcodeError(Status.INVALID_LINE_NUMBER)
        line.unused = set(values)
        self._check_feed(line, jog=jog)
        if line.non_modal == "G4":
            if "P" not in values:
                raise GcodeError(Status.VALUE_WORD_MISSING)
            line.unused.discard("P")
        for axis in axes[:3] if line.inches else ():  # what turns is told in degrees
            values[line.letters[axis]] *= MM_PER_INCH
        if line.axis_command == TOOL_LENGTH and line.tool_length and axes != [TOOL_AXIS]:
            raise GcodeError(Status.G43_DYNAMIC_AXIS)
        line.system_offset = self.state.system
        if line.groups & G12 and line.system != self.state.modes.system:
            line.system_offset = self._eeprom.offsets[line.system]
        self._check_non_modal(line, axes)
        self._check_motion(line, axes)
        line.unused -= {"N", "F"} if jog else {"N", "F", "S", "T"}
        if line.axis_command:
            line.unused -= set(line.letters)
        if line.unused:
            raise GcodeError(Status.UNUSED_WORDS)

    def _check_feed(self, line: Line, *, jog: bool) -> None:
        given = line.values.get("F")
        if jog and given is None:
            raise GcodeError(Status.UNDEFINED_FEED_RATE)
        if line.inverse:
            needed = line.axis_command == MOTION and line.motion not in {NO_MOTION, SEEK}
            if needed and given is None:
                raise GcodeError(Status.UNDEFINED_FEED_RATE)
            line.feed = given or 0.0
        elif given is None:
            line.feed = 0.0 if self.state.modes.inverse else self.state.feed
        else:
            line.feed = given * MM_PER_INCH if line.inches else given

    def _check_non_modal(self, line: Line, axes: list[int]) -> None:
        if line.non_modal == "G10":
            self._check_g10(line, axes)
        elif line.non_modal == "G92":
            if not axes:
                raise GcodeError(Status.NO_AXIS_WORDS)
            line.target = self._shifted(line, axes, line.system_offset, self.state.offset)
        else:
            if line.axis_command != TOOL_LENGTH and axes:
                line.target = self._target(line, axes)
            if line.non_modal in {"G28", "G30"} and not axes:
                line.axis_command = ""
            if line.non_modal == "G53" and line.motion not in {SEEK, LINEAR}:
                raise GcodeError(Status.G53_INVALID_MOTION)

    def _check_g10(self, line: Line, axes: list[int]) -> None:
        values = line.values
        if not axes:
            raise GcodeError(Status.NO_AXIS_WORDS)
        if "P" not in values and "L" not in values:
            raise GcodeError(Status.VALUE_WORD_MISSING)
        number = int(values.get("P", 0.0))
        if number > SYSTEMS:
            raise GcodeError(Status.UNSUPPORTED_COORDINATES)
        mode = int(values.get("L", 0.0))
        if mode not in {2, 20} or (mode == 2 and "R" in values):  # noqa: PLR2004 - G10 L2
            raise GcodeError(Status.UNSUPPORTED_COMMAND)
        line.unused -= {"L", "P"}
        stored = self._eeprom.offsets[number - 1 if number else line.system]
        if mode == 2:  # noqa: PLR2004 - G10 L2
            line.target = self._merged(stored, {axis: values[line.letters[axis]] for axis in axes})
        else:
            line.target = self._shifted(line, axes, self.state.offset, stored)

    def _shifted(self, line: Line, axes: list[int], known: Vec, kept: Vec) -> Vec:
        """The offset that makes the given axis words the present work position; others are ``kept``."""
        state = self.state
        new = {}
        for axis in axes:
            tool = state.tool_length if axis == TOOL_AXIS else 0.0
            new[axis] = state.position[axis] - known[axis] - line.values[line.letters[axis]] - tool
        return self._merged(kept, new)

    @staticmethod
    def _merged(kept: Vec, new: dict[int, float]) -> Vec:
        return tuple(new.get(axis, value) for axis, value in enumerate(kept))

    def _target(self, line: Line, axes: list[int]) -> Vec:
        state = self.state
        target = list(state.position)
        values, system, offset = line.values, line.system_offset, state.offset
        absolute = line.non_modal == "G53"
        for axis in axes:
            value = values[line.letters[axis]]
            if absolute:
                target[axis] = value
            elif line.relative:
                target[axis] += value
            else:
                target[axis] = value + system[axis] + offset[axis]
                if axis == TOOL_AXIS:
                    target[axis] += state.tool_length
        return tuple(target)

    def _check_motion(self, line: Line, axes: list[int]) -> None:
        if line.motion == NO_MOTION:
            if axes:
                raise GcodeError(Status.AXIS_WORDS_EXIST)
            return
        if line.axis_command != MOTION:
            return
        if line.motion != SEEK and line.feed == 0.0:
            raise GcodeError(Status.UNDEFINED_FEED_RATE)
        if line.motion in {SEEK, LINEAR}:
            if not axes:
                line.axis_command = ""
            return
        if not axes:
            raise GcodeError(Status.NO_AXIS_WORDS)
        if line.motion in _PROBES:
            if line.target == self.state.position:
                raise GcodeError(Status.INVALID_TARGET)
        else:
            self._check_arc(line, axes)

    def _check_arc(self, line: Line, axes: list[int]) -> None:
        first, second, _ = PLANES[line.plane]
        if first not in axes and second not in axes:
            raise GcodeError(Status.NO_AXIS_WORDS_IN_PLANE)
        values = line.values
        scale = MM_PER_INCH if line.inches else 1.0
        start, target = self.state.position, line.target
        chord = (target[first] - start[first], target[second] - start[second])
        if "R" in values:
            line.unused.discard("R")
            if target == start:
                raise GcodeError(Status.INVALID_TARGET)
            line.centre = arc_from_radius(chord, values["R"] * scale, clockwise=line.motion == ARC_CW)
        else:
            if IJK[first] not in values and IJK[second] not in values:
                raise GcodeError(Status.NO_OFFSETS_IN_PLANE)
            line.unused -= set(IJK)
            line.centre = (values.get(IJK[first], 0.0) * scale, values.get(IJK[second], 0.0) * scale)
            check_centre(chord, line.centre)

    # --- operations, in GRBL's order -----------------------------------------------------------------------

    def _jog(self, line: Line) -> list[Op]:
        if line.groups & ~JOG_GROUPS or line.non_modal not in {"", "G53"}:
            raise GcodeError(Status.INVALID_JOG)
        return [("jog", line.target, line.feed / 60.0), ("jogging",), ("at", line.target)]

    def _operations(self, line: Line) -> list[Op]:
        state, modes, values = self.state, self.state.modes, line.values
        ops: list[Op] = []
        modes.inverse = line.inverse
        state.feed = line.feed
        speed = values.get("S", state.speed)
        if speed != state.speed and modes.spindle:
            ops += [_SYNC, ("spindle", modes.spindle, speed)]
        state.speed = speed
        state.tool = int(values.get("T", 0.0))  # GRBL forgets the tool on every line without T
        if line.spindle != modes.spindle:
            ops += [_SYNC, ("spindle", line.spindle, speed)]
        if line.flood != modes.flood:
            ops += [_SYNC, ("coolant", line.flood)]
        if line.non_modal == "G4":
            ops += [_SYNC, ("dwell", values["P"])]
        modes.plane, modes.inches, modes.relative = line.plane, line.inches, line.relative
        self._change_offsets(line, ops)
        if line.non_modal:
            self._add_non_modal(line, ops)
        modes.motion = line.motion
        if line.axis_command == MOTION and line.motion != NO_MOTION and line.non_modal not in {"G28", "G30"}:
            self._add_motion(line, ops)
        if line.flow:
            ops += [_SYNC, ("flow", line.flow)]
        return ops

    def _change_offsets(self, line: Line, ops: list[Op]) -> None:
        state = self.state
        if line.axis_command == TOOL_LENGTH:
            length = line.values["Z"] if line.tool_length else 0.0
            if length != state.tool_length:
                state.tool_length = length
                ops += [_SYNC, _OFFSETS_CHANGE]
        if line.system != state.modes.system:
            state.modes.system = line.system
            state.system = line.system_offset
            ops += [_SYNC, _OFFSETS_CHANGE]

    def _add_non_modal(self, line: Line, ops: list[Op]) -> None:
        state, kind = self.state, line.non_modal
        if kind == "G10":
            number = int(line.values.get("P", 0.0))
            index = number - 1 if number else line.system
            ops += [_SYNC, ("write", index, line.target)]
            if index == state.modes.system:
                ops += [("system", line.target), _SYNC, _OFFSETS_CHANGE]
        elif kind in {"G28", "G30"}:
            self._go_home(line, ops)
        elif kind in {"G28.1", "G30.1"}:
            ops += [_SYNC, ("write", G28_INDEX if kind == "G28.1" else G30_INDEX, state.position)]
        elif kind in {"G92", "G92.1"}:
            state.offset = line.target if kind == "G92" else self._eeprom.zero
            ops += [_SYNC, _OFFSETS_CHANGE]

    def _go_home(self, line: Line, ops: list[Op]) -> None:
        stored = self._eeprom.offsets[G28_INDEX if line.non_modal == "G28" else G30_INDEX]
        if line.axis_command:
            ops.append(("line", line.target, 0.0, True, False))
            stored = self._merged(self.state.position, {axis: stored[axis] for axis in line.axes})
        ops.append(("line", stored, 0.0, True, False))
        self.state.position = stored

    def _add_motion(self, line: Line, ops: list[Op]) -> None:
        state, target = self.state, line.target
        rate = line.feed / 60.0
        if line.motion in {SEEK, LINEAR}:
            ops.append(("line", target, rate, line.motion == SEEK, line.inverse))
        elif line.motion in _PROBES:
            quiet, away = line.motion in _PROBES_QUIET, line.motion in _PROBES_AWAY
            ops += [_SYNC, ("probe", target, rate, quiet, away)]
            return
        else:
            points = arc_points(
                state.position,
                target,
                line.centre,
                PLANES[line.plane],
                clockwise=line.motion == ARC_CW,
                tolerance=self._eeprom.settings[12],
            )
            if line.inverse:  # the time asked for is that of the whole arc
                rate *= len(points)
            ops += [("line", point, rate, False, line.inverse) for point in points]
        state.position = target
