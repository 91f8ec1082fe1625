"""Colours as numbers on which light only adds: a gain, a white balance, a lamp that moved.

The channels are the mean logarithm of red, green and blue light, red over green, and blue over green. Dust
and the lens add a floor of light, which also keeps the noise of black pieces finite.
"""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.sensing.colour.columns import MARGIN, Plane, tiles, without_margin

FLOOR = 0.02  # of full scale: black plastic reflects 2 to 4 %, lenses scatter about 1 %
ROUNDS = 8  # of reweighting; it has converged by then
MAD_TO_SIGMA = 1.4826
WINDOW = 1.5  # squares: more than twice what the widest foot covers, less than a hand's shadow
RANGE = 2.0  # largest change of light by a shadow that is followed; the eighth part is left

_DARKEST = 0.04045  # sRGB is straight up to there (IEC 61966-2-1)
_code = np.arange(256) / 255
_LINEAR = np.where(_code <= _DARKEST, _code / 12.92, ((_code + 0.055) / 1.055) ** 2.4)
_LOG = np.log(_LINEAR + FLOOR).astype(np.float32)


def encoded(seen: Plane) -> Plane:
    """BGR, 0 to 255, as (mean, red over green, blue over green) of logarithms."""
    logs = _LOG[np.clip(np.rint(seen), 0, 255).astype(np.uint8)]
    blue, green, red = logs[..., 0], logs[..., 1], logs[..., 2]
    return np.stack([(blue + green + red) / 3, red - green, blue - green], axis=-1)


def _basis() -> Array:
    """(64, 6) up to quadratic over the board, each term within +-1, at the centres of the squares."""
    squares = np.arange(64)
    x, y = (squares % 8 - 3.5) / 3.5, (squares // 8 - 3.5) / 3.5
    return np.column_stack([np.ones(64), x, y, x * y, x * x - 0.5, y * y - 0.5])


_BASIS = _basis()
_STIFF = np.array([0.0, 1.0, 1.0, 4.0, 4.0, 4.0])  # pseudo-squares that say "flat"


@dataclass(frozen=True, slots=True, eq=False)
class LightChange:
    """What the light added between two pictures of a board.

    Attributes:
        field: (64, 3) smooth part at each square, encoded channels.
        whole: (n, n, 3) smooth part and shadows at each pixel of the plane picture.
    """

    field: Array
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
        seen = np.median(tiles(without_margin(off)).reshape(64, -1, 3), axis=1).astype(np.float64)
        trust = np.broadcast_to(np.asarray(trust, dtype=np.float64), 64)
        fits = [_smooth(seen[:, channel], trust) for channel in range(3)]
        pixels = len(off) / (8 + 2 * MARGIN)
        smooth = (_basis_at(len(off), pixels) @ np.column_stack(fits)).astype(np.float32)
        whole = smooth + _shadows(off - smooth, pixels)
        return cls(_BASIS @ np.column_stack(fits), whole, smooth)

    def removed(self, seen: Plane) -> Plane:
        """An encoded plane picture as it would look without the change."""
        return seen - self.whole


def _shadows(off: Plane, pixels: float) -> Plane:
    """(n, n, 3) running median of a change of light; beyond the board as at its edge."""
    edge = round(MARGIN * pixels)
    board = np.clip((without_margin(off) / RANGE + 1) * 127.5 + 0.5, 0, 255).astype(np.uint8)
    window = 2 * round(WINDOW * pixels / 2) + 1
    median = cv2.medianBlur(np.ascontiguousarray(board), window).astype(np.float32)
    change = (median / 127.5 - 1) * RANGE
    whole = cv2.copyMakeBorder(change, edge, edge, edge, edge, cv2.BORDER_REPLICATE)
    return np.asarray(whole, dtype=np.float32)


@lru_cache(maxsize=4)
def _basis_at(n: int, pixels: float) -> Array:
    """(n, n, 6) the basis at each pixel of a plane picture, beyond the board as at its edge."""
    place = np.clip(((np.arange(n) + 0.5) / pixels - MARGIN - 4) / 3.5, -4 / 3.5, 4 / 3.5)
    x, y = np.meshgrid(place, -place)
    return np.stack([np.ones((n, n)), x, y, x * y, x * x - 0.5, y * y - 0.5], axis=-1)


def _smooth(values: Array, trust: Array) -> Array:
    """(6,) robust fit of the basis to the values of the squares."""
    fitted = np.full(64, _weighted_median(values, trust))
    for _ in range(ROUNDS):
        off = values - fitted
        scale = MAD_TO_SIGMA * _weighted_median(np.abs(off), trust) + 1e-3
        weight = trust / (1 + (off / (2.4 * scale)) ** 2)  # 2.4: 95 % efficient for a Gaussian
        normal = (_BASIS * weight[:, None]).T @ _BASIS + np.diag(_STIFF)
        factors: Array = np.linalg.solve(normal, (_BASIS * weight[:, None]).T @ values)
        fitted = _BASIS @ factors
    return factors


def _weighted_median(values: Array, weight: Array) -> float:
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(share, share[-1] / 2)])
