"""Whether a hand, or the robot, is over the board, from depth."""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.sensing.depth.geometry import MARGIN, BoardView, Mask, Pixels
from kempelen.sensing.depth.heights import Contrast, HeightMap
from kempelen.sensing.parameters import Parameter, Parameters

_BESIDE = 0.5  # squares around the board over which nothing may be high
_RAISED = 4.0  # of the noise
_HIDDEN = 0.3  # of the expected points measured: with less a place is not seen
_PAUSE = 0.5  # s: frames further apart than this say nothing about motion


def gate_parameters() -> Parameters:
    """As they are before anything was seen."""
    return Parameters(
        Parameter("hand.above", 118.0, "mm", 60, 250, "higher than any piece stands"),
        Parameter("hand.high_area", 0.2, "squares", 0.01, 10, "as much of that is a hand"),
        Parameter("hand.low", 14.0, "mm", 5, 60, "what stands up from the board or the table"),
        Parameter("hand.low_area", 1.2, "squares", 0.2, 20, "as much, new and reaching in from outside"),
        Parameter("hand.big_area", 4.0, "squares", 1, 40, "as much, new, wherever it is"),
        Parameter("hand.moving_area", 0.25, "squares", 0.05, 10, "as much that changed since the last frame"),
        Parameter("hand.rest", 0.7, "s", 0.05, 30, "what rests so long in clear frames belongs there"),
        Parameter("hand.hidden", 10.0, "squares", 2, 64, "so many squares hidden that were seen before"),
    )


@dataclass(frozen=True, slots=True, eq=False)
class GateReading:
    """Of one frame.

    Attributes:
        hand: Whether something is over the board that is no standing piece.
        reason: What was seen, one phrase; empty when nothing was.
        mask: (size, size) cells of the map that belong to it.
    """

    hand: bool
    reason: str
    mask: Mask


