"""The flat tops on which pieces stand: the playing field and the trays, as seen from the robot."""

from dataclasses import dataclass
from math import hypot
from typing import Self, TypeVar

import numpy as np

from kempelen.core.geometry import Array, Transform

Point = tuple[float, float, float]
Number = TypeVar("Number", float, Array)


@dataclass(frozen=True, slots=True)
class Surface:
    """A rectangle of a plane, robot frame, mm. Plain floats: planners ask it thousands of times.

    Attributes:
        name: ``"board"`` or the tray's name.
        corner: (x, y, z) of its first corner.
        along: Unit (x, y) direction of its first side; the second side lies 90° to the left.
        size: Lengths of the first and the second side.
        slope: Rise per mm along the robot's x and y.
    """

    name: str
    corner: Point
    along: tuple[float, float]
    size: tuple[float, float]
    slope: tuple[float, float]

    @classmethod
    def in_frame(cls, name: str, pose: Transform, corner: Point, size: tuple[float, float]) -> Self:
        """From ``robot_from_board``, a corner in the board frame and the sides along its x and y."""
        x, y, z = (float(v) for v in pose @ np.array(corner))
        (ax, ay), normal = pose.rotation[:2, 0], pose.rotation[:, 2]
        scale = hypot(ax, ay)
        slope = (float(-normal[0] / normal[2]), float(-normal[1] / normal[2]))
        return cls(name, (x, y, z), (float(ax / scale), float(ay / scale)), size, slope)

    def height(self, x: Number, y: Number) -> Number:
        """Height z of its plane at (x, y); of many places as arrays."""
        return self.corner[2] + self.slope[0] * (x - self.corner[0]) + self.slope[1] * (y - self.corner[1])

    def local(self, x: Number, y: Number) -> tuple[Number, Number]:
        """Where (x, y) lies along its two sides, from its corner; of many places as arrays."""
        dx, dy = x - self.corner[0], y - self.corner[1]
        return dx * self.along[0] + dy * self.along[1], dy * self.along[0] - dx * self.along[1]
