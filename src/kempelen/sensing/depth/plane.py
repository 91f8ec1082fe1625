"""The board's surface in a cloud of points: a plane under whatever stands on it."""

from dataclasses import dataclass

import numpy as np

from kempelen.core.errors import BoardNotFoundError
from kempelen.core.geometry import Array

_TRIPLES = 200  # three board points in one of them for certain (1 - 1e-12), with half of the points on pieces
_SAMPLE = 800
_STEPS = 12
_MAD = 1.4826  # of a normal distribution: sigma over median absolute deviation
_LEAST_POINTS = 50
_ROUGHEST = 3.0  # times the expected scatter: rougher than that is no plane
_SHARE_ON_PLANE = 0.25  # 32 pieces seen obliquely hide more than half of the board


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """``normal . p + offset = height``: positive on the camera's side.

    Attributes:
        normal: (3,) unit vector towards the camera.
        offset: mm, the camera's height above the plane.
        noise: Standard deviation of the points about it, mm.
    """

    normal: Array
    offset: float
    noise: float

    def heights(self, points: Array) -> Array:
        """(n,) mm above the plane of (n, 3) points."""
        out: Array = points @ self.normal + self.offset
        return out


def fit_board_plane(points: Array, scale: float = 3.0) -> Plane:
    """The plane that most points lie on, with the rest above it: MSAC, then one-sided reweighting.

    Points above weigh less than points below, for pieces stand on a board and nothing hangs under it: the
    scatter is measured on the lower side alone.

    Args:
        points: (n, 3) mm, of the camera's frame.
        scale: Scatter to be expected, mm.

    Raises:
        BoardNotFoundError: too few points, or no plane among them.
    """
    if len(points) < _LEAST_POINTS:
        raise BoardNotFoundError(
            f"Only {len(points)} points of the board have a depth; {_LEAST_POINTS} are needed.",
            hint="Bring the camera within its range of the board, and look at it less obliquely.",
        )
    plane = consensus(points[:: max(1, len(points) // _SAMPLE)], scale)
    for _ in range(_STEPS):
        plane = _refine(points, plane)
    scatter = np.clip(plane.noise, scale, _ROUGHEST * scale)
    share = float(np.mean(np.abs(plane.heights(points)) < 3 * scatter))
    if share < _SHARE_ON_PLANE:
        raise BoardNotFoundError(
            f"Only {100 * share:.0f} % of the depth points on the board lie on one plane; "
            f"{100 * _SHARE_ON_PLANE:.0f} % are needed.",
            hint="Something covers the board, or the depth picture does not belong to the colour picture.",
        )
    return plane


def consensus(points: Array, scale: float) -> Plane:
    """The plane through three of the points that most of them lie near: MSAC (Torr and Zisserman 2000).

    Args:
        points: (n, 3) mm, of the camera's frame; a few hundred are enough.
        scale: Scatter to be expected, mm.

    Raises:
        BoardNotFoundError: the points lie on one line.
    """
    rng = np.random.default_rng(len(points))  # the same points give the same plane
    corners = points[rng.integers(0, len(points), (_TRIPLES, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    good = lengths > 1e-6 * max(float(lengths.max()), 1e-9)
    if not good.any():
        raise BoardNotFoundError(
            "All points that have a depth lie on one line: no plane goes through them alone.",
            hint="Bring the camera within its range of the board, and keep sunlight off the table.",
        )
    normals = normals[good] / lengths[good, None]
    offsets = -np.einsum("ij,ij->i", normals, corners[good, 0])
    misses = np.abs(points @ normals.T + offsets)
    best = int(np.argmin(np.minimum(misses, 3 * scale).sum(axis=0)))
    return facing(normals[best], float(offsets[best]), scale)


def _refine(points: Array, plane: Plane) -> Plane:
    heights = plane.heights(points)
    below = heights[heights < 0]
    noise = max(_MAD * float(np.median(-below)) if len(below) else plane.noise, 0.2)
    away = heights / noise
    weights = np.where(away > 0, 1 / (1 + away**2 / 2) ** 2, 1 / (1 + away**2 / 8))
    centre = weights @ points / weights.sum()
    spread = (points - centre) * np.sqrt(weights)[:, None]
    normal = np.linalg.eigh(spread.T @ spread)[1][:, 0]
    return facing(normal, -float(normal @ centre), noise)


def facing(normal: Array, offset: float, noise: float) -> Plane:
    """The plane whose normal, if need be turned round, points to the camera."""
    sign = 1.0 if offset >= 0 else -1.0
    return Plane(sign * normal, sign * offset, noise)
