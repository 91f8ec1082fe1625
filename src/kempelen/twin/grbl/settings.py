"""What survives a power cycle: the numbered settings, work offsets and start-up lines of GRBL 1.1h.

Units are GRBL's own here (mm, mm/min, mm/s²); the tuples that motion needs are kept beside in mm and seconds.
Source: GRBL wiki "Grbl v1.1 Configuration"; ``$$`` of a stock 1.1h.
"""

from dataclasses import dataclass, field
from struct import pack
from typing import Any, Self

from kempelen.twin.grbl.dialect import GRBL, Dialect
from kempelen.twin.grbl.status import Status

Vec = tuple[float, ...]
"""One number for each axis, in the order of reports: mm, degrees for an axis that turns."""

G28_INDEX, G30_INDEX = 6, 7
COORDINATE_SETS = 8  # G54..G59, then the two predefined positions
STARTUP_LINES = 2
MAX_LINE = 79  # characters of a stored line
HOMING_CYCLES = range(44, 49)  # $44 to $48: which axes home first, second ..., as bits

_BOOLEANS = frozenset({4, 5, 6, 13, 20, 21, 22, 32})
_BYTES = frozenset({0, 1, 2, 3, 10, 23, 26, *HOMING_CYCLES})
_RPM = frozenset({30, 31})
_FLOATS = frozenset({11, 12, 24, 25, 27})
_AXIS_BASES = (100, 110, 120, 130)
_MIN_STEP_PULSE_US = 3
_HOMING, _SOFT_LIMITS = 22, 20
_LEAST = 1e-3  # a zero would divide by zero; the firmware hangs on it, the twin crawls
_LAST_GENERAL = 99


def default_values(travel: Vec) -> dict[int, float]:
    """``$`` number to value for a gantry with this travel (mm).

    80 steps/mm keep 300 mm/s within the 30 kHz of steps that the processor can make.
    """
    general = {
        0: 10, 1: 255, 2: 0, 3: 0, 4: 0, 5: 0, 6: 0, 10: 1, 11: 0.02, 12: 0.002, 13: 0,
        20: 1, 21: 1, 22: 1, 23: 3, 24: 300, 25: 6000, 26: 25, 27: 2, 30: 1000, 31: 0, 32: 0,
    }  # fmt: skip
    values = {number: float(value) for number, value in general.items()}
    for axis, length in enumerate(travel):
        values |= {100 + axis: 80.0, 110 + axis: 18000.0, 120 + axis: 1500.0, 130 + axis: length}
    return values


class Settings:
    """The numbered settings, checked as GRBL checks them.

    Args:
        values: ``$`` number to value; what is not there is unknown to the firmware.
        dialect: Of the firmware.

    Attributes:
        dialect: Of the firmware.
        values: ``$`` number to value, GRBL's units.
        steps: Steps per mm of each axis.
        rate: Highest speed of each axis, mm/s.
        acceleration: Of each axis, mm/s².
        travel: Of each axis, mm, positive.
    """

    __slots__ = (
        "acceleration", "deviation", "dialect", "hard_limits", "inches", "rate", "soft_limits", "steps",
        "travel", "values",
    )  # fmt: skip

    def __init__(self, values: dict[int, float], dialect: Dialect = GRBL) -> None:
        self.values = values
        self.dialect = dialect
        self._refresh()

    def _refresh(self) -> None:
        values = self.values
        self.steps = self._axes(100)
        self.rate: Vec = tuple(rate / 60.0 for rate in self._axes(110))
        self.acceleration = self._axes(120)
        self.travel = self._axes(130, least=0.0)
        self.deviation = values[11]
        self.soft_limits = bool(values[20])
        self.hard_limits = bool(values[21])
        self.inches = bool(values[13])

    def _axes(self, base: int, least: float = _LEAST) -> Vec:
        return tuple(max(self.values[base + axis], least) for axis in range(len(self.dialect.axes)))

    def replace(self, values: dict[int, float]) -> None:
        """Set everything at once."""
        self.values = dict(values)
        self._refresh()

    def __getitem__(self, number: int) -> float:
        return self.values[number]

    def store(self, number: int, value: float) -> Status:
        """Set ``$number``; the status GRBL answers with. A refused value changes nothing."""
        status = self._checked(number, value)
        if status is Status.OK:
            self.values[number] = self._rounded(number, value)
            if number == _HOMING and not value:
                self.values[_SOFT_LIMITS] = 0.0  # without homing there is nothing to measure limits from
            self._refresh()
        return status

    def _checked(self, number: int, value: float) -> Status:
        if value < 0.0:
            return Status.NEGATIVE_VALUE
        if number not in self.values:
            return Status.INVALID_STATEMENT
        if number == 0 and value < _MIN_STEP_PULSE_US:
            return Status.STEP_PULSE_MIN
        if number == _SOFT_LIMITS and int(value) and not self.values[_HOMING]:
            return Status.SOFT_LIMIT_ERROR
        return Status.OK

    def _rounded(self, number: int, value: float) -> float:
        if number in _BOOLEANS and not (number == _HOMING and self.dialect.cycles):
            return float(bool(int(value) & 0xFF))
        if number in _BYTES or number == _HOMING:
            return float(int(value) & 0xFF)
        return value

    def listing(self) -> str:
        """The lines of ``$$``."""
        return "".join(f"${number}={self._printed(number)}\r\n" for number in sorted(self.values))

    def _printed(self, number: int) -> str:
        value = self.values[number]
        of_an_axis = _LAST_GENERAL < number < _AXIS_BASES[-1] + 10
        return f"{value:.3f}" if number in _FLOATS or of_an_axis else f"{value:.0f}"


