"""Which way round a known position stands, told by the brightness of its men, or by where they stand."""

import chess
import cv2
import numpy as np
import pytest

from kempelen.core.camera import Picture
from kempelen.core.geometry import Array
from kempelen.core.senses import BLACK, EMPTY, WHITE, states_of
from kempelen.sensing.board.orientation import half_turned, turned_by_position
from kempelen.sensing.sighting import DARK, BoardSighting

SIDE = 24  # pixels of a square
FROM_ABOVE = np.array([[SIDE, 0.0, -0.5], [0.0, -SIDE, 8 * SIDE - 0.5], [0.0, 0.0, 1.0]])
GREYS = {EMPTY: (100, 230), WHITE: (125, 125), BLACK: (25, 25)}
"""On dark squares and on light ones: white men are of dull wood."""

CLOSED = "kn6/2Rp4/3P1p1p/2p2P1P/2P1p3/1Q2P3/1P2BPP1/4K2R w K - 0 1"
"""White's men stand on light squares more often than not, Black's on dark ones."""


def picture_of(board: chess.BaseBoard, seed: int = 0) -> Picture:
    """Seen from straight above, a8 at the top left; no man is quite as bright as another."""
    random = np.random.default_rng(seed)
    states = states_of(board)
    greys = [GREYS[int(state)][0 if dark else 1] for state, dark in zip(states, DARK, strict=True)]
    shades = greys + random.normal(0, 15, 64) * (states != EMPTY)
    cells = np.kron(shades.reshape(8, 8)[::-1], np.ones((SIDE, SIDE)))
    grain = random.normal(0, 2, cells.shape)
    return np.repeat(np.clip(cells + grain, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


@pytest.mark.parametrize("image_from_board", [FROM_ABOVE, half_turned(FROM_ABOVE)])
@pytest.mark.parametrize("fen", [chess.STARTING_FEN, CLOSED])
def test_white_is_where_the_brighter_men_stand(fen: str, image_from_board: Array) -> None:
    board = chess.Board(fen)
    found = turned_by_position(BoardSighting(image_from_board, 0.0, 1.0, "test"), picture_of(board), board)
    assert found.oriented
    assert np.allclose(found.image_from_board, FROM_ABOVE)


@pytest.mark.parametrize("fen", ["8/8/3k4/8/8/4K3/8/8 w - - 0 1", "8/8/2bk4/8/8/4KB2/8/8 w - - 0 1"])
def test_a_handful_of_men_does_not_tell(fen: str) -> None:
    """How much men of one kind differ is not known from one of them."""
    board = chess.Board(fen)
    found = turned_by_position(BoardSighting(FROM_ABOVE, 0.0, 1.0, "test"), picture_of(board), board)
    assert not found.oriented


def test_another_position_than_the_one_that_stands_tells_nothing() -> None:
    """Men of the right number on the right squares, of colours drawn at random."""
    board, random = chess.Board(CLOSED), np.random.default_rng(1)
    shown = picture_of(board)
    squares = list(board.piece_map())
    sure = 0
    for _ in range(100):
        colours = random.permutation([bool(board.color_at(square)) for square in squares])
        other = chess.BaseBoard(None)
        other.set_piece_map(
            {s: chess.Piece(chess.PAWN, bool(c)) for s, c in zip(squares, colours, strict=True)}
        )
        sure += turned_by_position(BoardSighting(FROM_ABOVE, 0.0, 1.0, "test"), shown, other).oriented
    assert sure <= 1


def discs_of(board: chess.BaseBoard, grey: int, seed: int = 0) -> Picture:
    """Men as discs of one colour on the squares of an empty board: colours tell nothing."""
    picture = picture_of(chess.BaseBoard(None), seed)
    for square in board.piece_map():
        x, y = (
            chess.square_file(square) * SIDE + SIDE // 2,
            (7 - chess.square_rank(square)) * SIDE + SIDE // 2,
        )
        cv2.circle(picture, (x, y), SIDE // 4, (grey, grey, grey), -1)
    return picture


@pytest.mark.parametrize("image_from_board", [FROM_ABOVE, half_turned(FROM_ABOVE)])
@pytest.mark.parametrize("fen", ["6k1/8/8/8/8/8/R7/1R4K1 w - - 0 1", "8/8/8/4k3/8/8/4P3/4K3 w - - 0 1"])
def test_few_men_are_told_by_where_they_stand(fen: str, image_from_board: Array) -> None:
    board = chess.Board(fen)
    found = turned_by_position(BoardSighting(image_from_board, 0.0, 1.0, "test"), discs_of(board, 60), board)
    assert found.oriented
    assert np.allclose(found.image_from_board, FROM_ABOVE)


@pytest.mark.parametrize(
    "fen",
    [
        "8/8/3k4/8/8/4K3/8/8 w - - 0 1",  # filled alike from both sides
        "8/8/3k4/8/8/4K3/P7/8 w - - 0 1",  # one man would have to tell, who may be a shadow
    ],
)
def test_men_that_nearly_stand_alike_from_both_sides_do_not_tell(fen: str) -> None:
    board = chess.Board(fen)
    found = turned_by_position(BoardSighting(FROM_ABOVE, 0.0, 1.0, "test"), discs_of(board, 60), board)
    assert not found.oriented
