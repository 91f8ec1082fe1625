"""A map of the heights over the board, and what stands out of it in each square."""

from dataclasses import dataclass

import cv2
import numpy as np

from kempelen.core.geometry import Array
from kempelen.sensing.depth.geometry import MARGIN, BoardView, Mask, Pixels

DISC = 0.19
"""Radius, squares, of what a piece is looked for with: the head of a pawn on a square of its size."""

REACH = 0.25
"""How far from a square's centre, squares, the disc's centre is tried: with its radius it stays inside."""

_RING = (0.3, 0.5)
"""Inner and outer radius, squares, of the surroundings that the disc is compared with."""

_CAP = 2.0  # of the noise: higher things in the surroundings are neighbours, no sign of their level
_FILLED = 0.35  # of the pixels expected in a disc: with fewer its mean is one of flying pixels
_ALIKE = 25.0  # mm: from pixel to pixel no surface of a piece falls by more, seen at 30 degrees or steeper
_NEIGHBOURS = 3  # of eight: what a pixel at the corner of a surface has
_LOWEST = -25.0  # mm: what lies deeper is a hole of the measurement


@dataclass(frozen=True, slots=True, eq=False)
class HeightMap:
    """Heights over the board plane in a grid of cells, margins included.

    Attributes:
        heights: (size, size) mean height of the points in each cell, mm; NaN without a point. Row 0 lies
            below rank 1, column 0 to the left of the a file.
        counts: (size, size) points.
        missing: (size, size) pixels that look at the cell's bare place and measured nothing.
        window: (h, w) mm, the depth that it was made of: 0 where none was measured or no neighbour agrees.
        view: The geometry that it was made with.
    """

    heights: Pixels
    counts: Pixels
    missing: Pixels
    window: Pixels
    view: BoardView

    @property
    def board(self) -> slice:
        """The cells of the board along either axis."""
        return board_cells(self.view.cells)


def board_cells(cells: int) -> slice:
    """The cells of the board along either axis, of a grid with so many cells a square."""
    start = round(MARGIN * cells)
    return slice(start, start + 8 * cells)


def map_heights(view: BoardView, depth: Pixels) -> HeightMap:
    """Collect a depth picture's points where they are in space, seen from straight above."""
    window = np.nan_to_num(view.crop(depth), nan=0.0, posinf=0.0, neginf=0.0)
    missing = view.count(view.bare[window <= 0])
    window = np.where(supported(window), window, 0).astype(np.float32)
    index, height = view.cell_of(window)
    flat = index.ravel()
    counts = view.count(flat)
    total = view.count(flat, height.ravel())
    with np.errstate(invalid="ignore", divide="ignore"):
        heights = total / counts
    return HeightMap(heights.astype(np.float32), counts, missing, window, view)


