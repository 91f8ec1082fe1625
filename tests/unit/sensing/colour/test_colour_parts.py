import chess
import numpy as np
import pytest
from tests.unit.sensing.colour.scenery import LENS, OVER, seen

from kempelen.core.camera import Frame
from kempelen.sensing.colour.columns import board_of, camera_over_board, cut, plane, tiles, without_margin
from kempelen.sensing.colour.fields import BASIS, fit_smooth
from kempelen.sensing.colour.light import LightChange, encoded
from kempelen.sensing.colour.predictive import ClassModels, Student
from kempelen.sensing.colour.register import registered

LONE_KING = chess.BaseBoard.empty()
LONE_KING.set_piece_at(chess.C7, chess.Piece(chess.KING, chess.WHITE))


def test_the_camera_is_found_over_the_board() -> None:
    frame, sighting = seen(LONE_KING)

    assert camera_over_board(frame, sighting, 0.7) == pytest.approx(OVER, abs=1e-6)
    blind = Frame(0, 0.0, frame.colour)
    assert camera_over_board(blind, sighting, LENS.fx / LENS.width) == pytest.approx(OVER, abs=1e-6)


@pytest.mark.parametrize("height", [0.0, 0.4, 1.2])
def test_slices_follow_the_lean_of_a_piece(height: float) -> None:
    place = (np.arange(8 * 24 + 72) + 0.5) / 24 - 1.5
    ramps = np.stack(np.meshgrid(place, 8 - place), axis=-1).astype(
        np.float32
    )  # where on the board it is seen
    middles = cut(ramps, OVER, (height,))[:, 0, 11:13, 11:13].mean(axis=(1, 2))

    standing = np.column_stack([np.arange(64) % 8 + 0.5, np.arange(64) // 8 + 0.5, np.full(64, height)])
    share = OVER[2] / (OVER[2] - height)  # of the ray from the camera through it, down to the board
    met = OVER + (standing - OVER) * share
    assert middles == pytest.approx(met[:, :2], abs=0.01)


def test_squares_come_in_order_and_go_back() -> None:
    frame, sighting = seen(LONE_KING)
    board = without_margin(plane(frame, sighting, 8))
    squares = tiles(board)

    assert np.array_equal(board_of(squares), board)
    assert squares[chess.A1].mean() < squares[chess.B1].mean()
    assert squares[chess.C7, 2:6, 2:6].mean() > squares[chess.A7, 2:6, 2:6].mean() + 20


def test_light_only_adds() -> None:
    dim, bright = (
        encoded(np.full((1, 1, 3), 128.0, np.float32)),
        encoded(np.full((1, 1, 3), 188.0, np.float32)),
    )

    assert dim[0, 0, 1:] == pytest.approx((0, 0))
    assert bright[0, 0, 0] - dim[0, 0, 0] == pytest.approx(np.log(2.3), abs=0.05)


def test_a_smooth_field_is_fitted_through_outliers() -> None:
    truth = BASIS @ np.array([0.4, 0.2, -0.1, 0.0, 0.05, 0.0])
    values = truth.copy()
    values[[3, 17, 40, 41]] += 5

    assert np.abs(BASIS @ fit_smooth(values) - truth).max() < 0.05


def test_a_change_of_light_is_taken_back_but_no_piece() -> None:
    empty = chess.BaseBoard.empty()
    before = encoded(plane(*seen(empty), 24))
    after = encoded(plane(*seen(LONE_KING, gains=(0.5, 0.6, 0.7), shade=(2.0, 0.0, 6.0, 4.0)), 24))

    left = LightChange.between(before, after).removed(after) - before

    off = np.abs(np.median(tiles(without_margin(left)).reshape(64, -1, 3), axis=1))
    king = tiles(without_margin(left))[chess.C7, 8:16, 8:16, 0]
    assert np.quantile(off, 0.85) < 0.1  # the corners of the shadow come out rounded
    assert king.mean() > 0.5


def test_a_picture_is_laid_over_another() -> None:
    frame, sighting = seen(chess.Board(), grain=1)
    before = encoded(plane(frame, sighting, 24))
    slipped = np.roll(before, (2, -3), axis=(0, 1))

    left = without_margin(registered(before, slipped) - before)

    assert np.median(np.abs(left)) < 0.3 * np.median(np.abs(without_margin(slipped - before)) + 0.01)


def test_a_student_t_is_a_density() -> None:
    model = Student.of(np.array([1.0]), np.array([[2.0]]), 4.0)
    x = np.linspace(-400, 400, 400_001)

    assert np.trapezoid(np.exp(model.log_density(x[:, None])), x) == pytest.approx(1, abs=1e-4)


def test_few_examples_make_it_less_sure() -> None:
    examples = np.random.default_rng(1).normal(0, 1, (40, 3))
    few = Student.predicted(examples[:2], np.ones(2), np.zeros(3), np.eye(3))
    many = Student.predicted(examples, np.ones(40), np.zeros(3), np.eye(3))
    far = np.full((1, 3), 5.0)

    assert few.log_density(far)[0] > many.log_density(far)[0] + 1


def test_what_looks_like_nothing_learned_speaks_for_nothing() -> None:
    generator = np.random.default_rng(2)
    states = np.repeat([0, 1, 2], 20)
    looks = generator.normal(0, 0.2, (60, 4)) + states[:, None]
    model = ClassModels(looks, states, np.arange(60) % 2 == 0, np.ones(60))
    here, away = np.full((1, 4), 2.0), np.full((1, 4), 60.0)

    near, far = (model.log_density(x, np.array([True]))[0] for x in (here, away))

    assert near.argmax() == 2
    assert np.ptp(near) > 3
    assert np.ptp(far) < 1
