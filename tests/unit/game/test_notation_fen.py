import chess
import pytest

from kempelen.core.errors import NotationError
from kempelen.game.fen import parse_fen


@pytest.mark.parametrize(
    "fen", [chess.STARTING_FEN, "4k3/8/8/3pP3/8/8/8/4K3 w - d6 0 2", " 4k3/8/8/8/8/8/8/4K3 b - - 3 40\n"]
)
def test_a_position_is_read(fen: str) -> None:
    assert parse_fen(fen).fen() == fen.strip()


@pytest.mark.parametrize(
    ("fen", "fault"),
    [
        ("", "cannot be read as FEN"),
        ("hello", "cannot be read as FEN"),
        ("8/8/8/8 w - - 0 1", "cannot be read as FEN"),
        ("4k3/8/8/8/8/8/8/4K3 x - - 0 1", "cannot be read as FEN"),
        ("9" * 100_000, "cannot be read as FEN"),
        ("8/8/8/8/8/8/8/8 w - - 0 1", "the board is empty"),
        ("4k3/8/8/8/8/8/8/8 w - - 0 1", "the white king is missing"),
        ("8/8/8/8/8/8/8/4K3 w - - 0 1", "the black king is missing"),
        ("4k3/8/8/8/8/8/8/P3K3 w - - 0 1", "a pawn stands on the first or last rank"),
        ("4k3/8/8/8/8/8/8/4K3 w KQ - 0 1", "the castling rights do not fit"),
        ("4k3/8/8/8/8/8/8/4K3 w - e6 0 1", "the en passant square does not fit"),
        ("4k3/8/8/8/8/8/4R3/4K3 w - - 0 1", "the side that is not to move stands in check"),
        ("4k3/8/8/8/8/PPPPPPPP/P7/4K3 w - - 0 1", "White has more than 8 pawns"),
        ("4k3/8/8/8/8/8/8/R2K3R w HA - 0 1", "one of Chess960"),
    ],
)
def test_a_position_that_cannot_be_played_is_refused_with_its_fault(fen: str, fault: str) -> None:
    with pytest.raises(NotationError, match=fault) as caught:
        parse_fen(fen)
    assert caught.value.hint
    assert len(caught.value.message) < 400
