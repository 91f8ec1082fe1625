"""A map of the heights over the board, and what stands out of it in each square."""

from dataclasses import dataclass

import cv2
import numpy as np

from kempelen.core.geometry import Array
from kempelen.sensing.depth.geometry import MARGIN, BoardView, Pixels

DISC = 0.19
"""Radius, squares, of what a piece is looked for with: the head of a pawn on a square of its size."""

REACH = 0.25
"""How far from a square's centre, squares, the disc's centre is tried: with its radius it stays inside."""

_FILLED = 0.35  # of the pixels expected in a disc: with fewer its mean is one of flying pixels
_LOWEST = -25.0  # mm: what lies deeper is a hole of the measurement


@dataclass(frozen=True, slots=True, eq=False)
class HeightMap:
    """Heights over the board plane in a grid of cells, margins included.

    Attributes:
        heights: (size, size) mean height of the points in each cell, mm; NaN without a point. Row 0 lies
            below rank 1, column 0 to the left of the a file.
        counts: (size, size) points.
        missing: (size, size) pixels that look at the cell's bare place and measured nothing.
        view: The geometry that it was made with.
    """

    heights: Pixels
    counts: Pixels
    missing: Pixels
    view: BoardView

    @property
    def board(self) -> slice:
        """The cells of the board along either axis."""
        return board_cells(self.view.cells)

    def cell_centres(self) -> tuple[Array, Array]:
        """Board coordinates x and y, squares, of the rows and columns' cells."""
        at = (np.arange(self.view.size) + 0.5) / self.view.cells - MARGIN
        return at, at


def board_cells(cells: int) -> slice:
    """The cells of the board along either axis, of a grid with so many cells a square."""
    start = round(MARGIN * cells)
    return slice(start, start + 8 * cells)


def map_heights(view: BoardView, depth: Pixels) -> HeightMap:
    """Collect a depth picture's points where they are in space, seen from straight above."""
    window = view.crop(depth)
    index, height = view.cell_of(window)
    flat = index.ravel()
    counts = view.count(flat)
    total = view.count(flat, height.ravel())
    with np.errstate(invalid="ignore", divide="ignore"):
        heights = total / counts
    missing = view.count(view.bare[window <= 0])
    return HeightMap(heights.astype(np.float32), counts, missing, view)


def by_square(grid: Pixels, cells: int) -> Pixels:
    """(64, cells, cells) squares in python-chess order of an (8 cells, 8 cells) grid."""
    blocks = grid.reshape(8, cells, 8, cells).transpose(0, 2, 1, 3)
    return blocks.reshape(64, cells, cells)


@dataclass(frozen=True, slots=True, eq=False)
class Peaks:
    """What stands highest in each square, by the mean over a disc that is moved about in it.

    Attributes:
        scores: (64,) mm, the largest mean; NaN where too little is seen.
        mirror: (64,) mm, the same of the map turned upside down: what noise alone does.
        offsets: (64, 2) squares, from the square's centre to the disc's, refined to parts of a cell.
        seen: (64,) share of the expected points that were measured in the middle of the square.
        tops: (64,) mm, the highest mean over a third of the disc's area.
    """

    scores: Array
    mirror: Array
    offsets: Array
    seen: Array
    tops: Array


def find_peaks(heights: Pixels, counts: Pixels, view: BoardView, shift: Array) -> Peaks:
    """Move the disc about in each square.

    Args:
        heights: (8 cells, 8 cells) of the board alone, over the reference, mm; NaN where unknown.
        counts: As many points.
        view: Gives the expected counts.
        shift: (2,) squares, by which everything appears displaced.
    """
    cells = view.cells
    board = board_cells(cells)
    disc = _disc(DISC * cells)
    known = ~np.isnan(heights)
    weights = np.where(known, np.minimum(counts, 2 * view.expected[board, board] + 1), 0).astype(np.float32)
    kept = np.where(known, np.maximum(heights, _LOWEST), 0).astype(np.float32) * weights
    expected = _sum(view.expected[board, board], disc)
    amount = _sum(weights, disc)
    enough = amount >= _FILLED * np.maximum(expected, 1.0)
    mean = np.where(enough, _sum(kept, disc) / np.maximum(amount, 1e-6), np.nan)
    window = _window(cells, shift)
    scores, offsets = _highest(mean, window, cells)
    mirror, _ = _highest(-mean, window, cells)
    small = _disc(DISC * cells / np.sqrt(3.0))
    little = _sum(weights, small)
    some = little >= _FILLED * np.maximum(_sum(view.expected[board, board], small), 1.0)
    tops, _ = _highest(np.where(some, _sum(kept, small) / np.maximum(little, 1e-6), np.nan), window, cells)
    seen = by_square(np.minimum(amount / np.maximum(expected, 1e-6), 1.0), cells)
    return Peaks(scores, mirror, offsets, seen[:, cells // 2, cells // 2].astype(np.float64), tops)


def _disc(radius: float) -> Pixels:
    """A disc with a soft edge, at least one cell."""
    reach = max(int(np.ceil(radius)), 1)
    at = np.arange(-reach, reach + 1)
    distance = np.hypot(*np.meshgrid(at, at))
    return np.clip(radius + 0.5 - distance, 0, 1).astype(np.float32)


def _sum(grid: Pixels, kernel: Pixels) -> Pixels:
    return cv2.filter2D(grid, -1, kernel, borderType=cv2.BORDER_CONSTANT).astype(np.float32, copy=False)


def _window(cells: int, shift: Array) -> Pixels:
    """(cells, cells, 2) offsets of a square's cells from where its centre appears; NaN out of reach."""
    at = (np.arange(cells) + 0.5) / cells - 0.5
    offsets = np.stack(np.meshgrid(at, at), -1)
    far = np.abs(offsets - shift).max(axis=-1) > REACH
    offsets[far] = np.nan
    return offsets.astype(np.float32)


def _highest(mean: Pixels, window: Pixels, cells: int) -> tuple[Array, Array]:
    """(64,) largest value within reach, NaN without one, and (64, 2) where it is."""
    allowed = ~np.isnan(window[..., 0]).ravel()
    values = by_square(mean, cells).reshape(64, -1)[:, allowed]
    places = window.reshape(-1, 2)[allowed]
    blind = np.isnan(values)
    filled = np.where(blind, -np.inf, values)
    best = filled.argmax(axis=1)
    rows = np.arange(64)
    scores = filled[rows, best].astype(np.float64)
    offsets = places[best].astype(np.float64)
    nothing = blind.all(axis=1)
    scores[nothing] = np.nan
    offsets[nothing] = np.nan
    return scores, offsets