def supported(depth: Pixels) -> Mask:
    """(h, w) which pixels have neighbours at about their depth: one that mixes two surfaces has none.

    Args:
        depth: (h, w) mm, 0 where nothing was measured.
    """
    padded = np.pad(depth, 1)
    height, width = depth.shape
    count = np.zeros(depth.shape, np.uint8)
    for row in range(3):
        for column in range(3):
            if (row, column) != (1, 1):
                count += np.abs(padded[row : row + height, column : column + width] - depth) < _ALIKE
    out: Mask = (count >= _NEIGHBOURS) & (depth > 0)
    return out


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
        offsets: (64, 2) squares, from the square's centre to the disc's, a centroid.
        seen: (64,) share of the expected points that were measured in the middle of the square.
        tops: (64,) mm, the highest mean over a third of the disc's area.
    """

    scores: Array
    mirror: Array
    offsets: Array
    seen: Array
    tops: Array


@dataclass(frozen=True, slots=True, eq=False)
class Contrast:
    """Local means of the board's heights, each (8 cells, 8 cells) mm; NaN where too little was measured.

    Attributes:
        disc: Of the disc about each cell.
        ring: Of its surroundings, neighbouring pieces cut off.
        top: Of a third of the disc.
        seen: Share of the disc's expected points that were measured, 0 to 1.
    """

    disc: Pixels
    ring: Pixels
    top: Pixels
    seen: Pixels

    def over_ring(self, slope: float) -> Pixels:
        """The disc over what its surroundings predict of it."""
        level = np.nan_to_num(self.ring, nan=0.0)
        return (self.disc - np.float32(slope) * level).astype(np.float32, copy=False)

    def slope(self, empty: Mask, cells: int) -> float:
        """How much of the surroundings' level the disc shares where nothing stands, 0 to 1.

        Blotches wider than a piece raise both, white noise only one of them.

        Args:
            empty: (64,) squares that are taken for empty.
            cells: Along a side of a square.
        """
        disc, ring = by_square(self.disc, cells)[empty], by_square(self.ring, cells)[empty]
        known = ~(np.isnan(disc) | np.isnan(ring))
        disc, ring = disc[known], ring[known]
        energy = float((ring**2).sum())
        return float(np.clip((disc * ring).sum() / energy, 0, 1)) if energy > 0 else 0.0


def find_contrast(heights: Pixels, counts: Pixels, view: BoardView, noise: float) -> Contrast:
    """Local means.

    Args:
        heights: (8 cells, 8 cells) of the board alone, over the reference, mm; NaN where unknown.
        counts: As many points.
        view: Gives the expected counts.
        noise: Of the cells, mm.
    """
    board = board_cells(view.cells)
    usual = view.expected[board, board]
    known = ~np.isnan(heights)
    weights = np.where(known, np.minimum(counts, 2 * usual + 1), 0).astype(np.float32)
    kept = np.where(known, np.maximum(heights, _LOWEST), 0).astype(np.float32)
    disc, seen = _local_mean(kept, weights, usual, _disc(DISC * view.cells))
    top, _ = _local_mean(kept, weights, usual, _disc(DISC * view.cells / np.sqrt(3.0)))
    inner, outer = (_disc(radius * view.cells) for radius in _RING)
    edge = (outer.shape[0] - inner.shape[0]) // 2
    ring = outer - np.pad(inner, edge)
    around, _ = _local_mean(np.minimum(kept, _CAP * noise), weights, usual, ring)
    return Contrast(disc, around, top, seen)


def find_peaks(contrast: Contrast, cells: int, slope: float, shift: Array) -> Peaks:
    """Move the disc about in each square.

    Args:
        contrast: Of the board.
        cells: Along a side of a square.
        slope: How much of its surroundings' level the disc shares.
        shift: (2,) squares, by which everything appears displaced.
    """
    over = contrast.over_ring(slope)
    window = _window(cells, shift)
    scores = _highest(over, window, cells)
    offsets = _centroids(over, cells, scores, window)
    mirror = _highest(-over, window, cells)
    tops = _highest(contrast.top, window, cells)
    seen = by_square(contrast.seen, cells)[:, cells // 2, cells // 2].astype(np.float64)
    return Peaks(scores, mirror, offsets, seen, tops)


def _local_mean(kept: Pixels, weights: Pixels, usual: Pixels, kernel: Pixels) -> tuple[Pixels, Pixels]:
    """Weighted mean under a kernel, NaN where too little was measured, and the share that was."""
    amount, expected = _sum(weights, kernel), _sum(usual, kernel)
    share = amount / np.maximum(expected, 1.0)
    mean = np.where(share >= _FILLED, _sum(kept * weights, kernel) / np.maximum(amount, 1e-6), np.nan)
    return mean.astype(np.float32), np.minimum(share, 1.0)


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


def _highest(mean: Pixels, window: Pixels, cells: int) -> Array:
    """(64,) largest value within reach of each square's centre; NaN without one."""
    allowed = ~np.isnan(window[..., 0]).ravel()
    values = by_square(mean, cells).reshape(64, -1)[:, allowed]
    highest = np.where(np.isnan(values), -np.inf, values).max(axis=1)
    return np.where(np.isfinite(highest), highest, np.nan).astype(np.float64)


def _centroids(over: Pixels, cells: int, scores: Array, window: Pixels) -> Array:
    """(64, 2) squares, of what rises above half of each square's score within reach; NaN without a score."""
    values = np.nan_to_num(by_square(over, cells), nan=0.0)
    allowed = ~np.isnan(window[..., 0])
    excess = np.maximum(values - 0.5 * np.nan_to_num(scores, nan=np.inf)[:, None, None], 0.0) * allowed
    amount = excess.sum(axis=(1, 2))
    with np.errstate(invalid="ignore", divide="ignore"):
        middle = np.einsum("sij,ijk->sk", excess, np.nan_to_num(window, nan=0.0)) / amount[:, None]
    out: Array = middle.astype(np.float64)
    return out
