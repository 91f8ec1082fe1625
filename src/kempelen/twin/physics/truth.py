"""What is really so: for tests, reports, views and the virtual person; no driver may read it."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PieceTruth:
    """Where a piece really is.

    Attributes:
        piece_id: As in the scene.
        kind: One of ``K Q R B N P``.
        white: Its colour.
        x: Of the base's centre, robot frame, mm.
        y: Of the base's centre, robot frame, mm.
        z: Of the base's centre, robot frame, mm.
        tilt_rad: Between the piece's axis and the board's normal: 0 upright, pi/2 lying.
        quaternion: (w, x, y, z) of robot_from_piece.
    """

    piece_id: str
    kind: str
    white: bool
    x: float
    y: float
    z: float
    tilt_rad: float
    quaternion: tuple[float, float, float, float]

    @property
    def upright(self) -> bool:
        """Whether it stands rather than leans or lies."""
        return self.tilt_rad < UPRIGHT

    def distance(self, x: float, y: float) -> float:
        """From its base's centre to a point, mm, horizontally."""
        return math.hypot(self.x - x, self.y - y)


UPRIGHT = math.radians(3.0)
"""A piece that leans by more than this does not stand on its base."""
