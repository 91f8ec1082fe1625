"""Piece sets: how tall, how wide and where to grip each kind.

Kinds and colours are python-chess's (`chess.PieceType`, `chess.Piece`), so that rules and robot speak of the
same things.
"""

from collections.abc import Mapping
from typing import Annotated, Self

import chess
from pydantic import BaseModel, ConfigDict, Field, model_validator

KINDS: tuple[chess.PieceType, ...] = (
    chess.KING, chess.QUEEN, chess.ROOK, chess.BISHOP, chess.KNIGHT, chess.PAWN,
)  # fmt: skip

Millimetres = Annotated[float, Field(gt=0, le=300)]


def kind_name(kind: chess.PieceType) -> str:
    """English name of a kind: ``"knight"``."""
    return chess.piece_name(kind)


def piece_name(piece: chess.Piece) -> str:
    """Colour and kind: ``"white knight"``."""
    return f"{'white' if piece.color else 'black'} {chess.piece_name(piece.piece_type)}"


class PieceShape(BaseModel):
    """One kind of piece as the robot needs to know it.

    Attributes:
        height: Base to top, mm.
        base_diameter: Widest part, at the bottom, mm.
        head_diameter: Widest part above the grip, which must pass between the open fingers, mm.
        grip_height: Height above the base at which the pads' centres close, mm.
        grip_diameter: Thickness there, mm.
        mass: grams (twin only).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    height: Millimetres
    base_diameter: Millimetres
    head_diameter: Millimetres
    grip_height: Millimetres
    grip_diameter: Millimetres
    mass: Annotated[float, Field(gt=0, le=500)] = 40.0

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.grip_height >= self.height:
            raise ValueError(f"grip_height {self.grip_height} mm must be below the height {self.height} mm")
        if self.grip_diameter > max(self.base_diameter, self.head_diameter):
            raise ValueError(
                f"grip_diameter {self.grip_diameter} mm is wider than the piece "
                f"({max(self.base_diameter, self.head_diameter)} mm)"
            )
        return self


class PieceSet(BaseModel):
    """Six shapes under the kinds' English names."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = "custom"
    king: PieceShape
    queen: PieceShape
    rook: PieceShape
    bishop: PieceShape
    knight: PieceShape
    pawn: PieceShape

    def __getitem__(self, kind: chess.PieceType) -> PieceShape:
        shape: PieceShape = getattr(self, chess.piece_name(kind))
        return shape

    @property
    def tallest(self) -> float:
        """Height of the tallest kind, mm."""
        return max(self[kind].height for kind in KINDS)

    @property
    def widest_base(self) -> float:
        """Diameter of the widest base, mm."""
        return max(self[kind].base_diameter for kind in KINDS)


def _set(name: str, rows: Mapping[str, tuple[float, float, float, float, float, float]]) -> PieceSet:
    fields = ("height", "base_diameter", "head_diameter", "grip_height", "grip_diameter", "mass")
    shapes = {kind: PieceShape(**dict(zip(fields, row, strict=True))) for kind, row in rows.items()}
    return PieceSet(name=name, **shapes)


PRESETS: Mapping[str, PieceSet] = {
    # Staunton No. 6 proportions on 50 mm squares: the twin's set, heights of the carrying benchmark.
    "club": _set("club", {
        "king": (95, 38, 24, 48, 18, 58), "queen": (85, 36, 24, 44, 17, 52),
        "rook": (55, 33, 24, 30, 18, 42), "bishop": (70, 33, 21, 36, 16, 40),
        "knight": (60, 33, 24, 32, 18, 42), "pawn": (45, 29, 18, 24, 13, 28),
    }),
    # The thesis's own pieces: K100 Q50 B44 R50 N60 P36, gripped at half height.
    "thesis": _set("thesis", {
        "king": (100, 36, 24, 50, 20, 55), "queen": (50, 34, 24, 25, 18, 40),
        "rook": (50, 32, 24, 25, 20, 40), "bishop": (44, 32, 20, 22, 16, 34),
        "knight": (60, 32, 24, 30, 20, 42), "pawn": (36, 28, 18, 18, 14, 24),
    }),
    # Small magnetic or school sets on 35 mm squares.
    "small": _set("small", {
        "king": (65, 26, 17, 33, 12, 22), "queen": (57, 25, 17, 29, 12, 20),
        "rook": (38, 22, 16, 20, 12, 16), "bishop": (48, 22, 14, 25, 11, 16),
        "knight": (43, 22, 17, 22, 12, 16), "pawn": (33, 20, 13, 17, 9, 11),
    }),
}  # fmt: skip
