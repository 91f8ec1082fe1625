"""Where a camera stands, and in which light; as it crosses the process boundary."""

from dataclasses import replace
from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from kempelen.core.geometry import Array, Transform
from kempelen.twin.cameras.models import MODELS, CameraModel
from kempelen.twin.cameras.noise import NOMINAL, Noise

Share = Annotated[float, Field(ge=0, le=1)]
Gain = Annotated[float, Field(ge=0, le=8)]
Millimetres = Annotated[float, Field(ge=-10_000, le=10_000)]
Point = tuple[Millimetres, Millimetres, Millimetres]

_NEAREST = 50.0
_LEVEL = 1e-3
"""A view that is less inclined than this (sine) is straight down or up."""


class Placement(BaseModel):
    """Where the colour camera is and where it looks, frame of the board (mm).

    The default stands a little behind White and a metre up, so that the parked robot hides no square.

    Attributes:
        position: Of the lens.
        target: What appears in the middle of the picture.
        roll: Of the camera about its view, clockwise as seen from behind it, rad.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    position: Point = (200.0, -40.0, 1020.0)
    target: Point = (200.0, 205.0, 0.0)
    roll: Annotated[float, Field(ge=-3.1416, le=3.1416)] = 0.0

    @model_validator(mode="after")
    def _apart(self) -> Self:
        if np.linalg.norm(np.subtract(self.target, self.position)) < _NEAREST:
            raise ValueError(f"the target must be {_NEAREST:.0f} mm or more from the camera's position")
        return self

    @property
    def board_from_camera(self) -> Transform:
        """Pose of the colour camera, upright; straight from above, the top of its picture is Black's side."""
        z = _unit(np.subtract(self.target, self.position))
        level = float(np.hypot(z[0], z[1]))
        down = np.array([0.0, 0.0, -1.0]) if level > _LEVEL else np.array([0.0, -1.0, 0.0])
        x = _unit(np.cross(down, z))
        y = np.cross(z, x)
        c, s = np.cos(self.roll), np.sin(self.roll)
        return Transform(np.stack([c * x + s * y, c * y - s * x, z], axis=1), np.array(self.position))


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


class Lighting(BaseModel):
    """The room's light and how the camera takes it.

    Attributes:
        lamp: Where it hangs, frame of the board, mm.
        brightness: Of the lamp.
        ambient: Of the room, from everywhere.
        on: Whether there is any light; depth cameras bring their own.
        shadows: Whether the lamp throws any.
        glare: Brightness of the lamp's reflection in the board.
        exposure: Times the light.
        white_balance: Gains of red, green and blue.
        covered: Whether something is in front of the lenses.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    lamp: Point = (150.0, 800.0, 1700.0)
    brightness: Gain = 0.62
    ambient: Gain = 0.45
    on: bool = True
    shadows: bool = True
    glare: Annotated[float, Field(ge=0, le=2)] = 0.0
    exposure: Gain = 1.0
    white_balance: tuple[Gain, Gain, Gain] = (1.0, 1.0, 1.0)
    covered: bool = False


class CameraSpec(BaseModel):
    """A camera over the table.

    Attributes:
        model: ``kinect2``, ``d435`` or ``d435-hd``.
        placement: Where it is.
        lighting: In which light.
        noise: What is wrong with its frames.
        colour_scale: Size of the colour picture as a share of the camera's largest one.
        seed: Of all noise.
        ring: Name of the shared memory that its frames go to; empty for one that nobody else uses.
        backend: ``gl``, ``embree``, ``rays``, or ``auto`` for the first of them that works.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    model: str = "kinect2"
    placement: Placement = Placement()
    lighting: Lighting = Lighting()
    noise: Noise = NOMINAL
    colour_scale: Annotated[float, Field(ge=0.1, le=1)] = 1.0
    seed: Annotated[int, Field(ge=0)] = 0
    ring: Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]{0,60}$")] = ""
    backend: Annotated[str, Field(pattern=r"^(auto|gl|embree|rays)$")] = "auto"

    @model_validator(mode="after")
    def _known(self) -> Self:
        if self.model not in MODELS:
            raise ValueError(f"there is no camera model '{self.model}'; known are {', '.join(MODELS)}")
        return self

    @property
    def optics(self) -> CameraModel:
        """Its model."""
        model = MODELS[self.model]
        return replace(model, colour=model.colour.scaled(self.colour_scale))
