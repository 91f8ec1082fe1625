from dataclasses import replace
from typing import Any

import chess
import numpy as np
import pytest
from tests.unit.sensing.colour.scenery import OVER, seen, states

from kempelen.core.camera import Frame
from kempelen.core.errors import ConfigError, SensorError
from kempelen.core.geometry import Array
from kempelen.sensing.colour.parameters import ColourParameters
from kempelen.sensing.colour.reader import ColourReader
from kempelen.sensing.sighting import BoardSighting

START = chess.Board()


def taught(board: chess.Board = START) -> ColourReader:
    reader = ColourReader()
    reader.learn(*seen(board, grain=1), states(board))
    return reader


def after(*moves: str, board: chess.Board = START) -> chess.Board:
    out = board.copy()
    for move in moves:
        out.push_san(move)
    return out


def wrong(log_likelihood: Array, board: chess.Board) -> list[str]:
    return [chess.square_name(int(s)) for s in np.flatnonzero(log_likelihood.argmax(axis=1) != states(board))]


@pytest.mark.parametrize("move", ["e4", "d4", "Nf3", "Nc3", "a3", "h4"])
def test_a_move_is_seen_where_it_was_made_and_nowhere_else(move: str) -> None:
    board = after(move)

    said = taught().read(*seen(board, grain=2))

    assert wrong(said, board) == []
    changed = states(board) != states(START)
    certain = np.sort(said, axis=1)
    assert (certain[changed, 2] - certain[changed, 1]).min() > 3


def test_a_capture_changes_the_colour_of_the_square() -> None:
    board = after("e4", "d5")
    taken = after("exd5", board=board)

    assert wrong(taught(board).read(*seen(taken, grain=2)), taken) == []


@pytest.mark.parametrize("gains", [(0.5, 0.5, 0.5), (1.25, 1.25, 1.25), (0.75, 1.0, 1.2)])
def test_exposure_and_white_balance_are_no_moves(gains: tuple[float, float, float]) -> None:
    board = after("e4")

    assert wrong(taught().read(*seen(board, grain=2, gains=gains)), board) == []


def test_a_shadow_is_no_move() -> None:
    board = after("d4")

    said = taught().read(*seen(board, grain=2, shade=(3.5, -0.5, 6.3, 3.4)))

    assert wrong(said, board) == []


def test_a_camera_held_by_hand_may_move() -> None:
    board = after("Nf3")

    said = taught().read(*seen(board, over=OVER + np.array([0.6, -0.5, 0.7]), grain=2))

    assert wrong(said, board) == []


def test_an_error_of_the_corners_is_made_good() -> None:
    board = after("e4")
    frame, sighting = seen(board, grain=2)
    off = np.array([[1.0, 0.0, 0.06], [0.0, 1.0, -0.05], [0.0, 0.0, 1.0]])
    slipped = replace(sighting, image_from_board=sighting.image_from_board @ off)

    assert wrong(taught().read(frame, slipped), board) == []


def test_pieces_that_are_nudged_stand_where_they_stood() -> None:
    frame, sighting = seen(START, grain=2, aside={chess.D2: (0.1, -0.05), chess.G8: (-0.08, 0.1)})

    assert wrong(taught().read(frame, sighting), START) == []


def test_the_light_may_drift_a_long_way() -> None:
    reader = taught()
    for step in range(1, 13):
        gain = 0.93**step
        assert wrong(reader.read(*seen(START, grain=step, gains=(gain, gain, gain**0.8))), START) == []


def test_what_is_unchanged_speaks_for_itself_even_if_the_position_was_wrong() -> None:
    told = after("Nf3")  # but the knight still stands on g1
    reader = ColourReader()
    reader.learn(*seen(START, grain=1), states(told))

    reading = reader.examine(*seen(after("e4"), grain=2))

    assert reading.unchanged[[chess.G1, chess.F3]].min() > 0
    assert max(reading.unchanged[[chess.E2, chess.E4]]) < 0


def test_confirmed_moves_are_learned_and_the_same_pictures_read_the_same() -> None:
    one, two = taught(), taught()
    board = after("e4", "e5")
    later = after("Nf3", board=board)
    for reader in (one, two):
        reader.learn(*seen(board, grain=3), states(board))

    said = one.read(*seen(later, grain=4))

    assert wrong(said, later) == []
    assert np.array_equal(said, two.read(*seen(later, grain=4)))


def test_no_square_says_more_than_the_limit() -> None:
    reader = ColourReader(ColourParameters(limit=5.0))
    reader.learn(*seen(START, grain=1), states(START))

    said = reader.read(*seen(after("e4"), grain=2))

    assert said.max() == 0
    assert said.min() == -5


def test_a_covered_board_is_not_read_with_certainty() -> None:
    _, sighting = seen(START)
    grey = Frame(0, 0.0, np.full((480, 640, 3), 90, dtype=np.uint8))

    said = taught().read(grey, sighting)

    assert np.median(said[:, 0] - np.sort(said[:, 1:], axis=1)[:, 1]) < 12


def test_forgetting_starts_from_nothing() -> None:
    reader = taught()
    reader.forget()

    assert not reader.ready
    with pytest.raises(SensorError, match="has not seen a known position"):
        reader.read(*seen(START))


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (None, "no colour picture"),
        (np.zeros((480, 640), dtype=np.uint8), "wanted bytes"),
        (np.zeros((480, 640, 3), dtype=np.uint16), "wanted bytes"),
    ],
)
def test_frames_that_hold_no_picture_are_refused(picture: Any, message: str) -> None:
    _, sighting = seen(START)

    with pytest.raises(SensorError, match=message):
        ColourReader().learn(Frame(7, 0.0, picture), sighting, states(START))


def test_a_board_that_is_too_small_is_refused() -> None:
    frame, sighting = seen(START)
    small = BoardSighting(np.diag([0.1, 0.1, 1.0]) @ sighting.image_from_board, 0.0, 1.0, "far away")

    with pytest.raises(SensorError, match=r"pixels wide in the picture, at least 6 are needed"):
        ColourReader().learn(frame, small, states(START))


@pytest.mark.parametrize("position", [np.zeros(64), np.ones(64), np.zeros(63), np.full(64, 3)])
def test_positions_that_teach_nothing_are_refused(position: Array) -> None:
    with pytest.raises(SensorError, match="position"):
        ColourReader().learn(*seen(START), position)


def test_slices_need_radii() -> None:
    with pytest.raises(ConfigError, match="1 heights and 2 radii"):
        ColourParameters(heights=(0.1,), radii=(0.3, 0.2))
