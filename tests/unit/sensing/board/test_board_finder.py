from dataclasses import replace

import chess
import numpy as np
import pytest
from tests.unit.sensing.board.chequer import (
    CAMERA,
    corner_error,
    depth_of,
    drawn,
    frame,
    projected,
    view,
)

from kempelen.core.camera import Frame
from kempelen.core.errors import BoardNotFoundError
from kempelen.core.geometry import Transform
from kempelen.sensing.board.finder import METHODS, BoardFinder
from kempelen.sensing.board.orientation import Side

START = {square: bool(piece.color) for square, piece in chess.Board().piece_map().items()}


@pytest.mark.parametrize("turn", [0.0, 0.4, 0.79, 1.6, 2.5, 3.1, 4.4])
def test_a_board_is_found_at_any_angle(turn: float) -> None:
    truth, _ = view(turn=turn, tilt=0.6)

    sighting = BoardFinder().find_in_picture(drawn(truth, men=START))

    assert corner_error(sighting, truth) < 0.06
    assert sighting.residual < 0.03
    assert sighting.confidence > 0.99


@pytest.mark.parametrize("rim", [0.0, 0.3, 1.0])
def test_rims_of_any_width_are_no_row(rim: float) -> None:
    truth, _ = view()

    assert corner_error(BoardFinder().find_in_picture(drawn(truth, rim=rim, men=START)), truth) < 0.06


def test_a1_is_dark_also_where_the_orientation_is_unknown() -> None:
    truth, _ = view(turn=2.0)

    sighting = BoardFinder().find_in_picture(drawn(truth))

    assert not sighting.oriented
    turned = [corner_error(sighting, truth @ half, oriented=True) for half in (np.eye(3), HALF_TURN)]
    assert min(turned) < 0.06


HALF_TURN = np.array([[-1.0, 0.0, 8.0], [0.0, -1.0, 8.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("turn", [0.0, 1.5, 3.14, 4.6])
def test_a_known_position_tells_a1_from_h8(turn: float) -> None:
    truth, _ = view(turn=turn)

    sighting = BoardFinder().find_in_picture(drawn(truth, men=START), chess.Board())

    assert sighting.oriented
    assert corner_error(sighting, truth, oriented=True) < 0.06


def test_men_of_one_colour_leave_the_orientation_open() -> None:
    truth, _ = view()
    dark_men = dict.fromkeys(START, False)

    sighting = BoardFinder().find_in_picture(drawn(truth, men=dark_men), chess.Board())

    assert not sighting.oriented


@pytest.mark.parametrize(
    ("side", "turn"), [(Side.BOTTOM, 0.1), (Side.TOP, 3.2), (Side.LEFT, 4.6), (Side.RIGHT, 1.6)]
)
def test_the_operators_word_orients_an_empty_board(side: Side, turn: float) -> None:
    truth, _ = view(turn=turn)

    sighting = BoardFinder(side=side).find_in_picture(drawn(truth))

    assert sighting.oriented
    assert corner_error(sighting, truth, oriented=True) < 0.06


def test_the_pose_comes_from_intrinsics_and_the_side_of_a_square() -> None:
    truth, pose = view()

    sighting = BoardFinder(square=40.0, side=Side.BOTTOM).find(frame(drawn(truth)))

    assert sighting.camera_from_board is not None
    off = pose.inverse() @ sighting.camera_from_board
    assert np.linalg.norm(off.translation) < 4.0
    assert off.tilt < 0.02
    assert abs(off.yaw) < 0.005


def test_depth_measures_the_squares() -> None:
    truth, pose = view(square=44.0)

    sighting = BoardFinder().find(frame(drawn(truth), depth_of(pose)))

    assert sighting.square == pytest.approx(44.0, abs=0.3)
    assert sighting.camera_from_board is not None


def test_the_pose_turns_with_the_board() -> None:
    truth, pose = view(turn=3.0)

    sighting = BoardFinder(square=40.0).find(frame(drawn(truth, men=START)), chess.Board())

    assert sighting.camera_from_board is not None
    assert np.linalg.norm((pose.inverse() @ sighting.camera_from_board).translation) < 4.0


def test_squares_of_another_size_than_was_said_are_refused() -> None:
    truth, pose = view(square=40.0)

    with pytest.raises(BoardNotFoundError, match="measure 40.* mm, but 55 mm was said"):
        BoardFinder(square=55.0).find(frame(drawn(truth), depth_of(pose)))


def test_depth_of_another_scene_is_refused() -> None:
    truth, _ = view(tilt=0.5)
    _, other = view(tilt=-0.5)

    with pytest.raises(BoardNotFoundError, match="no square in space"):
        BoardFinder().find(frame(drawn(truth), depth_of(other)))


def test_intrinsics_of_another_camera_are_refused() -> None:
    truth, _ = view(tilt=0.8, distance=520)
    longer = replace(CAMERA, fx=4 * CAMERA.fx, fy=4 * CAMERA.fy)

    with pytest.raises(BoardNotFoundError, match="does not fit the intrinsics"):
        BoardFinder(square=40.0).find(Frame(0, 0.0, drawn(truth), None, longer))


def test_the_thesis_way_finds_an_empty_board_by_depth() -> None:
    truth, pose = view(turn=0.1, tilt=0.3)

    sighting = BoardFinder("thesis").find(frame(drawn(truth), depth_of(pose)))

    assert sighting.method == "thesis"
    assert corner_error(sighting, truth) < 0.25


def test_opencv_finds_an_empty_board() -> None:
    truth, _ = view(turn=0.2, tilt=0.2)

    sighting = BoardFinder("opencv").find_in_picture(drawn(truth))

    assert corner_error(sighting, truth) < 0.1


@pytest.mark.parametrize("method", METHODS)
def test_every_method_says_when_there_is_no_board(method: str) -> None:
    noise = np.random.default_rng(3).normal(120, 6, (240, 320, 3))

    with pytest.raises(BoardNotFoundError):
        BoardFinder(method).find_in_picture(np.clip(noise, 0, 255).astype(np.uint8))


def test_a_very_oblique_board_is_found_on_the_plane_of_the_table() -> None:
    pose = view(tilt=1.22, distance=700.0)[1]
    truth = projected(pose, 40.0)

    sighting = BoardFinder(square=40.0).find(frame(drawn(truth, noise=2.0), depth_of(pose)))

    assert corner_error(sighting, truth) < 0.15


def test_unknown_methods_and_squares_without_size_are_refused() -> None:
    with pytest.raises(ValueError, match="no method 'guess'"):
        BoardFinder("guess")
    with pytest.raises(ValueError, match="a square of 0"):
        BoardFinder(square=0.0)


def test_a_pose_can_be_compared_across_the_room() -> None:
    """The board frame is right-handed, z up, a1 at its origin: the camera is above the board."""
    truth, _ = view(turn=1.0)

    sighting = BoardFinder(square=40.0).find(frame(drawn(truth)))

    assert sighting.camera_from_board is not None
    camera_in_board = sighting.camera_from_board.inverse() @ np.zeros(3)
    assert camera_in_board[2] > 500
    assert isinstance(sighting.camera_from_board, Transform)
    assert CAMERA.project(sighting.camera_from_board @ np.zeros((1, 3)))[0] == pytest.approx(
        sighting.corners[0], abs=1.0
    )
