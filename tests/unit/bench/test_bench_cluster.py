import chess
import pytest

from kempelen.bench.cluster import _beginnings, _game
from kempelen.bench.elo import elo_interval, elo_of


def test_shares_and_elo() -> None:
    assert elo_of(0.5) == 0.0
    assert elo_of(10 / 11) == pytest.approx(400.0)
    assert elo_of(1.0) == pytest.approx(1200.0, abs=1.0)


def test_the_interval_is_of_the_pairs() -> None:
    elo, low, high = elo_interval([2.0, 1.0, 1.0, 1.5] * 20)
    assert low < elo < high
    assert elo == pytest.approx(elo_of(5.5 / 8))
    # Every pair the same: the two games of each cancel out, and nothing is uncertain.
    assert elo_interval([1.0] * 10) == (0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="two pairs"):
        elo_interval([1.0])


def test_the_same_seed_gives_the_same_openings() -> None:
    first, again, other = (next(_beginnings(seed)).fen() for seed in (1, 1, 2))
    assert first == again != other


async def test_a_game_ends_when_both_agree() -> None:
    async def sure(board: chess.Board, _: str) -> tuple[str, float]:
        return next(iter(board.legal_moves)).uci(), 900.0 if board.turn is chess.WHITE else -900.0

    assert await _game(chess.Board(), {chess.WHITE: sure, chess.BLACK: sure}, "x") == 1.0


async def test_one_side_alone_decides_nothing() -> None:
    async def sure(board: chess.Board, _: str) -> tuple[str, float]:
        return min(move.uci() for move in board.legal_moves), 900.0

    board = chess.Board()
    points = await _game(board, {chess.WHITE: sure, chess.BLACK: sure}, "x")
    assert points in {0.0, 0.5, 1.0}
    assert board.ply() > 10


async def test_a_mate_is_counted() -> None:
    moves = iter(["f2f3", "e7e5", "g2g4", "d8h4"])

    async def book(_: chess.Board, __: str) -> tuple[str, float]:
        return next(moves), 0.0

    assert await _game(chess.Board(), {chess.WHITE: book, chess.BLACK: book}, "x") == 0.0
