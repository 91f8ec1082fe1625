"""Where the board is in a picture.

The board plane is measured in squares here: (0, 0) is a1's outer corner, x runs along the files to (8, 0) at
h1's, y along the ranks. Times the side of a square this is the board frame of the table.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array, Transform

OUTER_CORNERS = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]])
"""(4, 2) squares: the outer corners of a1, h1, h8 and a8."""

DARK = np.array([(square // 8 + square % 8) % 2 == 0 for square in range(64)])
"""(64,) which squares are dark: a1 is."""


@dataclass(frozen=True, slots=True, eq=False)
class BoardSighting:
    """A board found in one picture.

    Attributes:
        image_from_board: (3, 3) homography from squares of the board plane to pixels of the colour picture,
            as it is (with whatever distortion a homography can follow).
        residual: RMS distance of the lattice's points from the homography, in squares.
        confidence: 0 to 1, that this is the board and that no row is missed.
        oriented: Whether it is known which corner is a1; else any of the four turns may be true.
        method: That found it.
        square: Side of a square, mm; None when neither known nor measured.
        camera_from_board: Pose, mm, in the colour camera's frame; None without intrinsics or ``square``.
    """

    image_from_board: Array
    residual: float
    confidence: float
    method: str
    oriented: bool = False
    square: float | None = None
    camera_from_board: Transform | None = None

    @property
    def corners(self) -> Array:
        """(4, 2) pixels of the outer corners of a1, h1, h8 and a8."""
        return self.pixels(OUTER_CORNERS)

    def pixels(self, points: npt.ArrayLike) -> Array:
        """(n, 2) pixels of (n, 2) points of the board plane, squares."""
        return moved(self.image_from_board, points)

    def board_points(self, pixels: npt.ArrayLike) -> Array:
        """(n, 2) squares of (n, 2) pixels: where their rays meet the board plane."""
        return moved(np.linalg.inv(self.image_from_board).astype(np.float64), pixels)


def moved(homography: Array, points: npt.ArrayLike) -> Array:
    """(n, 2) points through a (3, 3) homography."""
    points = np.asarray(points, dtype=np.float64)
    out = points @ homography[:, :2].T + homography[:, 2]
    result: Array = out[..., :2] / out[..., 2:3]
    return result
