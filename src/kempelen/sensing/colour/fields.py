"""Smooth fields over the board, fitted to one value per square, of which some are wrong."""

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.sensing.colour.columns import MARGIN

MAD_TO_SIGMA = 1.4826
ROUNDS = 8  # of reweighting; it has converged by then
EFFICIENT = 2.4  # scales of a Cauchy weight that is 95 % efficient for a Gaussian
STIFF = (0.0, 1.0, 1.0, 4.0, 4.0, 4.0)  # pseudo-squares that say "flat"


def _terms(x: Array, y: Array) -> Array:
    """(..., 6) up to quadratic, each within +-1 over the squares' centres."""
    return np.stack([np.ones_like(x), x, y, x * y, x * x - 0.5, y * y - 0.5], axis=-1)


_FILES, _RANKS = (np.tile(np.arange(8.0), 8) - 3.5) / 3.5, (np.repeat(np.arange(8.0), 8) - 3.5) / 3.5
BASIS = _terms(_FILES, _RANKS)
"""(64, 6) the terms at the centres of the squares."""


@lru_cache(maxsize=4)
def basis_at(n: int, pixels: float) -> Array:
    """(n, n, 6) the terms at each pixel of a plane picture, beyond the board as at its edge."""
    place = np.clip(((np.arange(n) + 0.5) / pixels - MARGIN - 4) / 3.5, -4 / 3.5, 4 / 3.5)
    x, y = np.meshgrid(place, -place)
    return _terms(x, y)


def fit_smooth(values: Array, trust: npt.ArrayLike = 1.0, floor: float = 1e-3) -> Array:
    """(6,) factors of the terms: robust (Cauchy weights), stiff where little is known.

    Args:
        values: (64,).
        trust: (64,) or a number: weight of each square.
        floor: Smallest scale of what is called an outlier.
    """
    weight = np.broadcast_to(np.asarray(trust, dtype=np.float64), 64)
    fitted = np.full(64, weighted_median(values, weight))
    factors = np.zeros(len(STIFF))
    for _ in range(ROUNDS):
        off = values - fitted
        scale = MAD_TO_SIGMA * weighted_median(np.abs(off), weight) + floor
        bent = weight / (1 + (off / (EFFICIENT * scale)) ** 2)
        normal = (BASIS * bent[:, None]).T @ BASIS + np.diag(STIFF)
        factors = np.linalg.solve(normal, (BASIS * bent[:, None]).T @ values)
        fitted = BASIS @ factors
    return factors


def weighted_median(values: Array, weight: Array) -> float:
    """Half of the weight lies on either side."""
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(share, share[-1] / 2)])
