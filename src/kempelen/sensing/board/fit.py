"""The board's homography from all its corners, hinge allowed for.

A folding board's two halves lie a little apart, or the squares beside the hinge are narrower: corners beyond
the middle are off by a constant. That gap is estimated as one more parameter where it explains the corners
clearly better; the outer corners then come out right, and everything else within half the gap.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kempelen.core.geometry import Array
from kempelen.sensing.board.lattice import TINY, apply, fit_homography, inverse
from kempelen.sensing.board.placement import ROWS

_HINGE = ROWS / 2
_WIDEST_GAP = 0.4  # squares
_LEAST_GAP = 0.04  # squares: less moves no outer corner by more than the corners' own noise
_SUSPECT = 0.012  # squares RMS from which a gap is looked for: a gap of 0.04 leaves that much in a plain fit
_CLEARLY = 25.0  # F ratio from which a gap is believed: five standard errors
_PER_HALF = 8  # corners on each side of the hinge, without which no gap is looked for
_ROUNDS = 4
_HUBER = 1.345  # deviations within which a residual counts in full (95 % efficient on normal noise)
_LEAST_SPREAD = 0.004  # squares: no corner is located better
_GOLDEN = (np.sqrt(5) - 1) / 2
_SEARCH_STEPS = 14  # of the golden section: 0.4 squares down to 0.0005


@dataclass(frozen=True, slots=True, eq=False)
class BoardFit:
    """What the corners say.

    Attributes:
        pixels_from_window: (3, 3) homography from squares, (0, 0) to (8, 8), to pixels.
        residual: RMS distance of the corners from their places, squares.
        hinge: 0 or 1 where the halves lie apart along x or y, None where they do not.
        gap: Squares between the halves.
    """

    pixels_from_window: Array
    residual: float
    hinge: int | None = None
    gap: float = 0.0


def fit_board(places: Array, pixels: Array) -> BoardFit | None:
    """Robust fit of (n, 2) pixels to (n, 2) places, whole numbers from 1 to 7; None when they are too few."""
    plain = _robust(places, pixels)
    if plain is None:
        return None
    best, fitted = plain, BoardFit(plain[0], _rms(places, pixels, plain[0]))
    for axis in (0, 1) if fitted.residual > _SUSPECT else ():
        beside = places[:, axis] != _HINGE
        low = int((places[:, axis] < _HINGE).sum())
        if min(low, int(beside.sum()) - low) < _PER_HALF:
            continue
        gap = _best_gap(places[beside], pixels[beside], axis)
        apart = _robust(_opened(places[beside], axis, gap), pixels[beside])
        together = _robust(places[beside], pixels[beside])
        if apart is None or together is None:
            continue
        ratio = (together[1] - apart[1]) / max(apart[1] / max(2 * int(beside.sum()) - 9, 1), 1e-12)
        if ratio > _CLEARLY and gap > _LEAST_GAP and apart[1] < best[1]:
            best = apart
            residual = _rms(_opened(places[beside], axis, gap), pixels[beside], apart[0])
            fitted = BoardFit(apart[0] @ _closed(axis, gap), residual, axis, gap)
    return fitted


def _robust(places: Array, pixels: Array) -> tuple[Array, float] | None:
    """Homography by iteratively reweighted least squares (Huber), and its loss in square squares."""
    weights = np.ones(len(places))
    homography: Array | None = None
    loss = np.inf
    for _ in range(_ROUNDS):
        homography = fit_homography(places, pixels, weights)
        if homography is None or abs(np.linalg.det(homography)) < TINY:
            return None
        seen, _unused = apply(inverse(homography), pixels)
        off = np.linalg.norm(seen - places, axis=1)
        bound = _HUBER * max(1.4826 * float(np.median(off)), _LEAST_SPREAD)
        loss = float(np.where(off < bound, off**2, 2 * bound * off - bound**2).sum())
        _, depth = apply(homography, places)
        # algebraic residuals grow with the denominator: divided by it they are pixels again
        weights = np.sqrt(np.minimum(1.0, bound / np.maximum(off, 1e-9))) / np.abs(depth)
    return None if homography is None else (homography, loss)


def _rms(places: Array, pixels: Array, homography: Array) -> float:
    seen, _ = apply(inverse(homography), pixels)
    return float(np.sqrt(np.mean(np.sum((seen - places) ** 2, axis=1))))


def _opened(places: Array, axis: int, gap: float) -> Array:
    out = places.astype(np.float64)
    out[:, axis] += np.where(out[:, axis] > _HINGE, gap / 2, np.where(out[:, axis] < _HINGE, -gap / 2, 0.0))
    return out


def _closed(axis: int, gap: float) -> Array:
    """(3, 3) that spreads eight equal squares over the opened board."""
    out = np.eye(3)
    out[axis, axis] = (ROWS + gap) / ROWS
    out[axis, 2] = -gap / 2
    return out


def _best_gap(places: Array, pixels: Array, axis: int) -> float:
    def loss(gap: float) -> float:
        fitted = fit_homography(_opened(places, axis, gap), pixels)
        if fitted is None or abs(np.linalg.det(fitted)) < TINY:
            return np.inf
        seen, _ = apply(inverse(fitted), pixels)
        return float(np.abs(seen - _opened(places, axis, gap)).sum())

    return _golden_section(loss, 0.0, _WIDEST_GAP)


def _golden_section(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function of one dip is least."""
    inner, outer = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_inner, at_outer = function(inner), function(outer)
    for _ in range(_SEARCH_STEPS):
        if at_inner < at_outer:
            high, outer, at_outer = outer, inner, at_inner
            inner = high - _GOLDEN * (high - low)
            at_inner = function(inner)
        else:
            low, inner, at_inner = inner, outer, at_outer
            outer = low + _GOLDEN * (high - low)
            at_outer = function(outer)
    return (low + high) / 2
