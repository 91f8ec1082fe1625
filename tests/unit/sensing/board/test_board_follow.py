import cv2
import numpy as np
import pytest
from tests.unit.sensing.board.chequer import corner_error, drawn, frame, view

from kempelen.core.camera import Picture
from kempelen.sensing.board.finder import BoardFinder

TRUTH, _ = view(turn=0.3)
BOARD = drawn(TRUTH)
FINDER = BoardFinder(square=40.0)
FOUND = FINDER.find(frame(BOARD))


def moved_by(x: float, y: float) -> Picture:
    """The scene, moved by squares along the board's own axes."""
    return drawn(TRUTH @ np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]]))


def covered(share: float) -> Picture:
    picture = BOARD.copy()
    low, high = FOUND.corners.min(axis=0), FOUND.corners.max(axis=0)
    right = int(low[0] + share * (high[0] - low[0]))
    cv2.rectangle(picture, (int(low[0]) - 30, 0), (right, 479), (140, 160, 200), -1)
    return picture


def test_a_board_at_rest_keeps_its_very_pose() -> None:
    followed = FINDER.follow(frame(drawn(TRUTH, seed=9)), FOUND)

    assert followed is not None
    assert followed.image_from_board is FOUND.image_from_board
    assert followed.camera_from_board is FOUND.camera_from_board
    assert followed.confidence > 0.9


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_hand_lowers_the_confidence_and_nothing_else(share: float) -> None:
    followed = FINDER.follow(frame(covered(share)), FOUND)

    assert followed is not None
    assert followed.image_from_board is FOUND.image_from_board
    assert followed.confidence == pytest.approx(1 - share, abs=0.2)


def test_a_board_fully_covered_is_not_taken_for_moved() -> None:
    followed = FINDER.follow(frame(covered(1.3)), FOUND)

    assert followed is not None
    assert followed.confidence < 0.05


def test_a_drift_is_measured_anew() -> None:
    followed = FINDER.follow(frame(moved_by(0.08, -0.05)), FOUND)

    assert followed is not None
    truth = TRUTH @ np.array([[1.0, 0.0, 0.08], [0.0, 1.0, -0.05], [0.0, 0.0, 1.0]])
    assert corner_error(followed, truth) < 0.03
    assert followed.camera_from_board is not None


@pytest.mark.parametrize("shift", [(0.4, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 2.0), (2.0, 2.0), (-1.0, 1.0)])
def test_a_push_calls_for_a_new_search(shift: tuple[float, float]) -> None:
    assert FINDER.follow(frame(moved_by(*shift)), FOUND) is None