@dataclass(slots=True)
class Eeprom:
    """The controller's memory that survives resets and power cycles.

    Attributes:
        settings: The numbered settings.
        defaults: What ``$RST=$`` restores.
        offsets: G54 to G59, then G28 and G30, machine coordinates in mm.
        startup: The lines ``$N0`` and ``$N1``.
        build_info: Free text of ``$I``.
    """

    settings: Settings
    defaults: dict[int, float]
    offsets: list[Vec] = field(default_factory=list)
    startup: list[str] = field(default_factory=lambda: [""] * STARTUP_LINES)
    build_info: str = ""

    def __post_init__(self) -> None:
        self.offsets = self.offsets or self._no_offsets()

    @property
    def dialect(self) -> Dialect:
        """Of the firmware."""
        return self.settings.dialect

    @property
    def zero(self) -> Vec:
        """The origin."""
        return (0.0,) * len(self.dialect.axes)

    def _no_offsets(self) -> list[Vec]:
        return [self.zero] * COORDINATE_SETS

    @classmethod
    def for_travel(
        cls, travel: Vec, settings: dict[int, float] | None = None, dialect: Dialect = GRBL
    ) -> Self:
        """A fresh memory for a machine with that travel (mm); ``settings`` replace single defaults."""
        values = default_values(travel)
        values |= settings or {}
        return cls(Settings(dict(values), dialect), values)

    def write_offset(self, index: int, offset: Vec) -> int:
        """Store a coordinate set; the number of bytes that really had to be written."""
        before, after = (pack(f"<{len(offset)}f", *values) for values in (self.offsets[index], offset))
        self.offsets[index] = offset
        changed = sum(a != b for a, b in zip(before, after, strict=True))
        return changed + 1 if changed else 0  # the checksum goes with them

    def restore(self, what: str) -> None:
        """``$RST=``: ``$`` the settings, ``#`` the offsets, ``*`` everything."""
        if what in {"$", "*"}:
            self.settings.replace(self.defaults)
        if what in {"#", "*"}:
            self.offsets = self._no_offsets()
        if what == "*":
            self.startup = [""] * STARTUP_LINES
            self.build_info = ""

    def snapshot(self) -> dict[str, Any]:
        """Everything, JSON-able."""
        return {
            "settings": [[number, value] for number, value in self.settings.values.items()],
            "defaults": [[number, value] for number, value in self.defaults.items()],
            "offsets": [list(offset) for offset in self.offsets],
            "startup": list(self.startup),
            "build_info": self.build_info,
        }

    @classmethod
    def from_snapshot(cls, state: dict[str, Any], dialect: Dialect = GRBL) -> Self:
        """The inverse of `snapshot`."""
        return cls(
            Settings({int(n): float(v) for n, v in state["settings"]}, dialect),
            {int(n): float(v) for n, v in state["defaults"]},
            [tuple(float(value) for value in offset) for offset in state["offsets"]],
            [str(line) for line in state["startup"]],
            str(state["build_info"]),
        )
