"""Occupancy of the squares from depth."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kempelen.core.camera import Frame
from kempelen.core.geometry import Array
from kempelen.core.senses import EMPTY
from kempelen.sensing.depth.geometry import BoardView, Pixels, depth_of, view_board
from kempelen.sensing.depth.heights import HeightMap, Peaks, board_cells, by_square, find_contrast, find_peaks, map_heights
from kempelen.sensing.depth.likelihood import (
    Evidence,
    depth_parameters,
    estimate,
    occupied_over_empty,
    surely_empty,
)
from kempelen.sensing.depth.reference import EmptyReference
from kempelen.sensing.parameters import Parameters
from kempelen.sensing.sighting import BoardSighting

_CORE = 0.25  # squares from the centre: where holes are counted


@dataclass(frozen=True, slots=True, eq=False)
class DepthReading:
    """Of one frame.

    Attributes:
        log_likelihood: (64, 3) log p(depth seen of the square | empty, white, black); the last two are equal.
        heights: (64,) mm above the board of what stands highest in each square; NaN where nothing is seen.
        offsets: (64, 2) mm, board frame, of it from the square's centre; NaN where nothing stands.
        map: Heights over the plane.
        raised: (8 cells, 8 cells) heights over the empty board.
        peaks: What stands out of each square.
    """

    log_likelihood: Array
    heights: Array
    offsets: Array
    map: HeightMap
    raised: Pixels
    peaks: Peaks


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
    def view(self) -> BoardView | None:
        """How depth pixels lie on the board; None before the first frame."""
        return self._view

    def place(self, frame: Frame, sighting: BoardSighting) -> BoardView:
        """Start anew on a board seen somewhere else.

        Raises:
            CalibrationError: the frame has no depth, or nobody knows how it relates to the colour picture.
            BoardNotFoundError: the depth picture does not show that board.
        """
        view = view_board(frame, sighting)
        if self._reference is None or self._view is None or view.cells != self._view.cells:
            self._reference = EmptyReference(view)
        self._view = view
        return view

    def learn(
        self, frames: Sequence[Frame], sighting: BoardSighting, position: Array | None = None
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
        occupied = None if position is None else np.asarray(position) != EMPTY
        for frame in frames:
            seen, raised, evidence = self._look(frame)
            estimate(evidence, self.parameters, occupied)
            empty = surely_empty(evidence, self.parameters) if occupied is None else ~occupied
            self._known_reference.remember(seen, empty)

    def read(self, frame: Frame, sighting: BoardSighting | None = None) -> DepthReading:
        """Read the squares.

        Args:
            frame: With depth.
            sighting: Of the board, when it is not where it was before.

        Raises:
            CalibrationError: as `place`.
            BoardNotFoundError: as `place`.
        """
        if sighting is not None or self._view is None:
            if sighting is None:
                raise ValueError("read() before the board was placed")
            self.place(frame, sighting)
        seen, raised, evidence = self._look(frame)
        estimate(evidence, self.parameters, None)
        empty, piece = occupied_over_empty(evidence, self.parameters)
        log_likelihood = np.stack([empty, piece, piece], axis=1)
        standing = piece > empty
        offsets = np.where(standing[:, None], evidence.peaks.offsets - self._shift, np.nan)
        return DepthReading(
            log_likelihood - log_likelihood.max(axis=1, keepdims=True),
            evidence.peaks.tops,
            offsets * seen.view.square,
            seen,
            raised,
            evidence.peaks,
        )

    @property
    def _known_reference(self) -> EmptyReference:
        if self._reference is None:
            raise ValueError("place() comes first")
        return self._reference

    @property
    def _shift(self) -> Array:
        return np.array([self.parameters["depth.shift_x"], self.parameters["depth.shift_y"]])

    def _look(self, frame: Frame) -> tuple[HeightMap, Pixels, Evidence]:
        view, reference = self._view, self._known_reference
        if view is None:
            raise ValueError("place() comes first")
        seen = map_heights(view, depth_of(frame))
        raised = reference.subtract(seen)
        board = board_cells(view.cells)
        contrast = find_contrast(raised, seen.counts[board, board], view, reference.noise)
        peaks = find_peaks(contrast, view.cells, self.parameters["depth.slope"], self._shift)
        noise = by_square(reference.local_noise(raised, view.cells), view.cells)
        self.parameters.estimate("depth.noise", reference.noise, "lower side of the board")
        self.parameters.estimate("depth.trust", reference.trust, "slope over the remembered board")
        self.parameters.estimate("depth.dark_step", reference.coefficients[-1], "fit of the board")
        evidence = Evidence(
            peaks, noise[:, view.cells // 2, view.cells // 2].astype(np.float64), missing_share(seen)
        )
        empty = surely_empty(evidence, self.parameters)
        if empty.any():
            slope = contrast.slope(empty, view.cells)
            self.parameters.estimate("depth.slope", slope, f"{empty.sum()} empty squares")
        return seen, raised, evidence


def missing_share(seen: HeightMap) -> Array:
    """(64,) share of the pixels that look at the middle of each square and measured nothing."""
    board = board_cells(seen.view.cells)
    core = _core(seen.view.cells)
    missing = by_square(seen.missing[board, board], seen.view.cells)[:, core].sum(axis=1)
    expected = by_square(seen.view.expected[board, board], seen.view.cells)[:, core].sum(axis=1)
    out: Array = (missing / np.maximum(expected, 1.0)).astype(np.float64)
    return out


def _core(cells: int) -> Array:
    at = (np.arange(cells) + 0.5) / cells - 0.5
    out: Array = np.hypot(*np.meshgrid(at, at)) <= _CORE
    return out
