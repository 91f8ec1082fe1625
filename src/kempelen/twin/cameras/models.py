"""The cameras that can be simulated: optics as their makers and the literature give them."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from kempelen.core.camera import Intrinsics
from kempelen.core.geometry import Transform


class Principle(StrEnum):
    """How depth is measured."""

    TIME_OF_FLIGHT = "time of flight"
    STEREO = "stereo"


@dataclass(frozen=True, slots=True)
class CameraModel:
    """Optics of a depth camera.

    Attributes:
        name: As in the configuration.
        colour: Intrinsics of the colour picture.
        depth: Intrinsics of the depth picture.
        colour_from_depth: From the depth camera's frame to the colour camera's.
        principle: How depth is measured.
        rate: Frames a second.
        nearest: Least depth that is measured, mm.
        farthest: Greatest depth that is measured, mm.
        supersample: Rays across a depth pixel.
        baseline: Of the two eyes of a stereo camera, mm.
    """

    name: str
    colour: Intrinsics
    depth: Intrinsics
    colour_from_depth: Transform
    principle: Principle
    rate: float = 30.0
    nearest: float = 500.0
    farthest: float = 4500.0
    supersample: int = 3
    baseline: float = 0.0


def _beside(x: float, y: float, z: float) -> Transform:
    """Of a depth camera that looks the same way, (x, y, z) mm from the colour camera in its frame."""
    return Transform(np.eye(3), np.array([x, y, z]))


KINECT_V2 = CameraModel(
    name="kinect2",
    colour=Intrinsics(1920, 1080, 1064.0, 1064.0, 959.5, 539.5),  # 84.1 x 53.8 degrees
    depth=Intrinsics(512, 424, 365.5, 365.5, 254.9, 205.4, (0.0905, -0.268, 0.0, 0.0, 0.0951)),
    colour_from_depth=_beside(-52.0, -0.4, 0.9),
    principle=Principle.TIME_OF_FLIGHT,
)
D435 = CameraModel(
    name="d435",
    colour=Intrinsics(1920, 1080, 1377.0, 1377.0, 963.2, 541.1),  # 69.8 x 42.8 degrees
    depth=Intrinsics(848, 480, 425.6, 425.6, 423.1, 240.7),  # 89.8 x 58.8 degrees
    colour_from_depth=_beside(14.7, 0.1, 0.3),
    principle=Principle.STEREO,
    nearest=200.0,
    supersample=1,
    baseline=50.0,
)
D435_HD = CameraModel(
    name="d435-hd",
    colour=D435.colour,
    depth=Intrinsics(1280, 720, 642.4, 642.4, 638.7, 361.0),
    colour_from_depth=D435.colour_from_depth,
    principle=Principle.STEREO,
    nearest=280.0,
    supersample=1,
    baseline=50.0,
)
MODELS: Mapping[str, CameraModel] = {model.name: model for model in (KINECT_V2, D435, D435_HD)}
