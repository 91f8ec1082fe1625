"""Whether the board is still where it was: a look at its corners alone.

Hands and men hide corners but make none in the right place with the right colours around it, so a few of them
are enough to say yes. A no needs evidence: corners in rows of their own somewhere else.
"""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Picture
from kempelen.core.geometry import Array
from kempelen.sensing.board.corners import Corners, View, find_corners
from kempelen.sensing.board.fit import fit_board
from kempelen.sensing.board.lattice import apply, axes_fit, grow_lattices, inverse
from kempelen.sensing.board.placement import ROWS
from kempelen.sensing.sighting import OUTER_CORNERS, BoardSighting, moved

_SIDE = 320  # px of the board's longer side: 35 a square, and a millisecond to search
_MARGIN = 0.6  # squares around the board that are searched with it
_STILL = 0.02  # squares, median: what noise and rounding make of a board that rests
_NEAR = 0.3  # squares from its place at which a corner may still be the same one
_DRIFT = 0.15  # squares that a board is followed by; after a harder push it is searched for anew
_ENOUGH = 10  # corners that show the board to be where it was
_REFIT = 16  # and that measure it anew
_ELSEWHERE = 12  # corners in rows of their own that show it to be somewhere else
_ON_THE_RIM = 4  # corners where the board should end: it is another part of the pattern


def follow_board(picture: Picture, last: BoardSighting) -> BoardSighting | None:
    """The last sighting, if it holds.

    Args:
        picture: Of now, the same camera.
        last: What was found before.

    Returns:
        The very sighting with a new confidence (the share of its corners in sight, so that a hand over the
        board shows as a low one); a corrected one when the board has drifted by under a sixth of a square;
        None when it is elsewhere.
    """
    part, shift = _cut_out(picture, last)
    view = View.of(part, _SIDE)
    image_from_view = shift @ view.original_from_view
    corners = find_corners(view.grey)
    view_from_board = inverse(image_from_view) @ last.image_from_board
    places, members, off = _matched(corners, view_from_board)
    inner = ((places >= 1) & (places <= ROWS - 1)).all(axis=1)
    if int((~inner).sum()) >= _ON_THE_RIM:
        return None
    inner_off = off[inner]
    if inner.sum() >= _ENOUGH and _rests(inner_off):
        return replace(last, confidence=_confidence(int(inner.sum())))
    if inner.sum() >= _REFIT and np.abs(np.median(inner_off, axis=0)).max() < _DRIFT:
        pixels, _ = apply(image_from_view, corners.points[members[inner]])
        return _refitted(last, places[inner].astype(np.float64), pixels)
    elsewhere = grow_lattices(corners, most=1)
    if elsewhere and len(elsewhere[0]) >= _ELSEWHERE:
        return None
    return replace(last, confidence=_confidence(int(inner.sum())))


def _rests(off: Array) -> bool:
    """Whether corners at (n, 2) squares from their places are where they were, as a whole and each."""
    shift = np.abs(np.median(off, axis=0)).max()
    return bool(shift < _STILL and np.median(np.linalg.norm(off, axis=1)) < 2 * _STILL)


def _cut_out(picture: Picture, last: BoardSighting) -> tuple[Picture, Array]:
    """The board's part of the picture, and (3, 3) from its pixels to the picture's."""
    around = last.pixels(OUTER_CORNERS + np.sign(OUTER_CORNERS - ROWS / 2) * _MARGIN)
    height, width = picture.shape[:2]
    low = np.clip(np.floor(around.min(axis=0)), 0, (width - 2, height - 2)).astype(int)
    high = np.clip(np.ceil(around.max(axis=0)) + 1, low + 2, (width, height)).astype(int)
    part = picture[low[1] : high[1], low[0] : high[0]]
    return part, np.array([[1.0, 0.0, low[0]], [0.0, 1.0, low[1]], [0.0, 0.0, 1.0]])


def _matched(
    corners: Corners, view_from_board: Array
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Array]:
    """Places (n, 2), corners (n,) and offsets (n, 2) in squares of the corners near lattice points 0 to 8."""
    if not len(corners):
        return np.empty((0, 2), dtype=np.int64), np.empty(0, dtype=np.int64), np.empty((0, 2))
    seen, _ = apply(inverse(view_from_board), corners.points)
    places = np.round(np.clip(seen, -1e6, 1e6)).astype(np.int64)
    off = seen - places
    fits = (np.abs(off).max(axis=1) < _NEAR) & (places >= 0).all(axis=1) & (places <= ROWS).all(axis=1)
    chosen = np.flatnonzero(fits)
    # the board's plane is mirrored against the picture and a1 is dark: from y to x lies a dark sector at
    # even points
    chosen = chosen[axes_fit(view_from_board, places[chosen], corners.axes[chosen], mirrored=True)]
    order = chosen[np.argsort(np.linalg.norm(off[chosen], axis=1), kind="stable")]
    _, first = np.unique(places[order], axis=0, return_index=True)
    kept = order[first]
    return places[kept], kept, off[kept]


def _refitted(last: BoardSighting, places: Array, pixels: Array) -> BoardSighting | None:
    fitted = fit_board(places, pixels)
    if fitted is None:
        return None
    ends = moved(inverse(last.image_from_board) @ fitted.pixels_from_window, OUTER_CORNERS)
    if np.abs(ends - OUTER_CORNERS).max() > _NEAR:  # corners that agree by chance
        return None
    return replace(
        last,
        image_from_board=fitted.pixels_from_window,
        residual=fitted.residual,
        confidence=_confidence(len(places)),
        camera_from_board=None,
    )


def _confidence(corners: int) -> float:
    return min(1.0, corners / (ROWS - 1) ** 2)
