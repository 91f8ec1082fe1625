"""Random boards: what is said of a picture is true of it."""

import chess
import numpy as np
import pytest

from kempelen.twin.cameras import OFF
from kempelen.twin.cameras.studio import Shot, Studio
from kempelen.twin.cameras.variety import random_position, random_scene

pytestmark = pytest.mark.physics


@pytest.fixture(scope="module")
def shots() -> list[Shot]:
    rng = np.random.default_rng(8)
    with Studio(640, 480, noise=OFF) as studio:
        return [studio.render(rng, chess.Board(None)) for _ in range(3)]


def test_the_corners_and_the_pattern_are_where_the_truth_says(shots: list[Shot]) -> None:
    for shot in shots:
        assert (shot.corners > 0).all()
        assert (shot.corners < [640, 480]).all()
        centres = shot.square * np.array([[i % 8 + 0.5, i // 8 + 0.5, 0.0] for i in range(64)])
        column, row = np.rint(shot.pixels(centres)).astype(int).T
        assert shot.frame.colour is not None
        grey = shot.frame.colour[row, column].astype(float).mean(axis=1)
        dark = np.array([(i + i // 8) % 2 == 0 for i in range(64)])
        assert np.median(grey[dark]) < np.median(grey[~dark]) - 10


def test_the_same_choices_give_the_same_picture() -> None:
    pictures = []
    for _ in range(2):
        with Studio(320, 240) as studio:
            pictures.append(studio.render(np.random.default_rng(3)))
    one, other = pictures
    assert one.frame.colour is not None
    assert other.frame.colour is not None
    assert np.array_equal(one.frame.colour, other.frame.colour)
    assert one.board == other.board
    assert one.frame.depth is None


def test_sets_and_positions_differ() -> None:
    rng = np.random.default_rng(1)
    boards = [random_position(rng) for _ in range(6)]
    scenes = [random_scene(rng, board) for board in boards]
    assert len({board.board_fen() for board in boards}) > 3
    assert len({scene.look.dark for scene in scenes}) == 6
    assert all(scene.table.pieces.widest_base < scene.table.square for scene in scenes)
    assert all(board.is_valid() for board in boards)
