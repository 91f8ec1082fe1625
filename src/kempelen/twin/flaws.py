"""How an arm truly differs from what its parameter file says, and what goes wrong with it in time."""

from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

_Angle = Annotated[float, Field(ge=-0.5, le=0.5)]
_Length = Annotated[float, Field(ge=-30, le=30)]
_Share = Annotated[float, Field(ge=0, le=20)]


class ArmFlaws(BaseModel):
    """Truth about one arm. Without arguments: built as its file says, drifting as its file says.

    Attributes:
        seed: Of everything that is left to chance.
        drift: Share of the file's error at each stop; 0 switches it off.
        play: Share of the file's play; 0 switches it off.
        temperature: Share of the file's error of a warm machine; 0 switches it off.
        homing: Share of the file's spread of homing; 0 switches it off.
        base: True place of the base in the robot's frame, x, y, z, mm.
        base_turn: True attitude of the base, turns about the robot's x, y, z, in this order, rad.
        offsets: For each joint: true angle minus what a homed controller makes of it, rad; empty: none.
        lengths: For each link: true a and d minus the file's, mm; empty: none.
        coupling: True ``motor_from_joint``, row by row; empty: the file's.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    seed: int = 0
    drift: _Share = 1.0
    play: _Share = 1.0
    temperature: _Share = 1.0
    homing: _Share = 1.0
    base: tuple[_Length, _Length, _Length] = (0.0, 0.0, 0.0)
    base_turn: tuple[_Angle, _Angle, _Angle] = (0.0, 0.0, 0.0)
    offsets: tuple[_Angle, ...] = ()
    lengths: tuple[tuple[_Length, _Length], ...] = ()
    coupling: tuple[tuple[float, ...], ...] = ()

    @model_validator(mode="after")
    def _coupling_turns_back(self) -> Self:
        rows = self.coupling
        if not rows:
            return self
        if any(len(row) != len(rows) for row in rows):
            raise ValueError(f"coupling: {len(rows)} rows need {len(rows)} numbers each")
        if abs(float(np.linalg.det(np.array(rows)))) < _SINGULAR:
            raise ValueError("coupling: the matrix cannot be inverted; no motor angles tell the joints")
        return self


FLAWLESS = ArmFlaws(drift=0.0, play=0.0, temperature=0.0, homing=0.0)
"""An arm that is what its file says and stays so."""
_SINGULAR = 1e-9
