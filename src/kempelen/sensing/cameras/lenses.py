"""Other models of lenses than ours, and the polynomial next to them."""

from collections.abc import Callable

import numpy as np

from kempelen.core.camera import Intrinsics
from kempelen.core.geometry import Array

_GRID = 25
_STEPS = 20
Bend = Callable[[Array], Array]
"""From (n, 2) ideal directions x/z, y/z to where they appear, or back."""


def rational(coefficients: Array) -> Bend:
    """The rational model of OpenCV and the Azure Kinect.

    Args:
        coefficients: (8,) k1, k2, p1, p2, k3, k4, k5, k6.
    """
    k1, k2, p1, p2, k3, k4, k5, k6 = coefficients

    def bend(ideal: Array) -> Array:
        x, y = ideal[:, 0], ideal[:, 1]
        r2 = x * x + y * y
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        across, along = _tangential(x, y)
        return np.stack([x * radial + across @ (p1, p2), y * radial + along @ (p1, p2)], axis=-1)

    return bend


def inverse(bend: Bend) -> Bend:
    """The model that undoes another one, by fixed-point iteration."""

    def straighten(bent: Array) -> Array:
        ideal = bent
        for _ in range(_STEPS):
            ideal = bent - (bend(ideal) - ideal)
        return ideal

    return straighten


def fitted(
    bend: Bend, width: int, height: int, fx: float, fy: float, cx: float, cy: float
) -> tuple[Intrinsics, float]:
    """Our intrinsics for a camera with another lens model, over its whole picture.

    Brown and Conrady's polynomial is linear in its coefficients: the best ones are a linear least-squares fit.

    Returns:
        The intrinsics, and by how many pixels they are off at most.
    """
    columns, rows = np.meshgrid(np.linspace(0, width - 1, _GRID), np.linspace(0, height - 1, _GRID))
    ideal = np.stack([(columns.ravel() - cx) / fx, (rows.ravel() - cy) / fy], axis=-1)
    shifts = bend(ideal) - ideal
    x, y = ideal[:, :1], ideal[:, 1:]
    r2 = x * x + y * y
    powers = np.concatenate([r2, r2**2, r2**3], axis=1)
    across, along = _tangential(x[:, 0], y[:, 0])
    basis = np.concatenate([np.hstack([x * powers, across]), np.hstack([y * powers, along])])
    wanted = np.concatenate([shifts[:, 0], shifts[:, 1]])
    k1, k2, k3, p1, p2 = map(float, np.linalg.lstsq(basis, wanted, rcond=None)[0])
    off = np.abs(basis @ (k1, k2, k3, p1, p2) - wanted).max() * max(fx, fy)
    return Intrinsics(width, height, fx, fy, cx, cy, (k1, k2, p1, p2, k3)), float(off)


def _tangential(x: Array, y: Array) -> tuple[Array, Array]:
    """(n, 2) each: what p1 and p2 add to x and to y."""
    r2 = x * x + y * y
    return np.stack([2 * x * y, r2 + 2 * x * x], axis=-1), np.stack([r2 + 2 * y * y, 2 * x * y], axis=-1)
