"""Which eight rows and columns of a lattice are the board.

Every placement of an 8 x 8 window on the lattice is scored by the log-likelihood of what is seen, against the
lattice going on without a pattern: the 112 edges between squares of the board, the 32 at its border, the 49
points where corners should be. A piece that hides an edge costs little, a row that is none costs much; so a
row that no corner was found in is still told from the rim by the alternation of its squares.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.sensing.board.contrast import Contrasts
from kempelen.sensing.board.lattice import Indices, window_sums

ROWS = 8
GRID = np.stack(np.meshgrid(np.arange(ROWS + 1.0), np.arange(ROWS + 1.0)), axis=-1).reshape(-1, 2)
"""(81, 2) squares: where squares meet, the board's edge included; row by row."""
_BEYOND = 1  # squares looked at on each side of what may be the board: where it must have ended

# Densities of a contrast, mixtures of (weight, mean, deviation) fitted by expectation maximisation to
# labelled photos and rounded, the narrowest widened for noisier cameras: two thirds of the edges inside
# show 1, the rest is partly hidden; at the border every other edge shows the rim's difference; outside
# there is nothing, or clutter.
_INSIDE = ((0.65, 1.02, 0.15), (0.35, 0.55, 0.5))
_BORDER = ((0.25, 0.0, 0.1), (0.3, 0.98, 0.15), (0.45, 0.2, 0.55))
_OUTSIDE = ((0.7, 0.0, 0.12), (0.3, 0.0, 0.5))
_CORNER_INSIDE, _CORNER_OUTSIDE = 0.8, 0.04  # share of lattice points at which a corner is seen
_DEPENDENCE = 0.25  # of the evidence counts: one piece or one shadow touches several edges at a time
# A camera is pointed at a board so that the board is in view: each square out of it makes a window less
# likely by that factor's logarithm, a row of them by e squared.
_UNSEEN = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A window and how sure it is.

    Attributes:
        origin: (2,) the lattice point that is the board's outer corner.
        probability: Of this window among all windows.
        evidence: Log-likelihood ratio of a board here against none, discounted for dependence.
        rows: (8,) of the same, by rows of squares: negative where a row shows no pattern.
        columns: (8,) by columns.
        seen: (8, 8) whether a square's middle is in the picture.
    """

    origin: Indices
    probability: float
    evidence: float
    rows: Array
    columns: Array
    seen: npt.NDArray[np.bool_]


def block_around(indices: Indices) -> tuple[Indices, tuple[int, int]]:
    """First lattice point and size (columns, rows) of all squares that the board may cover.

    Args:
        indices: (n, 2) lattice points at which a corner was seen, within 7 rows and columns.
    """
    low = indices.max(axis=0) - ROWS - _BEYOND
    high = indices.min(axis=0) + ROWS + _BEYOND
    columns, rows = (high - low).tolist()
    return low, (columns, rows)


def place_board(contrasts: Contrasts, indices: Indices) -> Placement:
    """The best window.

    Args:
        contrasts: Of the block from :func:`block_around`.
        indices: (n, 2) lattice points at which a corner was seen.
    """
    inside_across, border_across = _ratios(contrasts.across)
    inside_down, border_down = _ratios(contrasts.down)
    corner = _corner_ratios(contrasts, indices)
    scores = (
        window_sums(inside_across[:, 1:-1], ROWS, ROWS - 1)
        + window_sums(inside_down[1:-1], ROWS - 1, ROWS)
        + window_sums(corner, ROWS - 1, ROWS - 1)
    )
    sides, ends = window_sums(border_across, ROWS, 1), window_sums(border_down, 1, ROWS)
    scores += sides[:, :-ROWS] + sides[:, ROWS:] + ends[:-ROWS] + ends[ROWS:]
    scores = _DEPENDENCE * scores - _UNSEEN * window_sums((~contrasts.seen).astype(np.float64), ROWS, ROWS)
    row, column = np.unravel_index(int(np.argmax(scores)), scores.shape)
    best = float(scores[row, column])
    window = slice(row, row + ROWS), slice(column, column + ROWS)
    rows, columns = _by_line(inside_across, inside_down, int(row), int(column))
    return Placement(
        contrasts.origin + np.array([column, row]),
        float(1 / np.exp(scores - best).sum()),
        best,
        rows * _DEPENDENCE,
        columns * _DEPENDENCE,
        contrasts.seen[window],
    )


def _ratios(contrast: Array) -> tuple[Array, Array]:
    """Log-likelihood ratios inside : outside and border : outside of each edge; 0 where nothing is known.

    The places along an edge show the same edge: their mean counts, not their sum.
    """
    known = np.isfinite(contrast)
    value = np.where(known, contrast, 0.0)
    outside = _density(value, _OUTSIDE)
    inside = np.where(known, np.log(_density(value, _INSIDE) / outside), 0.0)
    border = np.where(known, np.log(_density(value, _BORDER) / outside), 0.0)
    return inside.mean(axis=-1), border.mean(axis=-1)


def _density(value: Array, mixture: tuple[tuple[float, float, float], ...]) -> Array:
    total: Array = np.full(value.shape, 1e-3)  # nothing is impossible
    for weight, mean, deviation in mixture:
        total = total + weight / deviation * np.exp(-0.5 * ((value - mean) / deviation) ** 2)
    return total


def _corner_ratios(contrasts: Contrasts, indices: Indices) -> Array:
    """(rows - 1, columns - 1) for the block's inner lattice points; 0 beside squares off the picture."""
    seen = contrasts.seen
    visible = seen[1:, 1:] & seen[:-1, 1:] & seen[1:, :-1] & seen[:-1, :-1]
    found = np.zeros(visible.shape, dtype=bool)
    place = indices - contrasts.origin - 1
    usable = ((place >= 0) & (place < visible.shape[::-1])).all(axis=1)
    found[place[usable, 1], place[usable, 0]] = True
    hit = np.log(_CORNER_INSIDE / _CORNER_OUTSIDE)
    miss = np.log((1 - _CORNER_INSIDE) / (1 - _CORNER_OUTSIDE))
    out: Array = np.where(found, hit, np.where(visible, miss, 0.0))
    return out


def _by_line(across: Array, down: Array, row: int, column: int) -> tuple[Array, Array]:
    """What the edges inside the board say by rows and by columns of squares."""
    a = across[row : row + ROWS, column + 1 : column + ROWS]
    d = down[row + 1 : row + ROWS, column : column + ROWS]
    rows, columns = a.sum(axis=1), d.sum(axis=0)
    rows[:-1] += d.sum(axis=1) / 2
    rows[1:] += d.sum(axis=1) / 2
    columns[:-1] += a.sum(axis=0) / 2
    columns[1:] += a.sum(axis=0) / 2
    return rows, columns