class DepthGate:
    """Four signs, each enough: something high; something new that reaches in; motion; squares hidden.

    Args:
        parameters: To be shown and overridden; its own ones without.
    """

    def __init__(self, parameters: Parameters | None = None) -> None:
        self.parameters = gate_parameters() if parameters is None else parameters
        self._rested: Pixels | None = None  # s that each cell has been raised in clear frames
        self._accepted = 0.0
        self._hidden = 0.0
        self._last: tuple[float, Pixels] | None = None

    def forget(self) -> None:
        """The board lies elsewhere now."""
        self._rested = self._last = None

    def expect_tallest(self, height: float) -> None:
        """The tallest piece shows this height, mm."""
        self.parameters.estimate("hand.above", max(118.0, height + 20.0), "tallest piece seen")

    def check(self, seen: HeightMap, contrast: Contrast, noise: float, time: float) -> GateReading:
        """Look at a frame.

        Args:
            seen: Its heights.
            contrast: Its local means.
            noise: Of the cells, mm.
            time: Of the frame, s.
        """
        high = self._high(seen)
        if high.hand:
            return self._moved_on(contrast, time, high)
        moving = self._moving(seen, contrast, noise, time)
        low = self._low(seen, noise)
        hidden = self._newly_hidden(seen, contrast)
        return self._moved_on(contrast, time, next((r for r in (low, moving, hidden) if r.hand), low))

    def accept(self, seen: HeightMap, contrast: Contrast, noise: float, time: float) -> None:
        """This frame is clear: what rests in it belongs there after a while, in the first frame at once.

        Args:
            seen: Its heights.
            contrast: Its local means.
            noise: Of the cells, mm.
            time: Of the frame, s.
        """
        raised = self._raised(seen, noise)
        self._hidden = float((contrast.seen < _HIDDEN).mean() * 64)
        if self._rested is None:
            self._rested = np.where(raised, np.inf, 0).astype(np.float32)
        else:
            passed = np.float32(np.clip(time - self._accepted, 0, _PAUSE))
            self._rested = np.where(raised, self._rested + passed, 0).astype(np.float32)
        self._accepted = time

    def _moved_on(self, contrast: Contrast, time: float, reading: GateReading) -> GateReading:
        self._last = time, contrast.disc
        return reading

    def _high(self, seen: HeightMap) -> GateReading:
        """Pixels on something high, over the board, or between it and the camera."""
        view, depth = seen.view, seen.window
        index, height = view.cell_of(depth)
        near = near_board(view.cells).ravel()
        high = (height > self.parameters["hand.above"]) & (depth > 0)
        over = high & (_in(near, index) | _in(near, view.bare))
        squares = float(over.sum()) / pixels_per_square(view)
        mask = view.count(index[over]) > 0
        found = squares > self.parameters["hand.high_area"]
        return GateReading(
            found, f"something {np.median(height[over]):.0f} mm above the board" if found else "", mask
        )

    def _low(self, seen: HeightMap, noise: float) -> GateReading:
        """A raised region that was not there and reaches in from outside, or is too big for pieces."""
        view = seen.view
        if self._rested is None:
            return GateReading(hand=False, reason="", mask=np.zeros((view.size, view.size), dtype=bool))
        raised = self._raised(seen, noise)
        resting = (self._rested >= self.parameters["hand.rest"]).astype(np.uint8)
        new = raised & (cv2.dilate(resting, np.ones((3, 3), np.uint8)) == 0)
        limits = (self.parameters["hand.low_area"], self.parameters["hand.big_area"])
        return reaching(raised, new, view.cells, limits)

    def _raised(self, seen: HeightMap, noise: float) -> Mask:
        """(size, size) cells that stand up from the board or the table."""
        limit = max(self.parameters["hand.low"], _RAISED * noise)
        out: Mask = np.nan_to_num(seen.heights, nan=0.0) > limit
        return out

    def _moving(self, seen: HeightMap, contrast: Contrast, noise: float, time: float) -> GateReading:
        view = seen.view
        mask = np.zeros((view.size, view.size), dtype=bool)
        if (
            self._last is None
            or not 0 < time - self._last[0] < _PAUSE
            or self._last[1].shape != contrast.disc.shape
        ):
            return GateReading(hand=False, reason="", mask=mask)
        limit = max(self.parameters["hand.low"], _RAISED * noise)
        with np.errstate(invalid="ignore"):
            moved = np.abs(contrast.disc - self._last[1]) > limit
        mask[seen.board, seen.board] = moved
        found = float(moved.sum()) / view.cells**2 > self.parameters["hand.moving_area"]
        return GateReading(found, "something moves on the board" if found else "", mask)

    def _newly_hidden(self, seen: HeightMap, contrast: Contrast) -> GateReading:
        hidden = contrast.seen < _HIDDEN
        squares = float(hidden.mean() * 64)
        mask = np.zeros((seen.view.size, seen.view.size), dtype=bool)
        mask[seen.board, seen.board] = hidden
        found = self._rested is not None and squares - self._hidden > self.parameters["hand.hidden"]
        return GateReading(found, f"{squares:.0f} squares are hidden" if found else "", mask)


def reaching(there: Mask, new: Mask, cells: int, limits: tuple[float, float]) -> GateReading:
    """Whether a region reaches over the board from outside, or is too big for anything but a hand.

    Args:
        there: (size, size) cells of the board and its margin where something is.
        new: Those of them that were not so before: no other ones count.
        cells: Along the side of a square.
        limits: Squares: of a region from outside, and of one wherever it is.
    """
    count, labels = cv2.connectedComponents(there.astype(np.uint8), connectivity=8)
    areas = np.bincount(labels[new], minlength=count) / cells**2
    outside = np.unique(np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]]))
    inside = np.unique(labels[near_board(cells, 0.0) & new])
    entering = np.intersect1d(outside, inside)
    hits = [part for part in entering if areas[part] > limits[0]]
    hits += [part for part in inside if areas[part] > limits[1]]
    reason = "something reaches over the board" if hits else ""
    return GateReading(bool(hits), reason, np.isin(labels, hits))


def pixels_per_square(view: BoardView) -> float:
    """Depth pixels that look at a square of the bare board, on average."""
    near = near_board(view.cells, 0.0)
    return max(float(view.expected[near].sum()) / 64, 1.0)


def near_board(cells: int, beside: float = _BESIDE) -> Mask:
    """(size, size) cells within so many squares of the board."""
    size, edge = round((8 + 2 * MARGIN) * cells), round((MARGIN - beside) * cells)
    mask = np.zeros((size, size), dtype=bool)
    mask[edge : size - edge, edge : size - edge] = True
    return mask


def _in(mask: Mask, index: npt.NDArray[np.int32]) -> Mask:
    """Whether cells of a flat mask are set; outside the grid none is."""
    out: Mask = mask[np.maximum(index, 0)] & (index >= 0)
    return out
