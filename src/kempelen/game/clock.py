"""A chess clock (FIDE Laws of Chess 2023, article 6): pure arithmetic, its time comes from outside.

The time of a side runs while that side decides, and at no other time: what the robot needs to carry the
pieces counts for nobody.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import chess

from kempelen.core.errors import ConfigError

LONGEST_S = 10 * 3600.0
LONGEST_INCREMENT_S = 180.0


@dataclass(frozen=True, slots=True)
class TimeControl:
    """So much time for the game, and so much more for each move; s.

    Raises:
        ConfigError: out of range.
    """

    seconds: float
    increment: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.seconds <= LONGEST_S or not 0 <= self.increment <= LONGEST_INCREMENT_S:
            raise ConfigError(
                f"A time control of {self.seconds:g} s and {self.increment:g} s a move is out of range.",
                hint=f"Up to {LONGEST_S:g} s for the game, and up to {LONGEST_INCREMENT_S:g} s a move.",
            )

    def __str__(self) -> str:
        """As the PGN tag TimeControl has it: ``300+2``."""
        return f"{self.seconds:g}+{self.increment:g}" if self.increment else f"{self.seconds:g}"


@dataclass(frozen=True, slots=True)
class ClockReading:
    """What a clock shows.

    Attributes:
        white: Left, s; never below 0.
        black: Left, s.
        running: Whose time runs; None for nobody's.
    """

    white: float
    black: float
    running: chess.Color | None = None

    def left(self, colour: chess.Color) -> float:
        """Of one side, s."""
        return self.white if colour else self.black


class ChessClock:
    """Two times, of which at most one runs.

    Args:
        control: How much, and how much more for each move.
        now: A clock that never goes back, s.
    """

    def __init__(self, control: TimeControl, now: Callable[[], float]) -> None:
        self.control = control
        self._now = now
        self._left = {chess.WHITE: control.seconds, chess.BLACK: control.seconds}
        self._running: chess.Color | None = None
        self._since = 0.0

    def set_to(self, white: float, black: float) -> Self:
        """Show these times, s; nobody's runs."""
        self._left, self._running = {chess.WHITE: white, chess.BLACK: black}, None
        return self

    def start(self, colour: chess.Color) -> None:
        """The time of a side runs from now on."""
        self.stop()
        self._running, self._since = colour, self._now()

    def stop(self) -> None:
        """Nobody's time runs."""
        if self._running is not None:
            self._left[self._running] = self._now_left(self._running)
            self._running = None

    def moved(self, colour: chess.Color) -> None:
        """A side has decided: its time stops and gets the increment, unless there was none left."""
        self.stop()
        if self._left[colour] > 0:
            self._left[colour] += self.control.increment

    def read(self) -> ClockReading:
        """Now."""
        return ClockReading(self._now_left(chess.WHITE), self._now_left(chess.BLACK), self._running)

    def _now_left(self, colour: chess.Color) -> float:
        gone = self._now() - self._since if self._running is colour else 0.0
        return max(self._left[colour] - gone, 0.0)
