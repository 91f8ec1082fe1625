"""The script of the games that the eyes are measured with."""

import random

import chess
import pytest

from kempelen.bench.eyes_games import Tally, chosen, of_one_promotion, rare_position


@pytest.mark.parametrize("colour", chess.COLORS)
def test_a_rare_position_has_something_rare_to_offer(colour: chess.Color) -> None:
    board = chess.Board(rare_position(7, colour))
    assert board.turn == colour
    assert any(
        board.is_castling(move) or board.is_en_passant(move) or move.promotion for move in board.legal_moves
    )


def test_the_same_seed_makes_the_same_moves() -> None:
    board = chess.Board()
    first, second = (random.Random(3) for _ in range(2))
    moves = [chosen(board, first) for _ in range(20)]
    assert moves == [chosen(board, second) for _ in range(20)]
    assert all(move in board.legal_moves for move in moves)
    assert len(set(moves)) > 5


@pytest.mark.parametrize(
    ("candidates", "one"),
    [
        (("a7a8q", "a7a8r", "a7a8b", "a7a8n"), True),
        (("a7a8q", "a7b8q"), False),
        (("e2e3", "e2e4"), False),
        (("a7a8q", "h2h3"), False),
    ],
)
def test_only_the_kind_is_asked(candidates: tuple[str, ...], one: bool) -> None:
    assert of_one_promotion(candidates) == one


def test_games_add_up() -> None:
    total = Tally(made=3, named=2, told=1, special={"captures": 1})
    total.add(Tally(made=5, named=4, kinds=1, wrong=1, special={"captures": 2, "promotions": 1}))
    assert (total.made, total.named, total.told, total.kinds, total.wrong) == (8, 6, 1, 1, 1)
    assert total.special == {"captures": 3, "promotions": 1}
