"""Rigid transforms between frames.

A transform is named ``a_from_b`` so that ``p_a = a_from_b @ p_b``. Lengths are millimetres, angles radians.
"""

from dataclasses import dataclass
from typing import Self, overload

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import CalibrationError

Array = npt.NDArray[np.float64]

_ORTHONORMAL_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Transform:
    """An element of SE(3).

    Attributes:
        rotation: (3, 3) rotation matrix, right-handed.
        translation: (3,) mm.

    Raises:
        CalibrationError: the matrix is not a rotation, or a number is not finite.
    """

    rotation: Array
    translation: Array

    def __post_init__(self) -> None:
        rotation = np.array(self.rotation, dtype=np.float64).reshape(3, 3)
        translation = np.array(self.translation, dtype=np.float64).reshape(3)
        if not (np.isfinite(rotation).all() and np.isfinite(translation).all()):
            raise CalibrationError("A transform holds a number that is not finite.", hint="Calibrate again.")
        off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
        if off > _ORTHONORMAL_TOLERANCE or np.linalg.det(rotation) < 0:
            raise CalibrationError(
                f"A transform's matrix is no rotation: off by {off:.2g} > {_ORTHONORMAL_TOLERANCE:.0e}.",
                hint="Calibrate again.",
            )
        rotation.setflags(write=False)
        translation.setflags(write=False)
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "translation", translation)

    @classmethod
    def identity(cls) -> Self:
        """The transform that changes nothing."""
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def about_z(cls, angle: float, translation: npt.ArrayLike = (0.0, 0.0, 0.0)) -> Self:
        """A turn by ``angle`` rad about +z, then a shift by ``translation`` (3,) mm."""
        c, s = float(np.cos(angle)), float(np.sin(angle))
        return cls(
            np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.asarray(translation, dtype=np.float64)
        )

    @property
    def matrix(self) -> Array:
        """(4, 4) homogeneous matrix."""
        out = np.eye(4)
        out[:3, :3] = self.rotation
        out[:3, 3] = self.translation
        return out

    @property
    def yaw(self) -> float:
        """Turn about z, rad in (-pi, pi]."""
        return float(np.arctan2(self.rotation[1, 0], self.rotation[0, 0]))

    @property
    def tilt(self) -> float:
        """Angle between the two z axes, rad."""
        return float(np.arccos(np.clip(self.rotation[2, 2], -1.0, 1.0)))

    def inverse(self) -> "Transform":
        """``b_from_a`` of ``a_from_b``."""
        return Transform(self.rotation.T, -self.rotation.T @ self.translation)

    @overload
    def __matmul__(self, other: "Transform") -> "Transform": ...
    @overload
    def __matmul__(self, other: npt.ArrayLike) -> Array: ...
    def __matmul__(self, other: "Transform | npt.ArrayLike") -> "Transform | Array":
        """Compose with a transform, or move points of shape (3,) or (..., 3)."""
        if isinstance(other, Transform):
            return Transform(
                self.rotation @ other.rotation, self.rotation @ other.translation + self.translation
            )
        return np.asarray(other, dtype=np.float64) @ self.rotation.T + self.translation
