import chess
import pytest
from pydantic import ValidationError

from kempelen.core.pieces import KINDS, PRESETS, PieceShape, kind_name, piece_name

SIZES = {
    "height": 60.0,
    "base_diameter": 30.0,
    "head_diameter": 24.0,
    "grip_height": 30.0,
    "grip_diameter": 18.0,
}


def test_every_preset_has_six_kinds_under_their_names() -> None:
    for name, pieces in PRESETS.items():
        assert pieces.name == name
        assert [pieces[kind] for kind in KINDS] == [getattr(pieces, kind_name(kind)) for kind in KINDS]
        assert pieces.tallest == pieces[chess.KING].height
        assert pieces.widest_base == pieces[chess.KING].base_diameter


def test_the_thesis_heights_are_the_thesis_own() -> None:
    assert [PRESETS["thesis"][kind].height for kind in KINDS] == [100, 50, 50, 44, 60, 36]


def test_pieces_are_gripped_each_at_its_own_height() -> None:
    """Regression: the original gripped every piece at one height."""
    assert len({PRESETS["club"][kind].grip_height for kind in KINDS}) == len(KINDS)


def test_names() -> None:
    assert piece_name(chess.Piece.from_symbol("N")) == "white knight"
    assert piece_name(chess.Piece.from_symbol("q")) == "black queen"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"grip_height": 60.0}, "grip_height 60.0 mm must be below the height 60.0 mm"),
        ({"grip_diameter": 31.0}, "grip_diameter 31.0 mm is wider than the piece .30.0 mm"),
        ({"height": 0.0}, "greater than 0"),
        ({"mass": 900.0}, "less than or equal to 500"),
        ({"colour": "red"}, "Extra inputs"),
    ],
)
def test_impossible_shapes_are_refused(change: dict[str, object], said: str) -> None:
    assert PieceShape.model_validate(SIZES).mass == 40.0
    with pytest.raises(ValidationError, match=said):
        PieceShape.model_validate(SIZES | change)
