"""Other models of lenses than ours, and the polynomial next to them."""

from collections.abc import Callable
from dataclasses import replace

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
        to_x, to_y = _tangential(x, y)
        return np.stack([x * radial + to_x @ (p1, p2), y * radial + to_y @ (p1, p2)], axis=-1)

    return bend


def inverse(bend: Bend) -> Bend:
    """The model that undoes another one, by fixed-point iteration."""

    def straighten(bent: Array) -> Array:
        ideal = bent
        for _ in range(_STEPS):
            ideal = bent - (bend(ideal) - ideal)
        return ideal

    return straighten


def fitted(bend: Bend, camera: Intrinsics) -> tuple[Intrinsics, float]:
    """Our distortion for a camera with another lens model, over its whole picture.

    Brown and Conrady's polynomial is linear in its coefficients: a linear least-squares fit gives the best.

    Args:
        bend: The lens.
        camera: Without distortion.

    Returns:
        The camera with it, and by how many pixels it is off at most.
    """
    across, down = (np.linspace(0, size - 1, _GRID) for size in (camera.width, camera.height))
    columns, rows = np.meshgrid(across, down)
    ideal = camera.rays(np.stack([columns.ravel(), rows.ravel()], axis=-1))[:, :2]
    shifts = bend(ideal) - ideal
    x, y = ideal[:, :1], ideal[:, 1:]
    r2 = x * x + y * y
    powers = np.concatenate([r2, r2**2, r2**3], axis=1)
    to_x, to_y = _tangential(x[:, 0], y[:, 0])
    basis = np.concatenate([np.hstack([x * powers, to_x]), np.hstack([y * powers, to_y])])
    wanted = np.concatenate([shifts[:, 0], shifts[:, 1]])
    k1, k2, k3, p1, p2 = map(float, np.linalg.lstsq(basis, wanted, rcond=None)[0])
    off = np.abs(basis @ (k1, k2, k3, p1, p2) - wanted).max() * max(camera.fx, camera.fy)
    return replace(camera, distortion=(k1, k2, p1, p2, k3)), float(off)


def _tangential(x: Array, y: Array) -> tuple[Array, Array]:
    """(n, 2) each: what p1 and p2 add to x and to y."""
    r2 = x * x + y * y
    return np.stack([2 * x * y, r2 + 2 * x * x], axis=-1), np.stack([r2 + 2 * y * y, 2 * x * y], axis=-1)
