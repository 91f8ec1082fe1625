"""What a column looks like, and how much it changed, in a few numbers."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.sensing.colour.columns import Columns

SPREAD_FLOOR = 0.03  # natural logarithms of light: what noise and dirt do to an even surface
EDGE_FLOOR = 0.02
CHANGE_FLOOR = 0.02
TINT_FLOOR = 0.01
SHIFT_FLOOR = 0.05
TINTED = 0.15  # standard deviation of a shadow's tint as a share of its depth: lamp against window
SEARCH = 1  # pixels that two columns may be out of register: a sixteenth of a square


def looks(columns: Columns, radii: Sequence[float]) -> Array:
    """(n, 5 * slices): of each slice's disc brightness, both tints, spread and edges.

    Args:
        columns: Encoded, (n, slices, pixels, pixels, 3).
        radii: Of the discs, squares.
    """
    across = np.diff(columns, axis=3)[:, :, 1:]
    along = np.diff(columns, axis=2)[:, :, :, 1:]
    edges = np.sqrt((across * across + along * along).sum(axis=-1))
    out = []
    for k, radius in enumerate(radii):
        disc = _disc(columns.shape[2], radius)
        inside = columns[:, k][:, disc]
        out += list(inside.mean(axis=1).T)
        out.append(np.log(inside[..., 0].std(axis=1) + SPREAD_FLOOR))
        out.append(np.log(edges[:, k][:, disc[1:, 1:]].mean(axis=1) + EDGE_FLOOR))
    return np.stack(out, axis=1).astype(np.float64)


def _disc(pixels: int, radius: float) -> npt.NDArray[np.bool_]:
    middle = (np.arange(pixels) + 0.5) / pixels - 0.5
    out: npt.NDArray[np.bool_] = np.hypot(middle[None], middle[:, None]) < radius
    return out


def changes(before: Columns, after: Columns) -> Array:
    """(n, 4 * slices): of each slice how the pattern, the tint and the brightness changed, and how much of
    the pattern that is.

    The brightness of the whole slice is taken out of the pattern: a shadow is not a move. Columns that are
    a little out of register are moved to where they fit best.
    """
    return np.concatenate([_slice_changes(before[:, k], after[:, k]) for k in range(before.shape[1])], axis=1)


def _slice_changes(before: Columns, after: Columns) -> Array:
    inner = before.shape[1] - 2 * SEARCH
    still = before[:, SEARCH : SEARCH + inner, SEARCH : SEARCH + inner]
    tried = [
        _difference(still, after[:, dy : dy + inner, dx : dx + inner])
        for dy in range(2 * SEARCH + 1)
        for dx in range(2 * SEARCH + 1)
    ]
    stacked = np.stack(tried)
    best = (stacked[..., 0] + stacked[..., 1]).argmin(axis=0)
    pattern, tint, shift, own = stacked[best, np.arange(len(before))].T
    pattern = pattern + CHANGE_FLOOR**2
    return np.stack(
        [
            0.5 * np.log(pattern),
            0.5 * np.log(tint + TINT_FLOOR**2),
            np.log(np.abs(shift) + SHIFT_FLOOR),
            np.log(pattern / (own + 2 * CHANGE_FLOOR**2)),
        ],
        axis=1,
    ).astype(np.float64)


def _difference(before: Columns, after: Columns) -> Columns:
    """(n, 4): mean square change of pattern and tint, change of brightness, both patterns' own variance."""
    off = after - before
    shift = off[..., 0].mean(axis=(1, 2))
    pattern = (off[..., 0] ** 2).mean(axis=(1, 2)) - shift**2
    tint = (off[..., 1:] ** 2).mean(axis=(1, 2)).sum(axis=-1)
    own = before[..., 0].var(axis=(1, 2)) + after[..., 0].var(axis=(1, 2))
    return np.stack([np.maximum(pattern, 0), tint, shift, own], axis=1)


def shadowed(columns: Columns, depth: float, generator: np.random.Generator) -> Columns:
    """The same columns, each with an invented shadow: a soft straight edge somewhere, or all in the shade.

    Args:
        columns: Encoded.
        depth: Of the deepest shadow, natural logarithm.
        generator: Seeded by the caller.
    """
    n, _, pixels = columns.shape[:3]
    middle = (np.arange(pixels) + 0.5) / pixels - 0.5
    angle = generator.uniform(0, 2 * np.pi, n)
    start = generator.uniform(-0.8, 0.5, n)
    soft = generator.uniform(0.03, 0.2, n) / 4
    dark = generator.uniform(0.1 * depth, depth, n)
    along = np.cos(angle)[:, None, None] * middle + np.sin(angle)[:, None, None] * middle[:, None]
    shade = dark[:, None, None] / (1 + np.exp(-(along - start[:, None, None]) / soft[:, None, None]))
    out = columns.copy()
    tint = np.column_stack([np.ones(n), generator.normal(0, TINTED, (n, 2))])
    out -= (shade[:, None, :, :, None] * tint[:, None, None, None]).astype(np.float32)
    return out
