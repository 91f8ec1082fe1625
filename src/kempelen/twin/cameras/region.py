"""Rectangles of pixels."""

from dataclasses import dataclass

import numpy as np

from kempelen.core.camera import Intrinsics
from kempelen.core.geometry import Array


@dataclass(frozen=True, slots=True)
class Region:
    """Pixels of a picture: columns ``left`` up to ``right``, rows ``top`` up to ``bottom``."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def width(self) -> int:
        """Pixels."""
        return max(0, self.right - self.left)

    @property
    def height(self) -> int:
        """Pixels."""
        return max(0, self.bottom - self.top)

    @property
    def slices(self) -> tuple[slice, slice]:
        """To index a picture."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    @property
    def empty(self) -> bool:
        """Whether there is nothing in it."""
        return self.width == 0 or self.height == 0

    def within(self, other: "Region") -> tuple[slice, slice]:
        """To index a picture of the larger region ``other``."""
        return (
            slice(self.top - other.top, self.bottom - other.top),
            slice(self.left - other.left, self.right - other.left),
        )

    def times(self, factor: int) -> "Region":
        """The same part of a picture that is so many times as fine."""
        return Region(self.left * factor, self.top * factor, self.right * factor, self.bottom * factor)

    def grown(self, by: int, width: int, height: int) -> "Region":
        """Larger on all sides, as far as a picture of that size reaches."""
        return Region(
            max(self.left - by, 0),
            max(self.top - by, 0),
            min(self.right + by, width),
            min(self.bottom + by, height),
        )

    @classmethod
    def around(cls, pixels: Array, intrinsics: Intrinsics) -> "Region":
        """The part of a picture that holds (n, 2) points."""
        if not len(pixels):
            return cls(0, 0, 0, 0)
        size = (intrinsics.width, intrinsics.height)
        left, top = np.clip(np.floor(pixels.min(axis=0)), 0, size).astype(int).tolist()
        right, bottom = np.clip(np.ceil(pixels.max(axis=0)) + 1, 0, size).astype(int).tolist()
        return cls(left, top, right, bottom)

    @classmethod
    def whole(cls, intrinsics: Intrinsics) -> "Region":
        """All of a picture."""
        return cls(0, 0, intrinsics.width, intrinsics.height)
