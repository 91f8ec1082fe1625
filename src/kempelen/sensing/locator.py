"""Keeps hold of the board: found once, followed cheaply, found again after a bump."""

from dataclasses import dataclass, replace
from typing import Protocol

import chess
import numpy as np

from kempelen.core.camera import Frame
from kempelen.core.errors import BoardNotFoundError
from kempelen.core.geometry import Array
from kempelen.core.senses import Sight
from kempelen.sensing.board.orientation import half_turned
from kempelen.sensing.parameters import Parameter, Parameters
from kempelen.sensing.sighting import BoardSighting

_STILL_IN_TURN = 0.5  # of the way between the two turns: nearer to the other one than this, and nobody knows


class Finder(Protocol):
    """Finds boards in frames; see `kempelen.sensing.board.finder.BoardFinder`."""

    def find(self, frame: Frame, position: chess.BaseBoard | None = None) -> BoardSighting:
        """Where the board is; raises BoardNotFoundError."""
        ...

    def follow(self, frame: Frame, last: BoardSighting) -> BoardSighting | None:
        """Where it is now, when it is still about there."""
        ...


def locator_parameters() -> Parameters:
    """How often to look."""
    return Parameters(
        Parameter("board.follow", 0.2, "s", 0, 10, "the board's place is verified this often"),
        Parameter("board.retry", 0.3, "s", 0, 30, "a lost board is searched for this often"),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """What is known of the board in one frame.

    Attributes:
        sighting: Where it is; None while nobody knows.
        new: Whether it is elsewhere than in the frame before.
        looked: Whether it was looked for in this frame, not only remembered.
        sight: CLEAR, NO_BOARD, MOVED or STARTING.
        message: For the operator when it is not CLEAR.
    """

    sighting: BoardSighting | None
    new: bool = False
    looked: bool = False
    sight: Sight = Sight.CLEAR
    message: str = ""


class Locator:
    """Where the board is, from frame to frame.

    Args:
        finder: That looks for it.
        parameters: To be shown and overridden; its own ones without.
    """

    def __init__(self, finder: Finder, parameters: Parameters | None = None) -> None:
        self.parameters = locator_parameters() if parameters is None else parameters
        self._finder = finder
        self._last: BoardSighting | None = None
        self._lost: Located | None = Located(None, sight=Sight.STARTING, message="Looking for the board.")
        self._looked = -np.inf

    def forget(self) -> None:
        """Start from nothing."""
        self._last, self._looked = None, -np.inf
        self._lost = Located(None, sight=Sight.STARTING, message="Looking for the board.")

    def check_soon(self) -> None:
        """Somebody was at the board: it is verified in the next frame, whenever that was done last."""
        self._looked = -np.inf

    def locate(self, frame: Frame, position: chess.BaseBoard | None, *, blocked: bool) -> Located:
        """Where the board is in this frame.

        Args:
            frame: In good health.
            position: What stands there, if known: it tells a1 from h8.
            blocked: Whether a hand was over the board in the frame before: the board is not looked for, then.
        """
        since = frame.time - self._looked
        if self._lost is not None:
            if 0 <= since < self.parameters["board.retry"]:
                return self._lost
            return self._recover(frame, position)
        if self._last is None or blocked or 0 <= since < self.parameters["board.follow"]:
            return Located(self._last)
        self._looked = frame.time
        followed = self._finder.follow(frame, self._last)
        if followed is None:
            return self._recover(frame, position)
        moved = followed.image_from_board is not self._last.image_from_board
        self._last = followed
        return Located(followed, new=moved, looked=True)

    def _recover(self, frame: Frame, position: chess.BaseBoard | None) -> Located:
        """Where it was, as a hand may have hidden it; else anywhere."""
        self._looked = frame.time
        before = self._last
        if before is not None and self._lost is not None:
            followed = self._finder.follow(frame, before)
            if followed is not None:
                self._last, self._lost = followed, None
                moved = followed.image_from_board is not before.image_from_board
                return Located(followed, new=moved, looked=True)
        try:
            found = self._finder.find(frame, position)
        except BoardNotFoundError as error:
            sight = Sight.NO_BOARD if before is None else Sight.MOVED
            self._lost = Located(None, sight=sight, message=str(error))
            return self._lost
        if not found.oriented and before is not None:
            found = _as_before(found, before)
        if not found.oriented and position is not None:
            self._lost = Located(
                None,
                sight=Sight.STARTING,
                message="The board is found, but not on which side White sits: the pieces' colours do not "
                "tell. Say it, or set up the position of the game.",
            )
            return self._lost
        self._last, self._lost = found, None
        return Located(found, new=True, looked=True)


def _as_before(found: BoardSighting, before: BoardSighting) -> BoardSighting:
    """The turn that lies nearer to the one before: a bump turns a board by less than a right angle."""
    turned_image = half_turned(found.image_from_board)
    way, other = (_distance(image, before) for image in (found.image_from_board, turned_image))
    if min(way, other) > _STILL_IN_TURN * max(way, other):
        return found
    if way < other:
        return replace(found, oriented=before.oriented)
    turned = replace(found, image_from_board=turned_image, oriented=before.oriented)
    return replace(turned, camera_from_board=None)


def _distance(image_from_board: Array, before: BoardSighting) -> float:
    """Between a1's and h8's corners now and before, their common shift left out, pixels."""
    now = replace(before, image_from_board=image_from_board).corners
    moved = now - before.corners
    return float(np.linalg.norm(moved - moved.mean(axis=0)))
