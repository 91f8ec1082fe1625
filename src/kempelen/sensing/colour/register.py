"""A picture of the board laid exactly over an earlier one.

Boards bend, corners are found to a tenth of a square, and what stands on the board leans differently in each
picture of a camera that is held by hand. Each square is looked for near its place, by its pattern (the edges
of the squares above all), which light does not change; a smooth field through all that is found lays one
picture over the other.
"""

import cv2
import numpy as np

from kempelen.core.geometry import Array
from kempelen.sensing.colour.columns import MARGIN, Plane
from kempelen.sensing.colour.fields import BASIS, basis_at, fit_smooth

REACH = 0.25  # squares that a square is looked for around its place
FRAME = 0.15  # squares around a square that belong to its pattern: its edges
FLOOR = 0.02  # squares: what one square's place is good for


def registered(before: Plane, after: Plane) -> Plane:
    """The encoded plane picture ``after``, laid over ``before``."""
    n = len(before)
    pixels = n / (8 + 2 * MARGIN)
    places, trust = _places(before[..., 0], after[..., 0], pixels)
    floor = FLOOR * pixels
    factors = np.column_stack([fit_smooth(places[:, axis], trust, floor) for axis in range(2)])
    if np.abs(BASIS @ factors).max() < floor / 2:
        return after
    shift = (basis_at(n, pixels) @ factors).astype(np.float32)
    columns, rows = np.meshgrid(np.arange(n, dtype=np.float32), np.arange(n, dtype=np.float32))
    moved = cv2.remap(
        after,
        columns + shift[..., 0],
        rows + shift[..., 1],
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(moved, dtype=np.float32)


def _places(before: Plane, after: Plane, pixels: float) -> tuple[Array, Array]:
    """(64, 2) pixels right and down where each square is found, and (64,) how well it fits, 0 to 1."""
    side, reach, frame = round(pixels), round(REACH * pixels), round(FRAME * pixels)
    places, fits = np.zeros((64, 2)), np.zeros(64)
    for square in range(64):
        left = round((MARGIN + square % 8) * pixels) - frame
        top = round((MARGIN + 7 - square // 8) * pixels) - frame
        size = side + 2 * frame
        pattern = before[top : top + size, left : left + size]
        around = after[top - reach : top + size + reach, left - reach : left + size + reach]
        fit = cv2.matchTemplate(
            np.ascontiguousarray(around), np.ascontiguousarray(pattern), cv2.TM_CCOEFF_NORMED
        )
        down, right = np.unravel_index(int(np.argmax(fit)), fit.shape)
        places[square] = right - reach, down - reach
        places[square] += _between(np.asarray(fit, dtype=np.float64), int(right), int(down))
        fits[square] = max(float(fit[down, right]), 0.0) ** 2
    return places, np.maximum(fits, 1e-3)


def _between(fit: Array, right: int, down: int) -> Array:
    """(2,) from the best pixel to the top of the parabola through it and its neighbours."""
    out = np.zeros(2)
    for axis, line, at in ((0, fit[down], right), (1, fit[:, right], down)):
        if 0 < at < len(line) - 1:
            bend = 2 * line[at] - line[at - 1] - line[at + 1]
            if bend > 0:
                out[axis] = (line[at + 1] - line[at - 1]) / (2 * bend)
    return out
