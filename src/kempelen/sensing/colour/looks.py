"""What a column looks like, and how much it changed, in a few numbers."""

from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from kempelen.core.geometry import Array
from kempelen.sensing.colour.columns import Columns

SPREAD_FLOOR = 0.03  # natural logarithms of light: what noise and dirt do to an even surface
EDGE_FLOOR = 0.02
FINE_FLOOR = 0.01
RIM = 1 / 24  # of a square: standard deviation of the blur that leaves only the rims of pieces
CHANGE_FLOOR = 0.02
TINT_FLOOR = 0.01
SHIFT_FLOOR = 0.05
TINTED = 0.15  # standard deviation of a shadow's tint as a share of its depth: lamp against window


def looks(columns: Columns, radii: Sequence[float]) -> Array:
    """(n, 5 * slices): of each slice's disc brightness, both tints, spread and edges.

    Args:
        columns: Encoded, (n, slices, pixels, pixels, 3).
        radii: Of the discs, squares.
    """
    across = np.diff(columns, axis=3)[:, :, 1:]
    along = np.diff(columns, axis=2)[:, :, :, 1:]
    edges = np.sqrt(_energy(across) + _energy(along))
    out = []
    fine = _fine(columns)
    for k, radius in enumerate(radii):
        disc = _disc(columns.shape[2], radius)
        inside = columns[:, k][:, disc]
        out += list(inside.mean(axis=1).T)
        out.append(np.log(inside[..., 0].std(axis=1) + SPREAD_FLOOR))
        out.append(np.log(fine[:, k][:, disc].std(axis=1) + FINE_FLOOR))
        out.append(np.log(edges[:, k][:, disc[1:, 1:]].mean(axis=1) + EDGE_FLOOR))
    return np.stack(out, axis=1).astype(np.float64)


def _energy(steps: Columns) -> Columns:
    """(...) sums over the channels of (..., channels) squares."""
    out: Columns = np.einsum("...c,...c->...", steps, steps)
    return out


def _fine(columns: Columns) -> Columns:
    """(..., pixels, pixels) brightness without what is coarser than a piece's rim: no soft shadows."""
    bright = np.ascontiguousarray(columns[..., 0])
    blur = _blur(bright.shape[-1])
    return (bright - blur @ bright @ blur.T).astype(np.float32, copy=False)


@lru_cache(maxsize=4)
def _blur(pixels: int) -> Columns:
    """(pixels, pixels) matrix of a Gaussian blur along one axis: far cheaper than a call for each square."""
    unit = np.eye(pixels, dtype=np.float32)
    return np.asarray(cv2.GaussianBlur(unit, (1, 0), sigmaX=0, sigmaY=RIM * pixels), dtype=np.float32)


def _disc(pixels: int, radius: float) -> npt.NDArray[np.bool_]:
    middle = (np.arange(pixels) + 0.5) / pixels - 0.5
    out: npt.NDArray[np.bool_] = np.hypot(middle[None], middle[:, None]) < radius
    return out


def changes(before: Columns, after: Columns, search: int) -> Array:
    """(n, 5 * slices): how much the pattern, the tint, the brightness and the rims of each slice changed.

    The brightness of the whole slice is taken out of the pattern: a shadow is not a move. Rims come
    twice, as they are and as a share of what is there: a pattern may be shared because the same shadow lies
    over both, rims are not. Columns that are a little out of register are moved to where they fit best.

    Args:
        before: Encoded, (n, slices, pixels, pixels, 3).
        after: Of the same shape.
        search: Pixels by which they may be out of register.
    """
    slices = (-1, *before.shape[2:])
    return _slice_changes(before.reshape(slices), after.reshape(slices), search).reshape(len(before), -1)


def _slice_changes(before: Columns, after: Columns, search: int) -> Array:
    """(n, 5) as `changes`, of (n, pixels, pixels, 3)."""
    old, new = _registered(_patterns(before), _patterns(after), search)
    off = new - old
    pattern, *tints, rims = (off * off).mean(axis=(1, 2)).T
    shift = off[..., 0].mean(axis=(1, 2))
    pattern = pattern - shift**2 + CHANGE_FLOOR**2
    rims = rims + FINE_FLOOR**2
    fine = (old[..., 3].var(axis=(1, 2)) + new[..., 3].var(axis=(1, 2))).astype(np.float64)
    brighter = (after[..., 0] - before[..., 0]).mean(axis=(1, 2))
    return np.stack(
        [
            0.5 * np.log(pattern),
            0.5 * np.log(tints[0] + tints[1] + TINT_FLOOR**2),
            np.log(np.abs(brighter) + SHIFT_FLOOR),
            0.5 * np.log(rims),
            np.log(rims / (fine + 2 * FINE_FLOOR**2)),
        ],
        axis=1,
    ).astype(np.float64)


def _patterns(one_slice: Columns) -> Columns:
    """(n, pixels, pixels, 4): brightness about its mean, both tints, rims."""
    level = one_slice[..., :1].mean(axis=(1, 2), keepdims=True)
    rims = _fine(one_slice)[..., None]
    return np.concatenate([one_slice[..., :1] - level, one_slice[..., 1:], rims], axis=-1)


def _registered(before: Columns, after: Columns, search: int) -> tuple[Columns, Columns]:
    """Middles of the one, and of the other where they fit best, by the sum of squares."""
    inner = before.shape[1] - 2 * search
    still = np.ascontiguousarray(before[:, search : search + inner, search : search + inner])
    windows = np.moveaxis(sliding_window_view(after, (inner, inner), axis=(1, 2)), 3, -1)
    tried = windows.shape[1:3]
    error = np.empty((*tried, len(after)), dtype=np.float32)  # but for the sum of ``still`` itself
    for at in np.ndindex(tried):
        window = windows[:, *at]
        error[at] = np.einsum("nijc,nijc->n", window, window) - 2 * np.einsum("nijc,nijc->n", window, still)
    best = np.unravel_index(error.reshape(-1, len(after)).argmin(axis=0), tried)
    return still, windows[np.arange(len(after)), *best]


def shadowed(columns: Columns, depth: float, generator: np.random.Generator) -> Columns:
    """The same columns, each with an invented shadow: a soft straight edge somewhere, or all in the shade.

    Args:
        columns: Encoded.
        depth: Of the deepest shadow, natural logarithm.
        generator: Seeded by the caller.
    """
    n, _, pixels = columns.shape[:3]
    middle = (np.arange(pixels) + 0.5) / pixels - 0.5
    angle = generator.uniform(0, 2 * np.pi, (n, 1, 1))
    start = generator.uniform(-0.8, 0.5, (n, 1, 1))
    soft = generator.uniform(0.03, 0.2, (n, 1, 1)) / 4
    dark = generator.uniform(0.1 * depth, depth, (n, 1, 1))
    along = np.cos(angle) * middle + np.sin(angle) * middle[:, None]
    shade = dark / (1 + np.exp(-(along - start) / soft))
    out = columns.copy()
    tint = np.column_stack([np.ones(n), generator.normal(0, TINTED, (n, 2))])
    out -= (shade[:, None, :, :, None] * tint[:, None, None, None]).astype(np.float32)
    return out


def nudged(columns: Columns, reach: int, generator: np.random.Generator) -> Columns:
    """The same columns, each moved by up to ``reach`` pixels either way, as a sleeve moves a piece."""
    out = np.empty_like(columns)
    for k, (down, right) in enumerate(generator.integers(-reach, reach + 1, (len(columns), 2))):
        out[k] = np.roll(columns[k], (down, right), axis=(1, 2))
    return out
