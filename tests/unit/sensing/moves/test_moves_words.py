"""What is wrong, in words: reasons, repairs, their order."""

import chess
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kempelen.core.senses import BLACK, EMPTY, WHITE, states_of
from kempelen.sensing.moves.differences import differences, repairs, sentence
from kempelen.sensing.moves.illegal import advise, why_illegal
from kempelen.testing.move_scenes import board_of
from kempelen.testing.observations import with_changes


@pytest.mark.parametrize(
    ("position", "way", "reason"),
    [
        ("", "c1h6", "the bishop cannot go from c1 to h6: the white pawn on d2 stands in the way"),
        ("", "b1d2", "the knight cannot go from b1 to d2: the white pawn on d2 stands there"),
        ("", "b1b3", "the knight cannot go from b1 to b3: a knight does not go that way"),
        ("", "e2e5", "the pawn cannot go from e2 to e5: a pawn does not go that far"),
        ("", "e2f3", "the pawn cannot go from e2 to f3: a pawn goes sideways only to take something"),
        ("", "e2h5", "the pawn cannot go from e2 to h5: a pawn does not go that way"),
        ("", "e7e5", "the black pawn went from e7 to e5, but it is White's turn"),
        ("e4", "g1f3", "the white knight went from g1 to f3, but it is Black's turn"),
        ("e4 e5", "e4e5", ("the pawn cannot go from e4 to e5: the black pawn on e5 stands there, and a pawn "
                           "takes sideways")),
        ("e4 e5", "e1g1", "the king cannot go from e1 to g1: the white knight on g1 stands there"),
        ("4k3/8/8/8/8/8/8/4K2R w - - 0 1", "e1g1",
         "the king cannot go from e1 to g1: castling is not possible now"),
        ("4k3/8/8/8/8/8/8/4K3 w - - 0 1", "e1e3",
         "the king cannot go from e1 to e3: a king goes one square at a time"),
        ("4r1k1/8/8/8/8/8/4B3/4K3 w - - 0 1", "e2d3",
         "the bishop cannot go from e2 to d3: White's king would be in check from the black rook on e8"),
        ("4r1k1/8/8/8/8/8/3B4/4K3 w - - 0 1", "d2c3",
         ("the bishop cannot go from d2 to c3: "
          "White's king would still be in check from the black rook on e8")),
    ],
)  # fmt: skip
def test_why_a_move_is_illegal(position: str, way: str, reason: str) -> None:
    move = chess.Move.from_uci(way)
    assert why_illegal(board_of(position), move.from_square, move.to_square) == reason


def test_advice_for_a_wrong_capture_brings_the_victim_back_last() -> None:
    board = board_of("")
    found = differences(board, with_changes(board, {"a1": "empty", "a7": "white"}))
    assert advise(board, found) == (
        "That is no legal move: the rook cannot go from a1 to a7: the white pawn on a2 stands in the way. "
        "Put the white rook from a7 back on a1; put the black pawn back on a7."
    )


def test_no_difference_no_words() -> None:
    board = board_of("e4")
    assert differences(board, states_of(board)) == ()
    assert advise(board, ()) == ""


def test_pieces_are_paired_by_the_ways_they_go() -> None:
    board = board_of("")
    changes = {"g1": "empty", "c1": "empty", "f3": "white", "g5": "white"}
    todo = {str(r) for r in repairs(differences(board, with_changes(board, changes)))}
    assert todo == {"put the white knight from f3 back on g1", "put the white bishop from g5 back on c1"}


def test_what_is_too_much_is_taken_away_first() -> None:
    board = board_of("")
    changes = {"e1": "black", "e4": "white"}
    text = sentence(repairs(differences(board, with_changes(board, changes))))
    assert text == "Take the black piece off e1; put the white king from e4 back on e1."


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(st.sampled_from(chess.SQUARES), st.sampled_from([EMPTY, WHITE, BLACK]), max_size=8))
def test_repairs_put_everything_right_with_the_fewest_movements(changed: dict[int, int]) -> None:
    board = board_of("e4 e5 Nf3 Nc6")
    seen = states_of(board)
    for square, look in changed.items():
        seen[square] = look
    found = differences(board, seen)
    todo = repairs(found)
    for repair in todo:
        if repair.source is not None:
            assert seen[repair.source] == repair.colour
            seen[repair.source] = EMPTY
    for repair in todo:
        if repair.target is not None:
            seen[repair.target] = repair.colour
    assert (seen == states_of(board)).all()
    extra = {c: sum(d.seen == c for d in found) for c in (WHITE, BLACK)}
    lack = {c: sum(d.expected is not None and d.expected.color == (c == WHITE) for d in found)
            for c in (WHITE, BLACK)}  # fmt: skip
    assert len(todo) == sum(max(extra[c], lack[c]) for c in (WHITE, BLACK))
