"""How long the controller really takes for a list of lines, without a wire or a clock."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempelen.core.errors import TwinError
from kempelen.twin.grbl.controller import VirtualGrbl
from kempelen.twin.grbl.machine import Machine
from kempelen.twin.grbl.settings import Eeprom, Vec

_IN_FLIGHT = 120  # bytes a careful sender keeps under way
_STEP_S = 0.008
_LONGEST_S = 3600.0


@dataclass(frozen=True)
class Execution:
    """What came of it.

    Attributes:
        time_s: From the first byte to standstill.
        samples: (n, 4) float: t in s, then x, y, z in mm, machine frame; n is 0 unless asked for.
    """

    time_s: float
    samples: NDArray[np.float64]


def execute(
    lines: Sequence[str],
    *,
    travel: Vec,
    start: Vec,
    settings: Mapping[int, float] | None = None,
    sample_s: float | None = None,
) -> Execution:
    """Let the controller drive ``lines`` from standstill, fed as a character-counting host would.

    Args:
        lines: Without line ends; coordinates are machine coordinates (G54 is zero).
        travel: Of the axes, mm.
        start: Where the carriage stands, machine frame, mm.
        settings: ``$`` numbers that differ from the defaults.
        sample_s: Distance of the samples in time; None for none.

    Raises:
        TwinError: the controller refuses a line or raises an alarm.
    """
    controller = _ready(travel, start, settings or {})
    feed = _Feed([line.encode("ascii") + b"\n" for line in lines])
    begin = controller.time_s
    step = sample_s or _STEP_S
    samples = [(0.0, *controller.position_mm)]
    while True:
        controller.receive(feed.next())
        controller.advance(0.0)
        if feed.answers(controller.take_output()):
            continue
        if feed.done and controller.idle():
            break
        controller.advance(step)
        samples.append((controller.time_s - begin, *controller.position_mm))
        if controller.time_s - begin > _LONGEST_S:
            raise TwinError(
                f"The controller is still at work after {_LONGEST_S:.0f} s.", hint="Check the feed rates."
            )
    kept = samples if sample_s else []
    return Execution(
        max(controller.settled_at - begin, 0.0), np.array(kept, dtype=np.float64).reshape(len(kept), 4)
    )


def _ready(travel: Vec, start: Vec, settings: Mapping[int, float]) -> VirtualGrbl:
    """A controller that has booted and knows where it is."""
    eeprom = Eeprom.for_travel(travel, dict(settings))
    controller = VirtualGrbl(Machine(travel, start), eeprom=eeprom)
    controller.assume_homed()
    return controller


class _Feed:
    """A character-counting sender.

    Args:
        lines: Encoded, with line ends.
    """

    def __init__(self, lines: list[bytes]) -> None:
        self._lines = lines
        self._next = 0
        self._answered = 0
        self._under_way = 0

    @property
    def done(self) -> bool:
        """Whether every line has been answered."""
        return self._answered == len(self._lines)

    def next(self) -> bytes:
        """What may be sent now."""
        sent = []
        while self._next < len(self._lines):
            line = self._lines[self._next]
            if self._under_way + len(line) > _IN_FLIGHT:
                break
            sent.append(line)
            self._under_way += len(line)
            self._next += 1
        return b"".join(sent)

    def answers(self, data: bytes) -> int:
        """Take the controller's answers; how many there were.

        Raises:
            TwinError: one is not ``ok``.
        """
        count = 0
        for answer in data.split(b"\r\n"):
            if answer == b"ok":
                self._under_way -= len(self._lines[self._answered])
                self._answered += 1
                count += 1
            elif answer:
                line = self._lines[min(self._answered, len(self._lines) - 1)].decode().strip()
                raise TwinError(
                    f"Line {self._answered + 1}, {line!r}: the controller says {answer.decode('latin-1')!r}.",
                    hint="Keep the path within the travel and the G-code that GRBL knows.",
                )
        return count
