"""What the senses report: what stands on the squares, and whether they can see at all."""

from collections.abc import AsyncIterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import chess
import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array

EMPTY, WHITE, BLACK = 0, 1, 2
"""Columns of an observation."""


def states_of(board: chess.BaseBoard) -> npt.NDArray[np.int64]:
    """(64,) EMPTY, WHITE or BLACK: what an observation of this position should show."""
    out = np.full(64, EMPTY, dtype=np.int64)
    out[list(chess.SquareSet(board.occupied_co[chess.WHITE]))] = WHITE
    out[list(chess.SquareSet(board.occupied_co[chess.BLACK]))] = BLACK
    return out


class Sight(StrEnum):
    """Whether a sensor sees the board, and if not, why."""

    CLEAR = "clear"
    HAND = "hand"  # a hand or the robot is over the board
    STARTING = "starting"  # still learning what the board looks like
    NO_CAMERA = "no camera"  # absent, unplugged, its process died
    NO_BOARD = "no board"  # none in view, half of one, two of them
    MOVED = "moved"  # the board or the camera was bumped; being found again
    DARK = "dark"  # lights off
    COVERED = "covered"  # the lens, or the whole view
    NOISE = "noise"  # a picture of nothing
    MISMATCHED = "mismatched"  # colour and depth of different times or cameras
    STALE = "stale"  # no new frame for too long


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """A sensor's report.

    Attributes:
        log_likelihood: (64, 3) log p(what is seen of the square | empty, white, black); squares in
            python-chess order. Only differences within a row mean anything.
        time: s, of the sensor's clock.
        sight: Anything but CLEAR: nothing else in here may be believed.
        message: One plain sentence for the operator when ``sight`` is not CLEAR, with what to do.
        heights: (64,) mm, of what stands on each square above the board; None when not measured.
        offsets: (64, 2) mm, board frame, of each piece's foot from the centre of its square, NaN where there
            is none or it cannot be told; None when not measured.
        kinds: (64, 13) log p(seen | empty, P N B R Q K, p n b r q k); None when not read.
    """

    log_likelihood: Array
    time: float
    sight: Sight = Sight.CLEAR
    message: str = ""
    heights: Array | None = None
    offsets: Array | None = None
    kinds: Array | None = None

    def __post_init__(self) -> None:
        wanted = {"log_likelihood": (64, 3), "heights": (64,), "offsets": (64, 2), "kinds": (64, 13)}
        for name, shape in wanted.items():
            value = getattr(self, name)
            if value is not None and np.shape(value) != shape:
                raise ValueError(f"{name} has shape {np.shape(value)}, wanted {shape}")

    @classmethod
    def blind(cls, time: float, sight: Sight, message: str) -> "Observation":
        """A report that nothing can be seen, and why."""
        return cls(np.zeros((64, 3)), time, sight, message)

    @property
    def valid(self) -> bool:
        """Whether it may be believed."""
        return self.sight is Sight.CLEAR

    @property
    def hand(self) -> bool:
        """Whether something is over the board: the signal for the robot's interlock."""
        return self.sight is Sight.HAND

    @property
    def occupancy(self) -> Array:
        """(64, 3) probabilities of {empty, white, black}, all three equally likely beforehand."""
        raised = np.exp(self.log_likelihood - self.log_likelihood.max(axis=1, keepdims=True))
        out: Array = raised / raised.sum(axis=1, keepdims=True)
        return out


class BoardSensor(Protocol):
    """Anything that reports what stands on the squares."""

    def observe(self) -> AsyncIterator[Observation]:
        """Observations as they come; a slow reader skips to the newest."""
        ...
