"""The words of a G-code line: what GRBL 1.1h knows, and how it objects to the rest.

Source: GRBL 1.1h's supported G-codes; NIST RS274/NGC version 3, table 4 for the modal groups.
"""

import re
from dataclasses import dataclass
from typing import Any

from kempelen.twin.grbl.settings import Vec
from kempelen.twin.grbl.status import Status

MM_PER_INCH = 25.4
SEEK, LINEAR, ARC_CW, ARC_CCW, NO_MOTION = 0, 10, 20, 30, 800
FLOW_RUN, FLOW_PAUSE, FLOW_END = 0, 1, 2
SYSTEMS = 6
PLANES = ((0, 1, 2), (2, 0, 1), (1, 2, 0))  # first, second and linear axis of G17 to G19
IJK = "IJK"

_MAX_TOOL = 255

# letters of modal groups, as bits
_G0, _G1, _G2, _G3, _G4, _G5, _G6, _G7, _G8, G12, _G13, _M4, _M7, _M8 = (1 << n for n in range(14))
JOG_GROUPS = _G0 | _G3 | _G6

MOTION, NON_MODAL, TOOL_LENGTH = "motion", "non-modal", "tool length"

# hundredfold code -> (modal group, attribute of the block, its value, axis command)
_G_CODES: dict[int, tuple[int, str, Any, str]] = {
    0: (_G1, "motion", SEEK, MOTION),
    100: (_G1, "motion", LINEAR, MOTION),
    200: (_G1, "motion", ARC_CW, MOTION),
    300: (_G1, "motion", ARC_CCW, MOTION),
    400: (_G0, "non_modal", "G4", ""),
    1000: (_G0, "non_modal", "G10", NON_MODAL),
    1700: (_G2, "plane", 0, ""),
    1800: (_G2, "plane", 1, ""),
    1900: (_G2, "plane", 2, ""),
    2000: (_G6, "inches", True, ""),
    2100: (_G6, "inches", False, ""),
    2800: (_G0, "non_modal", "G28", NON_MODAL),
    2810: (_G0, "non_modal", "G28.1", ""),
    3000: (_G0, "non_modal", "G30", NON_MODAL),
    3010: (_G0, "non_modal", "G30.1", ""),
    3820: (_G1, "motion", 382, MOTION),
    3830: (_G1, "motion", 383, MOTION),
    3840: (_G1, "motion", 384, MOTION),
    3850: (_G1, "motion", 385, MOTION),
    4000: (_G7, "", None, ""),
    4310: (_G8, "tool_length", True, TOOL_LENGTH),
    4900: (_G8, "tool_length", False, TOOL_LENGTH),
    5300: (_G0, "non_modal", "G53", ""),
    6100: (_G13, "", None, ""),
    8000: (_G1, "motion", NO_MOTION, ""),
    9000: (_G3, "relative", False, ""),
    9100: (_G3, "relative", True, ""),
    9110: (_G4, "", None, ""),
    9200: (_G0, "non_modal", "G92", NON_MODAL),
    9210: (_G0, "non_modal", "G92.1", ""),
    9300: (_G5, "inverse", True, ""),
    9400: (_G5, "inverse", False, ""),
} | {5400 + 100 * n: (G12, "system", n, "") for n in range(SYSTEMS)}

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
_VALUE_LETTERS = frozenset("FIJKLNPRST")
_NOT_NEGATIVE = frozenset("FNPTS")

_DIGITS = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
_NUMBER = re.compile(_DIGITS)
_WORD = re.compile(rf"([A-Z])({_DIGITS})")


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


class Line:
    """One line's words, sorted.

    Args:
        modes: As the line before left them.
        letters: Of the axes, in order.
    """

    __slots__ = (
        "axis_command", "centre", "feed", "flood", "flow", "groups", "inches", "inverse", "letters",
        "motion", "non_modal", "plane", "relative", "spindle", "system", "system_offset", "target",
        "tool_length", "unused", "values",
    )  # fmt: skip

    def __init__(self, modes: Modes, letters: str) -> None:
        self.letters = letters
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
        self.system_offset: Vec = ()
        self.target: Vec = ()
        self.centre = (0.0, 0.0)
        self.unused: set[str] = set()

    @property
    def axes(self) -> list[int]:
        """Which axis words were given."""
        values = self.values
        return [axis for axis, letter in enumerate(self.letters) if letter in values]


def read_words(text: str, line: Line) -> None:
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


def _take_g(line: Line, value: float) -> None:
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


def _take_m(line: Line, value: float) -> None:
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


def _take_value(line: Line, letter: str, value: float) -> None:
    if letter not in _VALUE_LETTERS and letter not in line.letters:
        raise GcodeError(Status.UNSUPPORTED_COMMAND)
    if letter == "T" and value > _MAX_TOOL:
        raise GcodeError(Status.MAX_VALUE_EXCEEDED)
    if letter in line.values:
        raise GcodeError(Status.WORD_REPEATED)
    if value < 0.0 and letter in _NOT_NEGATIVE:
        raise GcodeError(Status.NEGATIVE_VALUE)
    line.values[letter] = value


def read_number(text: str, at: int) -> tuple[float, int]:
    """The number at ``at`` and where it ends: a sign, digits, one point; no exponent.

    Raises:
        GcodeError: there is none.
    """
    found = _NUMBER.match(text, at)
    if found is None:
        raise GcodeError(Status.BAD_NUMBER_FORMAT)
    return float(found.group()), found.end()
