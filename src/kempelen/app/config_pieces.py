"""The set of pieces as it is configured."""

from typing import Annotated, Literal, Self

import chess
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from kempelen.core.pieces import KINDS, PRESETS, Millimetres, PieceSet, PieceShape


class Section(BaseModel):
    """A part of the file: frozen, and unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ShapeConfig(Section):
    """What differs from the preset in one kind of piece.

    Attributes:
        height: Base to top, mm.
        base_diameter: Widest part, at the bottom, mm.
        head_diameter: Widest part above the grip, mm.
        grip_height: Height above the base at which the pads' centres close, mm.
        grip_diameter: Thickness there, mm.
        mass: Grams (twin only).
    """

    height: Millimetres | None = None
    base_diameter: Millimetres | None = None
    head_diameter: Millimetres | None = None
    grip_height: Millimetres | None = None
    grip_diameter: Millimetres | None = None
    mass: Annotated[float, Field(gt=0, le=500)] | None = None


class PiecesConfig(Section):
    """The set of pieces: a preset, and what differs from it.

    Attributes:
        preset: "club" (Staunton No. 6, for 50 mm squares), "thesis" or "small" (for 35 mm squares).
        king: Sizes that differ.
        queen: Sizes that differ.
        rook: Sizes that differ.
        bishop: Sizes that differ.
        knight: Sizes that differ.
        pawn: Sizes that differ.
    """

    preset: Literal["club", "thesis", "small"] = "club"
    king: ShapeConfig = Field(default_factory=ShapeConfig)
    queen: ShapeConfig = Field(default_factory=ShapeConfig)
    rook: ShapeConfig = Field(default_factory=ShapeConfig)
    bishop: ShapeConfig = Field(default_factory=ShapeConfig)
    knight: ShapeConfig = Field(default_factory=ShapeConfig)
    pawn: ShapeConfig = Field(default_factory=ShapeConfig)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for name in map(chess.piece_name, KINDS):
            try:
                self._shape(name)
            except ValidationError as error:
                raise ValueError(
                    f"{name}: {error.errors()[0]['msg'].removeprefix('Value error, ')}"
                ) from None
        return self

    def piece_set(self) -> PieceSet:
        """The preset with the changes."""
        names = [chess.piece_name(kind) for kind in KINDS]
        changed = any(self._changes(name) for name in names)
        return PieceSet(
            name=f"{self.preset}, changed" if changed else self.preset,
            **{name: self._shape(name) for name in names},
        )

    def _shape(self, name: str) -> PieceShape:
        preset: PieceShape = getattr(PRESETS[self.preset], name)
        return PieceShape.model_validate(preset.model_dump() | self._changes(name))

    def _changes(self, name: str) -> dict[str, float]:
        shape: ShapeConfig = getattr(self, name)
        return shape.model_dump(exclude_none=True)
