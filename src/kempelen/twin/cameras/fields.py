"""Banks of random numbers: drawn once, then cut out at random places, since a frame has millions of them."""

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

Field = npt.NDArray[np.float32]

_SPARE = 192
"""Pixels that a bank is larger than a picture, each way: 36 864 different cuts."""


class Bank:
    """Random pictures.

    Args:
        rng: Where the numbers come from.
        numbers: (h + spare, w + spare) of any kind.
    """

    def __init__(self, rng: np.random.Generator, numbers: npt.NDArray[Any]) -> None:
        self._rng = rng
        self._numbers = numbers

    def cut(self) -> npt.NDArray[Any]:
        """A (h, w) view."""
        height, width = self._numbers.shape
        return self._numbers[window(self._rng, height - _SPARE, width - _SPARE)]

    @classmethod
    def normal(cls, rng: np.random.Generator, height: int, width: int, *, smooth: float = 0.0) -> "Bank":
        """Standard normal numbers, with neighbours alike over ``smooth`` pixels."""
        return cls(rng, normal(rng, *spare(height, width), smooth=smooth))

    @classmethod
    def uniform(cls, rng: np.random.Generator, height: int, width: int) -> "Bank":
        """Numbers from 0 to 1."""
        return cls(rng, rng.random(spare(height, width), dtype=np.float32))


def spare(height: int, width: int) -> tuple[int, int]:
    """Shape of a bank for pictures of that size."""
    return height + _SPARE, width + _SPARE


def window(rng: np.random.Generator, height: int, width: int) -> tuple[slice, slice]:
    """Where to cut a picture of that size out of a bank for it."""
    top, left = map(int, rng.integers(0, _SPARE, 2))
    return slice(top, top + height), slice(left, left + width)


def normal(rng: np.random.Generator, height: int, width: int, *, smooth: float = 0.0) -> Field:
    """(h, w) of mean 0 and spread 1, with neighbours alike over ``smooth`` pixels."""
    out = rng.standard_normal((height, width), dtype=np.float32)
    if smooth > 0:
        out = np.asarray(cv2.GaussianBlur(out, (0, 0), smooth), dtype=np.float32)
        out /= out.std()
    return out
