"""Whether a hand is over the board, from colour alone: a large change that reaches in, or motion."""

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Picture
from kempelen.core.geometry import Array
from kempelen.sensing.depth.gate import GateReading, near_board, reaching
from kempelen.sensing.depth.geometry import MARGIN, Mask
from kempelen.sensing.parameters import Parameter, Parameters
from kempelen.sensing.sighting import BoardSighting

_CELLS = 8  # along the side of a square, of the small picture that is compared
_OVERSAMPLED = 2
_PAUSE = 0.5  # s: frames further apart than this say nothing about motion
_FOLLOW = 0.2  # share by which the clear view follows the light
_SATURATED = 250.0  # grey levels: brighter light makes no difference
_MAD = 1.4826
_NOISES = 5.0


def colour_gate_parameters() -> Parameters:
    """As they are before anything was seen."""
    return Parameters(
        Parameter("gate.change", 22.0, "grey levels", 4, 120, "what differs by more has changed"),
        Parameter(
            "gate.area", 2.5, "squares", 0.3, 40, "as much changed, reaching in from outside, is a hand"
        ),
        Parameter("gate.big_area", 6.0, "squares", 1, 60, "as much changed in one piece, wherever it is"),
        Parameter("gate.moving_area", 0.5, "squares", 0.05, 20, "as much that changed since the last frame"),
        Parameter(
            "gate.patience", 3.0, "s", 0.2, 60, "a change that rests so long is no hand: light, or a thing"
        ),
    )


class ColourGate:
    """Compares each frame with the last clear one and with the frame before.

    Args:
        parameters: To be shown and overridden; its own ones without.
    """

    def __init__(self, parameters: Parameters | None = None) -> None:
        self.parameters = colour_gate_parameters() if parameters is None else parameters
        self.forget()

    def forget(self) -> None:
        """The board lies elsewhere now."""
        self._clear: Array | None = None
        self._last: tuple[float, Array] | None = None
        self._resting_since: float | None = None

    def check(self, picture: Picture, sighting: BoardSighting, time: float) -> GateReading:
        """Look at a frame.

        Args:
            picture: Its colour.
            sighting: Of the board.
            time: Of the frame, s.
        """
        now = _small_view(picture, sighting)
        moving = self._moving(now, time)
        self._last = time, now
        found = self._reaching(now)
        if not found.hand or moving.hand:
            self._resting_since = None
            return moving if moving.hand else found
        self._resting_since = time if self._resting_since is None else self._resting_since
        if time - self._resting_since > self.parameters["gate.patience"]:
            self._clear = now
            self._resting_since = None
            return GateReading(hand=False, reason="", mask=np.zeros_like(found.mask))
        return found

    def accept(self) -> None:
        """The last frame is clear."""
        if self._last is None:
            return
        now = self._last[1]
        self._clear = now if self._clear is None else self._clear + _FOLLOW * (now - self._clear)

    def _reaching(self, now: Array) -> GateReading:
        if self._clear is None:
            return GateReading(hand=False, reason="", mask=np.zeros(now.shape[:2], dtype=bool))
        changed = self._changed(now, self._clear)
        closed = cv2.morphologyEx(changed.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)) > 0
        limits = (self.parameters["gate.area"], self.parameters["gate.big_area"])
        return reaching(closed, closed, _CELLS, limits)

    def _moving(self, now: Array, time: float) -> GateReading:
        nothing = np.zeros(now.shape[:2], dtype=bool)
        if self._last is None or not 0 < time - self._last[0] < _PAUSE:
            return GateReading(hand=False, reason="", mask=nothing)
        changed = self._changed(now, self._last[1])
        opened = cv2.morphologyEx(changed.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8)) > 0
        squares = float(opened[near_board(_CELLS, 0.0)].sum()) / _CELLS**2
        found = squares > self.parameters["gate.moving_area"]
        return GateReading(found, "something moves on the board" if found else "", opened)

    def _changed(self, now: Array, before: Array) -> Mask:
        """Cells that differ by more than the light, evened out over the picture, and the noise explain."""
        ratio = np.median((now + 1) / (before + 1), axis=(0, 1))
        predicted = np.minimum(before * ratio, _SATURATED)
        difference = np.abs(np.minimum(now, _SATURATED) - predicted).max(axis=2)
        noise = _MAD * float(np.median(difference))
        out: Mask = difference > max(self.parameters["gate.change"], _NOISES * noise)
        return out


def _small_view(picture: Picture, sighting: BoardSighting) -> Array:
    """(size, size, 3) the board and its margin from straight above, rows from rank 1 upwards, grey levels."""
    side = round((8 + 2 * MARGIN) * _CELLS) * _OVERSAMPLED
    step = (8 + 2 * MARGIN) / side
    board_from_view = np.array([[step, 0, step / 2 - MARGIN], [0, step, step / 2 - MARGIN], [0, 0, 1.0]])
    seen = cv2.warpPerspective(
        picture, sighting.image_from_board @ board_from_view, (side, side),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    size = side // _OVERSAMPLED
    small: npt.NDArray[np.uint8] = np.asarray(
        cv2.resize(seen, (size, size), interpolation=cv2.INTER_AREA), np.uint8
    )
    return small.astype(np.float64)
