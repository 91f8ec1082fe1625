"""The thesis's way of reading depth, to compare with: points are counted above fixed heights."""

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.sensing.depth.geometry import BoardView, Pixels
from kempelen.sensing.depth.heights import board_cells, by_square

PIECE_ABOVE = 10.0
"""mm over the board's plane from which a point counts for a piece."""

PIECE_POINTS = 2
"""Points that make a piece."""


def thesis_counts(view: BoardView, depth: Pixels) -> Array:
    """(64,) points above 10 mm in each square of the whole depth picture."""
    window = view.crop(depth)
    index, height = view.cell_of(window)
    counts = view.count(np.where(height > PIECE_ABOVE, index, -1).ravel())
    board = board_cells(view.cells)
    out: Array = by_square(counts[board, board], view.cells).sum(axis=(1, 2)).astype(np.float64)
    return out


def thesis_occupied(view: BoardView, depth: Pixels) -> npt.NDArray[np.bool_]:
    """(64,) which squares hold a piece by that rule."""
    out: npt.NDArray[np.bool_] = thesis_counts(view, depth) >= PIECE_POINTS
    return out
