"""Colours as numbers on which light only adds: a gain, a white balance, a lamp that moved.

The channels are the mean logarithm of red, green and blue light, red over green, and blue over green. Dust
and the lens add a floor of light, which also keeps the noise of black pieces finite.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.sensing.colour.columns import MARGIN, Columns, Plane, tiles, without_margin
from kempelen.sensing.colour.fields import basis_at, fit_smooth

FLOOR = 0.02  # of full scale: black plastic reflects 2 to 4 %, lenses scatter about 1 %
WINDOW = 1.5  # squares: more than twice what the widest foot covers, less than a hand's shadow
RANGE = 2.0  # largest change of light by a shadow that is followed; the eighth part is left

_DARKEST = 0.04045  # sRGB is straight up to there (IEC 61966-2-1)
_code = np.arange(256) / 255
_LINEAR = np.where(_code <= _DARKEST, _code / 12.92, ((_code + 0.055) / 1.055) ** 2.4)
_LOG = np.log(_LINEAR + FLOOR).astype(np.float32)
_CHANNELS_FROM_BGR = np.array([[1 / 3, 1 / 3, 1 / 3], [0, -1, 1], [1, -1, 0]])


def encoded(seen: Plane) -> Plane:
    """BGR, whole numbers 0 to 255, as (mean, red over green, blue over green) of logarithms."""
    logs = cv2.LUT(seen.astype(np.uint8), _LOG)
    return np.asarray(cv2.transform(logs, _CHANNELS_FROM_BGR), dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class LightChange:
    """What the light added between two pictures of a board.

    Attributes:
        whole: (n, n, 3) smooth part and shadows at each pixel of the plane picture.
        smooth: (n, n, 3) smooth part alone.
    """

    whole: Plane
    smooth: Plane

    @classmethod
    def between(cls, before: Plane, after: Plane, trust: npt.ArrayLike = 1.0) -> "LightChange":
        """Smooth change fitted to all squares with Cauchy weights; then shadows by a running median.

        A piece that came or went covers less than half of any window of `WINDOW` squares, so that the median
        passes over it; the shadow of a hand or a head covers more, and keeps its edge.

        Args:
            before: Encoded plane picture.
            after: Encoded plane picture.
            trust: (64,) or a number: weight of each square, for instance that it stands unchanged.
        """
        off = after - before
        seen = _medians(tiles(without_margin(off)).reshape(64, -1, 3)).astype(np.float64)
        fits = np.column_stack([fit_smooth(seen[:, channel], trust) for channel in range(3)])
        pixels = len(off) / (8 + 2 * MARGIN)
        smooth = (basis_at(len(off), pixels) @ fits).astype(np.float32)
        whole = smooth + _shadows(off - smooth, pixels)
        return cls(whole, smooth)

    def removed(self, seen: Plane) -> Plane:
        """An encoded plane picture as it would look without the change."""
        return seen - self.whole


def _medians(values: Columns) -> Columns:
    """Along the second axis; sorting float32 takes a fifth of the time of `np.median`."""
    count = values.shape[1]
    middle = np.sort(values, axis=1)[:, (count - 1) // 2 : count // 2 + 1]
    out: Columns = middle.mean(axis=1)
    return out


def _shadows(off: Plane, pixels: float) -> Plane:
    """(n, n, 3) running median of a change of light; beyond the board as at its edge."""
    edge = round(MARGIN * pixels)
    board = np.clip((without_margin(off) / RANGE + 1) * 127.5 + 0.5, 0, 255).astype(np.uint8)
    window = 2 * round(WINDOW * pixels / 2) + 1
    median = cv2.medianBlur(np.ascontiguousarray(board), window).astype(np.float32)
    change = (median / 127.5 - 1) * RANGE
    whole = cv2.copyMakeBorder(change, edge, edge, edge, edge, cv2.BORDER_REPLICATE)
    return np.asarray(whole, dtype=np.float32)
