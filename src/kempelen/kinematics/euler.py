"""Orientation as in the paper: Rot(z, Φ) Rot(y, Θ) Rot(z, ψ); pitch Θ, pi straight down, and roll ψ."""

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array

_VERTICAL = 1e-9
"""Sine of the pitch below which azimuth and roll cannot be told apart."""


def zyz_from_matrix(rotation: npt.ArrayLike) -> Array:
    """Euler angles of rotations.

    Args:
        rotation: (..., 3, 3), or poses (..., 4, 4).

    Returns:
        (..., 3) rad: Φ in (-pi, pi], Θ in [0, pi], ψ in (-pi, pi]. Where the gripper is vertical only one
        turn is left of Φ and ψ: then Φ is 0.
    """
    r = np.asarray(rotation, dtype=np.float64)
    sine = np.hypot(r[..., 0, 2], r[..., 1, 2])
    pitch = np.arctan2(sine, r[..., 2, 2])
    level = sine > _VERTICAL
    azimuth = np.where(level, np.arctan2(r[..., 1, 2], r[..., 0, 2]), 0.0)
    # With Φ = 0 the second column is (-cos Θ sin ψ, cos ψ, sin Θ sin ψ)
    upright = np.arctan2(-r[..., 0, 1] * np.sign(r[..., 2, 2]), r[..., 1, 1])
    roll = np.where(level, np.arctan2(r[..., 2, 1], -r[..., 2, 0]), upright)
    return np.stack([azimuth, pitch, roll], axis=-1)


def matrix_from_zyz(angles: npt.ArrayLike) -> Array:
    """Rotations (..., 3, 3) of Euler angles (..., 3) rad."""
    azimuth, pitch, roll = np.moveaxis(np.asarray(angles, dtype=np.float64), -1, 0)
    (cf, ct, cp), (sf, st, sp) = np.cos([azimuth, pitch, roll]), np.sin([azimuth, pitch, roll])
    rows = [
        [cf * ct * cp - sf * sp, -cf * ct * sp - sf * cp, cf * st],
        [sf * ct * cp + cf * sp, -sf * ct * sp + cf * cp, sf * st],
        [-st * cp, st * sp, ct],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
