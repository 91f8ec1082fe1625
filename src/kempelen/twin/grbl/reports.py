"""The controller's longer answers. Source: GRBL wiki "Grbl v1.1 Interface"."""

from kempelen.twin.grbl.gcode import ParserState
from kempelen.twin.grbl.settings import Eeprom, Vec
from kempelen.twin.grbl.status import State
from kempelen.twin.grbl.words import MM_PER_INCH, Modes

LOCKED = "[MSG:'$H'|'$X' to unlock]\r\n"
UNLOCKED = "[MSG:Caution: Unlocked]\r\n"
CRITICAL = "[MSG:Reset to continue]\r\n"
CHECK_LIMITS = "[MSG:Check Limits]\r\n"
CHECK_DOOR = "[MSG:Check Door]\r\n"
CHECK_ON, CHECK_OFF = "[MSG:Enabled]\r\n", "[MSG:Disabled]\r\n"
PROGRAM_END = "[MSG:Pgm End]\r\n"
RESTORING = "[MSG:Restoring defaults]\r\n"
RESTORING_SPINDLE = "[MSG:Restoring spindle]\r\n"
SLEEPING = "[MSG:Sleeping]\r\n"
HELP = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]\r\n"

BUSY_STATES = frozenset({State.HOME, State.RUN, State.HOLD, State.JOG, State.DOOR})
_G28_NAMES = ("G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30")
_MOTION_NAMES = {
    0: "G0", 10: "G1", 20: "G2", 30: "G3", 800: "G80", 382: "G38.2", 383: "G38.3", 384: "G38.4", 385: "G38.5",
}  # fmt: skip
_MACHINE_POSITION, _BUFFER_STATE = 1, 2


def coordinate(value: float, *, inches: bool) -> str:
    """A length as printed in reports: ``-0.000`` is legal, as on the firmware."""
    size = abs(value)
    text = f"{size / MM_PER_INCH:.4f}" if inches else f"{size:.3f}"
    return f"-{text}" if value < 0.0 else text


def coordinates(values: Vec, *, inches: bool) -> str:
    """Lengths, separated by commas."""
    return ",".join(coordinate(value, inches=inches) for value in values)


def rate(value: float, *, inches: bool) -> str:
    """A feed rate, mm/min."""
    return f"{value / MM_PER_INCH:.1f}" if inches else f"{value:.0f}"


def parameters(eeprom: Eeprom, parser: ParserState, probe: Vec, *, touched: bool) -> str:
    """The lines of ``$#``."""
    inches = eeprom.settings.inches
    lines = [
        f"[{name}:{coordinates(offset, inches=inches)}]\r\n"
        for name, offset in zip(_G28_NAMES, eeprom.offsets, strict=True)
    ]
    lines += [
        f"[G92:{coordinates(parser.offset, inches=inches)}]\r\n",
        f"[TLO:{coordinate(parser.tool_length, inches=inches)}]\r\n",
        probe_result(probe, touched=touched, inches=inches),
    ]
    return "".join(lines)


def probe_result(position: Vec, *, touched: bool, inches: bool) -> str:
    """Where the probe touched last."""
    return f"[PRB:{coordinates(position, inches=inches)}:{int(touched)}]\r\n"


def modes(parser: ParserState, *, inches: bool) -> str:
    """The line of ``$G``."""
    state: Modes = parser.modes
    words = [
        _MOTION_NAMES[state.motion],
        f"G{54 + state.system}",
        f"G{17 + state.plane}",
        "G20" if state.inches else "G21",
        "G91" if state.relative else "G90",
        "G93" if state.inverse else "G94",
        f"M{state.spindle or 5}",
        "M8" if state.flood else "M9",
        f"T{parser.tool}",
        f"F{rate(parser.feed, inches=inches)}",
        f"S{parser.speed:.0f}",
    ]
    return f"[GC:{' '.join(words)}]\r\n"


def build_info(eeprom: Eeprom) -> str:
    """The lines of ``$I``."""
    return eeprom.dialect.info.format(eeprom.build_info)


def startup_lines(eeprom: Eeprom) -> str:
    """The lines of ``$N``."""
    return "".join(f"$N{number}={line}\r\n" for number, line in enumerate(eeprom.startup))


class StatusReport:
    """Answers ``?``; remembers when offsets and overrides are due again.

    Attributes:
        offset_due: Reports until the next ``WCO:``.
        override_due: Reports until the next ``Ov:``.
    """

    __slots__ = ("offset_due", "override_due")

    _OFFSET_BUSY, _OFFSET_IDLE = 30, 10
    _OVERRIDE_BUSY, _OVERRIDE_IDLE = 20, 10

    def __init__(self) -> None:
        self.offset_due = 0
        self.override_due = 0

    def text(
        self,
        state: str,
        suffix: str,
        position: Vec,
        offset: Vec,
        *,
        mask: int,
        inches: bool,
        buffers: tuple[int, int],
        feed: tuple[float, float],
        pins: str,
        overrides: tuple[int, int, int],
        accessories: str,
    ) -> str:
        """One status report.

        Args:
            state: As in `State`.
            suffix: Sub-state with its colon, or empty.
            position: Machine position, mm.
            offset: Work position is machine position minus this, mm.
            mask: $10.
            inches: $13.
            buffers: Free planner blocks and receive bytes.
            feed: mm/min and rpm.
            pins: Letters of the inputs that are active.
            overrides: Feed, rapid and spindle, percent.
            accessories: Letters of what is switched on.
        """
        if mask & _MACHINE_POSITION:
            place = f"|MPos:{coordinates(position, inches=inches)}"
        else:
            work = tuple(place - shift for place, shift in zip(position, offset, strict=True))
            place = f"|WPos:{coordinates(work, inches=inches)}"
        parts = [f"<{state}{suffix}{place}"]
        if mask & _BUFFER_STATE:
            parts.append(f"|Bf:{buffers[0]},{buffers[1]}")
        parts.append(f"|FS:{rate(feed[0], inches=inches)},{feed[1]:.0f}")
        if pins:
            parts.append(f"|Pn:{pins}")
        parts += [self._offset(state, offset, inches=inches), self._overrides(state, overrides, accessories)]
        return "".join([*parts, ">\r\n"])

    def _offset(self, state: str, offset: Vec, *, inches: bool) -> str:
        if self.offset_due > 0:
            self.offset_due -= 1
            return ""
        self.offset_due = (self._OFFSET_BUSY if state in BUSY_STATES else self._OFFSET_IDLE) - 1
        if self.override_due == 0:
            self.override_due = 1  # in the next report, not in this one as well
        return f"|WCO:{coordinates(offset, inches=inches)}"

    def _overrides(self, state: str, overrides: tuple[int, int, int], accessories: str) -> str:
        if self.override_due > 0:
            self.override_due -= 1
            return ""
        self.override_due = (self._OVERRIDE_BUSY if state in BUSY_STATES else self._OVERRIDE_IDLE) - 1
        text = f"|Ov:{overrides[0]},{overrides[1]},{overrides[2]}"
        return f"{text}|A:{accessories}" if accessories else text
