import chess
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import KempelenError
from kempelen.core.places import Layout, Place, Transfer

KNIGHT = chess.Piece.from_symbol("N")
PAWN = chess.Piece.from_symbol("p")


@given(square=st.sampled_from(chess.SQUARES))
def test_squares_round_trip(square: chess.Square) -> None:
    place = Place.at(square)
    assert Place.parse(str(place)) == place
    assert place.square == square
    assert place.is_square
    assert (place.tray, place.number) == ("", 0)


@given(tray=st.from_regex(r"[a-z]{2,12}", fullmatch=True), number=st.integers(1, 160))
def test_slots_round_trip(tray: str, number: int) -> None:
    place = Place.slot(tray, number)
    assert Place.parse(f" {place.name.upper()} ") == place
    assert (place.tray, place.number) == (tray, number)
    assert place.square is None
    assert not place.is_square


@pytest.mark.parametrize("text", ["", "i9", "a0", "left", "left0", "7left", "e44", "le ft1", "left1000"])
def test_what_is_no_place_is_refused(text: str) -> None:
    with pytest.raises(KempelenError, match="is no place"):
        Place.parse(text)


def test_a_transfer_reads_like_a_move() -> None:
    assert str(Transfer(KNIGHT, Place("g1"), Place("f3"))) == "N g1-f3"


def test_a_layout_follows_transfers() -> None:
    start = Layout({Place("g1"): KNIGHT, Place("f3"): PAWN})
    taken = start.after(Transfer(PAWN, Place("f3"), Place("left1")))
    moved = taken.after(Transfer(KNIGHT, Place("g1"), Place("f3")))
    assert dict(moved) == {Place("left1"): PAWN, Place("f3"): KNIGHT}
    assert len(start) == 2
    assert start[Place("g1")] == KNIGHT
    assert moved.board_part() == {chess.F3: KNIGHT}
    assert repr(moved) == "Layout(Nf3, pleft1)"


def test_two_pieces_never_stand_on_one_place() -> None:
    layout = Layout({Place("g1"): KNIGHT, Place("f3"): PAWN})
    with pytest.raises(KempelenError, match=r"f3 is taken by p; N cannot stand there"):
        layout.after(Transfer(KNIGHT, Place("g1"), Place("f3")))


def test_only_what_stands_there_can_be_carried() -> None:
    layout = Layout({Place("g1"): KNIGHT})
    with pytest.raises(KempelenError, match="g1 holds N, not the p to carry"):
        layout.after(Transfer(PAWN, Place("g1"), Place("f3")))
    with pytest.raises(KempelenError, match="a8 holds nothing, not the N to carry"):
        layout.after(Transfer(KNIGHT, Place("a8"), Place("f3")))
