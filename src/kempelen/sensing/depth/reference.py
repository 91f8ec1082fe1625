"""What an empty board looks like to the depth camera: tilt, bow, darker squares, and its lasting blotches."""

import cv2
import numpy as np

from kempelen.core.geometry import Array
from kempelen.sensing.depth.geometry import BoardView, Mask, Pixels
from kempelen.sensing.depth.heights import HeightMap, board_cells

_MAD = 1.4826  # of a normal distribution: sigma over median absolute deviation
_SPREADS = np.array([20.0, 4.0, 4.0, 2.0, 2.0, 2.0, 6.0])
"""mm: prior standard deviations of level, two tilts, three bows, and of a dark square over a light one."""

_BLOTCH = 10.0  # cells that err together: what a stereo matcher or a lens smooths over
_FIRST_STEPS = 15
_STEPS = 2
_LEAST_NOISE = 0.3  # mm
_CLIP = 3.0  # of noise: what lies further out is no trait of the board, as far as is known
_HIGHEST_BLOTCH = 15.0  # mm: beyond it lie holes of the measurement
_MEMORY = 60.0  # frames
_HOLE = 3.0  # of noise: a place without measurement counts as so wrong


class EmptyReference:
    """Learns the empty board from frames in which pieces stand on some of it, known or not.

    A smooth surface with a step for dark squares is fitted to each frame, one-sided: pieces stand above it.
    What remains of it over time is kept for each cell; how much of that is trusted is found in each frame,
    by the slope of the frame's own remainder over the remembered one. A reference of other days or another
    place then counts for nothing, without anybody saying so.

    Args:
        view: Of the board.
    """

    def __init__(self, view: BoardView) -> None:
        self._board = board_cells(view.cells)
        self._design = _design(view)
        self._coefficients = np.zeros(self._design.shape[1])
        self._fitted = False
        self._total = np.zeros((8 * view.cells, 8 * view.cells), np.float32)
        self._evidence = np.zeros_like(self._total)
        self.noise = 2.0
        self.trust = 0.0

    @property
    def coefficients(self) -> Array:
        """(7,) mm: level, tilts, bows, and how much higher dark squares read than light ones."""
        return self._coefficients.copy()

    @property
    def surface(self) -> Pixels:
        """(8 cells, 8 cells) mm: the smooth part."""
        side = self._total.shape[0]
        return (self._design @ self._coefficients).astype(np.float32).reshape(side, side)

    @property
    def blotches(self) -> Pixels:
        """(8 cells, 8 cells) mm: the mean remainder of each cell; 0 where it was never seen empty."""
        return (self._total / np.maximum(self._evidence, 1.0)).astype(np.float32)

    def refit(self) -> None:
        """The plane was measured anew: the smooth part has to be fitted from the start."""
        self._fitted = False

    def subtract(self, seen: HeightMap) -> Pixels:
        """(8 cells, 8 cells) heights of the board's cells over the empty board, mm; NaN where unknown."""
        heights = seen.heights[self._board, self._board]
        self._fit(heights)
        remainder = heights - self.surface
        blotches = self.blotches
        self.trust = _slope(remainder, blotches, self._evidence > 0, self.noise)
        return (remainder - np.float32(self.trust) * blotches).astype(np.float32)

    def remember(self, seen: HeightMap, empty: Mask, *, certain: bool = True) -> None:
        """Take the squares that are empty for certain into the reference.

        Args:
            seen: A frame that `subtract` has been given.
            empty: (64,) whether each square is.
            certain: Whether that was told, not read: then blotches of any height are the board's.
        """
        remainder = seen.heights[self._board, self._board] - self.surface
        cells = seen.view.cells
        bare = np.kron(empty.reshape(8, 8), np.ones((cells, cells))).astype(bool) & ~np.isnan(remainder)
        limit = _HIGHEST_BLOTCH if certain else _CLIP * self.noise
        self._total[bare] += np.clip(remainder[bare], -limit, limit)
        self._evidence[bare] += 1
        ageing = self._evidence > _MEMORY
        self._total[ageing] *= _MEMORY / self._evidence[ageing]
        self._evidence[ageing] = _MEMORY

    def local_noise(self, remainder: Pixels, cells: int) -> Pixels:
        """(8 cells, 8 cells) scatter about each place, mm, from what lies below the board, and from holes.

        Pieces only ever raise the surface, so that the lower side shows the noise alone.
        """
        below = np.where(np.isnan(remainder), _HOLE * self.noise, np.minimum(remainder, 0)).astype(np.float32)
        used = (np.isnan(remainder) | (remainder < 0)).astype(np.float32)
        reach = 2 * cells + 1
        squares = cv2.boxFilter(below**2, -1, (reach, reach), normalize=False, borderType=cv2.BORDER_CONSTANT)
        amount = cv2.boxFilter(used, -1, (reach, reach), normalize=False, borderType=cv2.BORDER_CONSTANT)
        prior = cells * cells  # as strong as one square
        scatter: Pixels = np.sqrt((squares + prior * self.noise**2) / (amount + prior)).astype(np.float32)
        return scatter

    def _fit(self, heights: Pixels) -> None:
        known = ~np.isnan(heights.ravel())
        design = self._design[known]
        wanted = heights.ravel()[known].astype(np.float64)
        if len(wanted) <= len(_SPREADS):
            return
        if not self._fitted:
            self._coefficients[:] = 0.0
            self._coefficients[0] = np.median(wanted)
        for _ in range(_STEPS if self._fitted else _FIRST_STEPS):
            self._step(design, wanted)
        self._fitted = True

    def _step(self, design: Array, wanted: Array) -> None:
        remainder = wanted - design @ self._coefficients
        below = remainder[remainder < 0]
        if len(below):
            self.noise = max(_MAD * float(np.median(-below)), _LEAST_NOISE)
        away = remainder / (2 * self.noise)
        weights = (1 + away**2) ** -np.where(away > 0, 2.0, 1.0)
        weighted = design * weights[:, None]
        prior = np.diag(_BLOTCH * self.noise**2 / _SPREADS**2)
        solved = np.linalg.solve(design.T @ weighted + prior, weighted.T @ wanted)
        self._coefficients[:] = solved


def _design(view: BoardView) -> Array:
    """(cells, 7) of a surface of second degree with a step for dark squares."""
    at = (np.arange(8 * view.cells) + 0.5) / view.cells
    x, y = (axis.ravel() for axis in np.meshgrid(at, at))
    dark = (np.floor(x) + np.floor(y)) % 2 == 0
    u, v = x / 4 - 1, y / 4 - 1
    return np.stack([np.ones_like(u), u, v, u * u, u * v, v * v, np.where(dark, 0.5, -0.5)], -1)


def _slope(remainder: Pixels, blotches: Pixels, known: Mask, noise: float) -> float:
    """How much of the remembered remainder shows again, 0 to 1."""
    off = np.minimum(np.abs(remainder), np.abs(remainder - blotches))
    alike = known & (off < _CLIP * noise)  # or else something stands there
    energy = float((blotches[alike] ** 2).sum())
    if energy <= 0:
        return 0.0
    shared = float((blotches[alike] * remainder[alike]).sum())
    return float(np.clip(shared / (energy + _BLOTCH * noise**2), 0, 1))
