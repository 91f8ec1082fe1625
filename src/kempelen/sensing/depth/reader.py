"""Occupancy of the squares from depth."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Frame
from kempelen.core.geometry import Array
from kempelen.core.senses import EMPTY
from kempelen.sensing.depth.geometry import BoardView, Mask, Pixels, depth_of, view_board
from kempelen.sensing.depth.heights import (
    Contrast,
    HeightMap,
    board_cells,
    by_square,
    find_contrast,
    find_peaks,
    map_heights,
)
from kempelen.sensing.depth.likelihood import (
    Evidence,
    depth_parameters,
    estimate,
    occupied_over_empty,
    surely_empty,
)
from kempelen.sensing.depth.reference import EmptyReference
from kempelen.sensing.depth.shadow import shadow_heights
from kempelen.sensing.parameters import Parameters
from kempelen.sensing.sighting import DARK, BoardSighting

_MOVED = 0.03  # squares: registration found this far off, the squares are looked for anew
_GRAZING = 3.0  # of the noise: so near to the line of sight over a piece, a point may be of its edge
_CORE = 0.25  # squares from the centre: where holes are counted


@dataclass(frozen=True, slots=True, eq=False)
class DepthLook:
    """What is measured in one frame, before anything is concluded from it.

    Attributes:
        map: Heights over the plane.
        raised: (8 cells, 8 cells) heights over the empty board, mm; NaN where unknown.
        contrast: Their local means.
        evidence: Of each square.
        noise: Of the cells, mm.
    """

    map: HeightMap
    raised: Pixels
    contrast: Contrast
    evidence: Evidence
    noise: float


@dataclass(frozen=True, slots=True, eq=False)
class DepthReading:
    """Of one frame.

    Attributes:
        log_likelihood: (64, 3) log p(depth seen of the square | empty, white, black); the last two are equal.
        heights: (64,) mm above the board of what stands highest in each square; NaN where nothing is seen.
        offsets: (64, 2) mm, board frame, of it from the square's centre; NaN where nothing stands.
    """

    log_likelihood: Array
    heights: Array
    offsets: Array


class DepthReader:
    """Learns an empty board and the noise, and reads squares.

    Args:
        parameters: To be shown and overridden; its own ones without.
    """

    def __init__(self, parameters: Parameters | None = None) -> None:
        self.parameters = depth_parameters() if parameters is None else parameters
        self._view: BoardView | None = None
        self._reference: EmptyReference | None = None

    @property
    def view(self) -> BoardView:
        """How depth pixels lie on the board.

        Raises:
            ValueError: `place` has not been called.
        """
        if self._view is None:
            raise ValueError("the depth reader has not been placed on a board")
        return self._view

    @property
    def reference(self) -> EmptyReference:
        """What is known of the empty board.

        Raises:
            ValueError: `place` has not been called.
        """
        if self._reference is None:
            raise ValueError("the depth reader has not been placed on a board")
        return self._reference

    def place(self, frame: Frame, sighting: BoardSighting) -> BoardView:
        """Look for a board where it was seen; what was learned of an empty one is kept as far as it fits.

        Raises:
            CalibrationError: the frame has no depth, or nobody knows how it relates to the colour picture.
            BoardNotFoundError: the depth picture does not show that board.
        """
        view = view_board(frame, sighting)
        if self._reference is None or self._view is None or view.cells != self._view.cells:
            self._reference = EmptyReference(view)
        self._reference.refit()
        self._view = view
        return view

    def learn(
        self, frames: Sequence[Frame], sighting: BoardSighting, position: npt.ArrayLike | None = None
    ) -> None:
        """Learn the empty board, the noise and the pieces' heights.

        Args:
            frames: Of a board that nobody touches; at least one.
            sighting: Of the board in all of them.
            position: (64,) of {0, 1, 2} what stands there, or None when nobody knows.

        Raises:
            CalibrationError: as `place`.
            BoardNotFoundError: as `place`.
        """
        self.place(frames[0], sighting)
        for frame in frames:
            self.learn_from(self.look(frame), position)

    def read(self, frame: Frame, sighting: BoardSighting | None = None) -> DepthReading:
        """Read the squares.

        Args:
            frame: With depth.
            sighting: Of the board, when it is not where it was before.

        Raises:
            CalibrationError: as `place`.
            BoardNotFoundError: as `place`.
            ValueError: no board was ever placed.
        """
        if sighting is not None:
            self.place(frame, sighting)
        look = self.look(frame)
        before = self._shift
        estimate(look.evidence, self.parameters, None)
        if np.abs(self._shift - before).max() > _MOVED:
            look = self.look(frame)
        return self.judge(look)

    def look(self, frame: Frame) -> DepthLook:
        """Measure a frame of the board where it was placed.

        Raises:
            CalibrationError: no depth, or of another size than its camera's.
        """
        view, reference = self.view, self.reference
        seen = map_heights(view, depth_of(frame))
        raised = reference.subtract(seen)
        board = board_cells(view.cells)
        contrast = find_contrast(raised, seen.counts[board, board], view, reference.noise)
        peaks = find_peaks(contrast, view.cells, self.parameters["depth.slope"], self._shift)
        noise = by_square(reference.local_noise(raised, view.cells), view.cells)
        middle = noise[:, view.cells // 2, view.cells // 2].astype(np.float64)
        hidden = shadow_heights(seen.heights, view)[board, board]
        behind = (hidden > 0) & (raised < hidden + _GRAZING * reference.noise)
        evidence = Evidence(peaks, middle, missing_share(seen), shadowed_share(raised, behind, peaks.scores))
        return DepthLook(seen, raised, contrast, evidence, reference.noise)

    def learn_from(self, look: DepthLook, position: npt.ArrayLike | None = None) -> None:
        """Take in a frame that shows no hand.

        Args:
            look: At it.
            position: (64,) of {0, 1, 2} what stands there; None when nobody knows.
        """
        occupied = None if position is None else np.asarray(position) != EMPTY
        estimate(look.evidence, self.parameters, occupied)
        empty = surely_empty(look.evidence, self.parameters)
        if occupied is not None:
            empty = ~occupied
        self.reference.remember(look.map, empty, certain=occupied is not None)
        self._note(look, empty)

    def adapt(self, look: DepthLook, empty: Mask) -> None:
        """Follow slow changes: squares that are empty for certain, and what the rest of the frame shows.

        Args:
            look: At a frame without a hand.
            empty: (64,) squares that are empty for certain.
        """
        estimate(look.evidence, self.parameters, None)
        self.reference.remember(look.map, empty, certain=False)
        self._note(look, empty)

    def judge(self, look: DepthLook) -> DepthReading:
        """Conclude from what was measured."""
        empty, piece = occupied_over_empty(look.evidence, self.parameters)
        log_likelihood = np.stack([empty, piece, piece], axis=1)
        log_likelihood -= log_likelihood.max(axis=1, keepdims=True)
        standing = piece > empty
        offsets = np.where(standing[:, None], look.evidence.peaks.offsets - self._shift, np.nan)
        # a piece is not as dark as the square under it: it stands as high as if on a light one
        step = np.where(standing & DARK, self.reference.coefficients[-1], 0.0)
        heights = look.evidence.peaks.tops + step
        return DepthReading(log_likelihood, heights, offsets * look.map.view.square)

    def _note(self, look: DepthLook, empty: Mask) -> None:
        reference, parameters = self.reference, self.parameters
        parameters.estimate("depth.noise", reference.noise, "lower side of the board")
        parameters.estimate("depth.trust", reference.trust, "slope over the remembered board")
        parameters.estimate("depth.dark_step", reference.coefficients[-1], "fit of the board")
        if empty.any():
            slope = look.contrast.slope(empty, look.map.view.cells)
            parameters.estimate("depth.slope", slope, f"{empty.sum()} empty squares")

    @property
    def _shift(self) -> Array:
        return np.array([self.parameters["depth.shift_x"], self.parameters["depth.shift_y"]])


def missing_share(seen: HeightMap) -> Array:
    """(64,) share of the pixels that look at the middle of each square and measured nothing."""
    board = board_cells(seen.view.cells)
    core = _core(seen.view.cells)
    missing = by_square(seen.missing[board, board], seen.view.cells)[:, core].sum(axis=1)
    expected = by_square(seen.view.expected[board, board], seen.view.cells)[:, core].sum(axis=1)
    out: Array = (missing / np.maximum(expected, 1.0)).astype(np.float64)
    return out


def shadowed_share(raised: Pixels, behind: Mask, scores: Array) -> Array:
    """(64,) how much of what stands out in each square lies where the camera cannot see.

    Args:
        raised: (8 cells, 8 cells) mm over the empty board.
        behind: (8 cells, 8 cells) whether that is under the line of sight over something else.
        scores: (64,) mm.
    """
    cells = raised.shape[0] // 8
    half = 0.5 * np.nan_to_num(scores, nan=np.inf)[:, None, None]
    excess = np.maximum(by_square(np.nan_to_num(raised, nan=0.0), cells) - half, 0)
    hidden = (excess * by_square(behind.astype(np.float32), cells)).sum(axis=(1, 2))
    out: Array = (hidden / np.maximum(excess.sum(axis=(1, 2)), 1e-6)).astype(np.float64)
    return out


def _core(cells: int) -> Mask:
    at = (np.arange(cells) + 0.5) / cells - 0.5
    out: Mask = np.hypot(*np.meshgrid(at, at)) <= _CORE
    return out
