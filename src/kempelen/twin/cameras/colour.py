"""From a drawn picture to one that a sensor would give: lens, exposure, white balance, shot noise.

Shot noise grows with the square root of light, so it is added to the square root of the picture, where its
spread is the same everywhere: two saturating additions of 8-bit pictures and a table per frame.
"""

import math

import cv2
import numpy as np

from kempelen.core.camera import Picture
from kempelen.twin.cameras.fields import normal, spare, window
from kempelen.twin.cameras.noise import Noise
from kempelen.twin.cameras.settings import Lighting

_GREY = 128.0
"""Grey level for which the spread is given."""
_BLACK = 0.8
"""Grey level of no light at all: what a covered lens shows, with its noise."""
_LUMINANCE_SHARE = 0.8
"""Of the noise that all three colours share once the sensor's mosaic is filled in."""


class ColourSensor:
    """The chip behind a colour lens.

    Args:
        rng: Of its noise.
        height: Pixels.
        width: Pixels.
    """

    def __init__(self, rng: np.random.Generator, height: int, width: int) -> None:
        self._rng = rng
        self._size = (height, width)
        self._banks: tuple[Picture, Picture] | None = None
        self._shot = 0.0
        self._square = np.round(np.square(np.arange(256.0)) / 255).astype(np.uint8)

    @staticmethod
    def reach(noise: Noise) -> int:
        """Pixels over which the lens spreads what it sees."""
        return math.ceil(4 * noise.blur)

    def develop(self, drawn: Picture, lighting: Lighting, noise: Noise) -> Picture:
        """The mean picture, as square roots: (h, w, 3), to be handed to `expose`."""
        if noise.blur > 0:
            drawn = np.asarray(cv2.GaussianBlur(drawn, (0, 0), noise.blur), dtype=np.uint8)
        red, green, blue = lighting.white_balance
        gains = lighting.exposure * np.array([blue, green, red]) * (not lighting.covered)
        light = np.clip(np.arange(256.0)[:, None] * gains, _BLACK, 255.0)
        table = np.round(np.sqrt(255.0 * light)).astype(np.uint8)
        return np.asarray(cv2.LUT(drawn, np.ascontiguousarray(table[:, None, :])), dtype=np.uint8)

    def expose(self, roots: Picture, noise: Noise) -> Picture:
        """A frame: (h, w, 3) blue, green, red."""
        if noise.shot > 0:
            more, less = self._noise(noise.shot)
            roots = np.asarray(cv2.subtract(cv2.add(roots, more), less), dtype=np.uint8)
        return np.asarray(cv2.LUT(roots, self._square), dtype=np.uint8)

    def _noise(self, shot: float) -> tuple[Picture, Picture]:
        """(h, w, 3) what is added and what is taken away, of the square roots."""
        if self._banks is None or self._shot != shot:
            self._banks, self._shot = self._draw(shot), shot
        cut = window(self._rng, *self._size)
        return self._banks[0][cut], self._banks[1][cut]

    def _draw(self, shot: float) -> tuple[Picture, Picture]:
        height, width = spare(*self._size)
        spread = shot * 255 / (2 * np.sqrt(255 * _GREY))  # of the roots: their derivative at mid-grey
        common = normal(self._rng, height, width) * (_LUMINANCE_SHARE * spread)
        rest = np.sqrt(1 - _LUMINANCE_SHARE**2) * spread
        banks = np.empty((2, height, width, 3), dtype=np.uint8)
        for channel in range(3):
            field = common + rest * normal(self._rng, height, width)
            banks[0, ..., channel] = np.clip(np.round(field), 0, 255)
            banks[1, ..., channel] = np.clip(np.round(-field), 0, 255)
        return banks[0], banks[1]
