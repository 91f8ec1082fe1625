"""Positions without a history."""

import chess
import numpy as np
import pytest

from kempelen.core.errors import SensorError
from kempelen.core.senses import Observation, Sight
from kempelen.sensing.moves.placement import piece_of, placement, read_position
from kempelen.sensing.moves.promotion import kind_column
from kempelen.testing.move_scenes import board_of
from kempelen.testing.observations import kinds_of

MIDDLE_GAME = "r1bqk2r/pp2bppp/2n1pn2/2pp4/3P1B2/2PBPN2/PP1N1PPP/R2QK2R w KQkq - 0 8"


def same(found: chess.BaseBoard, board: chess.Board) -> bool:
    return found.board_fen() == board.board_fen()


@pytest.mark.parametrize(
    "fen",
    [
        chess.STARTING_FEN,
        MIDDLE_GAME,
        "8/8/8/4k3/8/8/8/QQQ1K3 w - - 0 1",
        "NBR1k3/8/8/8/8/8/8/4K2q b - - 0 1",
        "2b1k3/8/b7/8/8/8/8/4K3 w - - 0 1",
    ],
    ids=["start", "middle game", "three queens", "promotions", "two bishops of one shade"],
)
def test_clear_pictures(fen: str) -> None:
    board = chess.Board(fen)
    found = placement(kinds_of(board, sure=12.0))
    assert same(found.board, board)
    assert found.whole > 0.95
    assert found.confidence.min() > 0.98


def test_one_king_each_whatever_it_looks_like() -> None:
    board = chess.Board(MIDDLE_GAME)
    kinds = kinds_of(board)
    kinds[chess.D1, kind_column(chess.Piece.from_symbol("K"))] += 10.0
    found = placement(kinds)
    assert same(found.board, board)
    assert "2 white kings seen; there must be one." in found.findings


def test_no_pawns_on_the_last_ranks() -> None:
    board = chess.Board(MIDDLE_GAME)
    kinds = kinds_of(board)
    kinds[chess.A8, kind_column(chess.Piece.from_symbol("p"))] += 10.0
    found = placement(kinds)
    assert same(found.board, board)
    assert "A black pawn seems to stand on a8, where no pawn can be." in found.findings


def test_the_counts_help() -> None:
    """The ninth pawn is the bishop that it might be."""
    board = chess.Board()
    kinds = kinds_of(board)
    for square in (chess.C3, chess.F3):
        kinds[square, 0] -= 8.0
        kinds[square, 1] = 2.0
    found = placement(kinds)
    assert sum(p.piece_type == chess.PAWN and p.color for p in found.board.piece_map().values()) == 8
    assert "10 white pawns seen; there are 8 at most." in found.findings


def test_a_full_set_leaves_nothing_for_a_vague_square() -> None:
    board = chess.Board(MIDDLE_GAME)
    kinds = kinds_of(board)
    kinds[chess.C4] = 0.0
    assert placement(kinds).confidence[chess.C4] > 0.99


def test_doubtful_squares_are_named() -> None:
    board = chess.Board("4k3/pp3ppp/8/8/8/8/PP3PPP/4K3 w - - 0 1")
    kinds = kinds_of(board)
    kinds[chess.C4] = 0.0
    found = placement(kinds)
    assert found.confidence[chess.C4] < 0.9
    assert found.whole < 0.9
    assert any(f.startswith("Doubtful: ") and "c4" in f for f in found.findings)


def test_confidence_means_something() -> None:
    """Over noisy readings, placements that claim to be right mostly are."""
    board, claimed, right = chess.Board(MIDDLE_GAME), [], []
    for seed in range(40):
        found = placement(kinds_of(board, sure=5.0, noise=1.0, seed=seed))
        claimed.append(found.whole)
        right.append(same(found.board, board))
    sure = [r for r, c in zip(right, claimed, strict=True) if c > 0.9]
    assert all(sure)
    assert np.mean(right) >= np.mean(claimed) - 0.15


def test_whose_turn_it_must_be() -> None:
    found = placement(kinds_of(chess.Board("4k3/8/8/8/8/8/8/K3R3 b - - 0 1")))
    assert found.findings == ("Black is in check, and so to move.",)


def test_positions_that_no_game_has() -> None:
    both = placement(kinds_of(chess.Board("4k3/8/8/8/8/4r3/8/K3R1q1 w - - 0 1")))
    assert "Both kings are in check." not in both.findings  # black's rook shields its king
    assert (
        "Both kings are in check."
        in placement(kinds_of(chess.Board("R3k3/8/8/8/8/8/8/K6r w - - 0 1"))).findings
    )
    close = placement(kinds_of(chess.Board("8/8/8/3kK3/8/8/8/8 w - - 0 1")))
    assert close.findings == ("The kings stand next to each other.",)


def test_columns_and_pieces_agree() -> None:
    pieces = [None, *(chess.Piece(k, c) for c in (True, False) for k in chess.PIECE_TYPES)]
    assert [kind_column(p) for p in pieces] == list(range(13))
    assert [piece_of(c) for c in range(13)] == pieces


def test_nothing_to_read() -> None:
    with pytest.raises(SensorError, match="No position can be read: The lamp is off"):
        read_position(Observation.blind(0.0, Sight.DARK, "The lamp is off."))
    with pytest.raises(SensorError, match="kinds of the pieces were not read"):
        read_position(Observation(np.zeros((64, 3)), 0.0))
    board = board_of("e4")
    assert same(read_position(Observation(np.zeros((64, 3)), 0.0, kinds=kinds_of(board))).board, board)
