from dataclasses import replace

import chess
import numpy as np
import pytest

from kempelen.core.camera import Frame
from kempelen.core.errors import BoardNotFoundError
from kempelen.core.senses import Sight
from kempelen.sensing.board.orientation import half_turned
from kempelen.sensing.locator import Located, Locator
from kempelen.sensing.sighting import BoardSighting

HERE = BoardSighting(np.array([[50.0, 3, 100], [2, -50, 500], [0, 0, 1]]), 0.01, 1.0, "told", oriented=True)
NEARBY = replace(HERE, image_from_board=np.array([[50.0, 3, 102], [2, -50, 501], [0, 0, 1]]))
AWAY = replace(HERE, image_from_board=np.array([[50.0, 3, 190], [2, -50, 460], [0, 0, 1]]))
OTHER_WAY = replace(AWAY, image_from_board=half_turned(AWAY.image_from_board), oriented=False)


class Told:
    """A finder that answers what it is told to."""

    def __init__(self, found: BoardSighting | None, followed: BoardSighting | None = None) -> None:
        self.found, self.followed = found, followed
        self.finds = self.follows = 0

    def find(self, frame: Frame, position: chess.BaseBoard | None = None) -> BoardSighting:
        del frame, position
        self.finds += 1
        if self.found is None:
            raise BoardNotFoundError("only 5 rows are visible", hint="Move the camera back.")
        return self.found

    def follow(self, frame: Frame, last: BoardSighting) -> BoardSighting | None:
        del frame
        self.follows += 1
        return last if self.followed is HERE else self.followed


def at(locator: Locator, time: float, *, blocked: bool = False, board: chess.Board | None = None) -> Located:
    return locator.locate(Frame(0, time), board, blocked=blocked)


def test_a_board_is_found_once_and_then_followed_now_and_then() -> None:
    finder = Told(HERE, HERE)
    locator = Locator(finder)
    assert at(locator, 0.0).new
    seen = [at(locator, 0.05 * k) for k in range(1, 21)]
    assert all(located.sighting is HERE and not located.new for located in seen)
    assert finder.finds == 1
    assert 3 <= finder.follows <= 5
    assert sum(located.looked for located in seen) == finder.follows


def test_a_small_shift_is_followed() -> None:
    finder = Told(HERE, NEARBY)
    locator = Locator(finder)
    at(locator, 0.0)
    located = at(locator, 1.0)
    assert located.new
    assert located.sighting is NEARBY


def test_no_board_is_told_and_looked_for_again_not_too_often() -> None:
    finder = Told(None)
    locator = Locator(finder)
    located = [at(locator, 0.1 * k) for k in range(10)]
    assert {each.sight for each in located} == {Sight.NO_BOARD}
    assert located[0].message == "only 5 rows are visible Move the camera back."
    assert finder.finds <= 5
    finder.found = HERE
    assert at(locator, 2.0).sighting is HERE


def test_a_bumped_board_is_found_again_the_same_way_round() -> None:
    finder = Told(HERE)
    locator = Locator(finder)
    at(locator, 0.0, board=chess.Board())
    finder.found = OTHER_WAY
    located = at(locator, 1.0, board=chess.Board())
    assert located.new
    assert located.sighting is not None
    assert located.sighting.oriented
    assert located.sighting.corners == pytest.approx(AWAY.corners)


def test_a_board_that_went_is_told_as_moved_until_it_is_back() -> None:
    finder = Told(HERE)
    locator = Locator(finder)
    at(locator, 0.0)
    finder.found = None
    assert at(locator, 1.0).sight is Sight.MOVED
    finder.followed = HERE
    back = at(locator, 2.0)
    assert back.sighting is HERE
    assert back.sight is Sight.CLEAR


def test_behind_a_hand_nothing_is_looked_for() -> None:
    finder = Told(HERE)
    locator = Locator(finder)
    at(locator, 0.0)
    assert at(locator, 5.0, blocked=True).sighting is HERE
    assert finder.follows == 0


def test_a_board_without_a_side_is_not_read() -> None:
    locator = Locator(Told(OTHER_WAY))
    located = at(locator, 0.0, board=chess.Board())
    assert located.sighting is None
    assert located.sight is Sight.STARTING
    assert "which side White sits" in located.message
