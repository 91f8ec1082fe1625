"""The lattice method: X-corners, a lattice, the window that is the board, its homography.

Everything here is in one picture's pixels and in the squares of a window whose origin is any of the board's
corners; which one is a1 is settled by :mod:`kempelen.sensing.board.orientation`.
"""

from dataclasses import dataclass

import numpy as np

from kempelen.core.camera import Picture
from kempelen.core.geometry import Array
from kempelen.sensing.board import reasons
from kempelen.sensing.board.contrast import measure_contrasts
from kempelen.sensing.board.corners import Corners, View, find_corners
from kempelen.sensing.board.fit import BoardFit, fit_board
from kempelen.sensing.board.lattice import Lattice, apply, grow_lattices, inverse
from kempelen.sensing.board.placement import ROWS, Placement, block_around, place_board

_SIZES = (1000, 500, 1600)  # px, longest side: the second for blurred pictures, the third for small boards
_MIDDLES = np.stack(np.meshgrid(np.arange(ROWS) + 0.5, np.arange(ROWS) + 0.5), axis=-1).reshape(-1, 2)
_SURE = 0.995  # confidence from which a window is taken for the board
_BLANK = 20.0  # times rarer is a board with a whole row hidden than one in full view
_PER_SQUARE = 0.55  # evidence a square in view, at the least: a board full of men shows 1.2, clutter 0.3
_CORE = 10  # corners in seven rows and columns that make a lattice worth a look
# Of the way from the board's middle to that of a square at its border: from there on a quarter of the
# square is in view, enough to find the board by, if not to read the square.
_INWARD = 6.5 / 7
_HIDDEN = 3  # squares out of view that a board may have: one corner of it, never a row
_SAME = 0.5  # of the squares of one window within another: the same board found twice


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A window found in a view, sure or not.

    Attributes:
        placement: Of the window.
        fit: From squares of the window to pixels of the original picture.
        dark_corner: Whether the square at the window's origin is dark.
        full_ends: Whether the first and the last rank are known to be full of men.
    """

    placement: Placement
    fit: BoardFit
    dark_corner: bool
    full_ends: bool

    @property
    def sure(self) -> bool:
        """Whether this is a board, and this window it."""
        return self.confidence > _SURE

    @property
    def convincing(self) -> bool:
        """Whether there is a chequered pattern at all."""
        return self.placement.evidence > _PER_SQUARE * max(int(self.placement.seen.sum()), ROWS * ROWS // 2)

    @property
    def confidence(self) -> float:
        """0 to 1: the window's probability, less where one of its rows shows nothing of a pattern."""
        doubt = (1.0 - self.placement.probability) * (_BLANK if self._blank else 1.0)
        return max(0.0, 1.0 - doubt) if self.convincing else 0.0

    @property
    def _blank(self) -> bool:
        """Whether a row shows nothing that men known to stand there do not explain."""
        rows, columns = self.placement.rows <= 0, self.placement.columns <= 0
        if self.full_ends:
            ranks, files = (rows, columns) if rows.any() else (columns, rows)
            return bool(files.any() or ranks[1:-1].any())
        return bool(rows.any() or columns.any())


def search(picture: Picture, *, full_ends: bool = False) -> Candidate:
    """The one board in a picture.

    Args:
        picture: (height, width, 3) blue, green, red.
        full_ends: Whether the first and the last rank are known to be full of men, which may hide them.

    Raises:
        BoardNotFoundError: none, two, half of one, or none that can be told from its surroundings.
    """
    blind = reasons.blind_reason(picture)
    if blind is not None:
        raise blind
    best: Candidate | None = None
    found = 0
    for size in _SIZES[: 3 if max(picture.shape[:2]) > _SIZES[0] else 2]:
        candidates, corners = _at_size(picture, size, full_ends=full_ends)
        found = max(found, corners)
        sure = _distinct([each for each in candidates if each.sure])
        if len(sure) > 1:
            raise reasons.two_boards()
        if sure:
            return _whole(sure[0], picture)
        best = max([*candidates, *([best] if best else [])], key=_evidence, default=None)
    if best is None or not best.convincing:
        raise reasons.no_board(found)
    _whole(best, picture)
    raise reasons.uncertain(best.placement)


def _evidence(candidate: Candidate) -> float:
    return candidate.placement.evidence


def _at_size(picture: Picture, size: int, *, full_ends: bool) -> tuple[list[Candidate], int]:
    """Candidates at one size of the picture, and the corners of the largest lattice."""
    view = View.of(picture, size)
    corners = find_corners(view.grey)
    lattices = grow_lattices(corners)
    candidates = [_candidate(picture, view, corners, lattice, full_ends=full_ends) for lattice in lattices]
    known = [each for each in candidates if each is not None]
    return known, max(map(len, lattices), default=0)


def _candidate(
    picture: Picture, view: View, corners: Corners, lattice: Lattice, *, full_ends: bool
) -> Candidate | None:
    core = lattice.core(ROWS - 1)
    if len(core) < _CORE:
        return None
    homography = view.original_from_view @ core.view_from_lattice
    low, size = block_around(core.indices)
    contrasts = measure_contrasts(picture, homography, core.indices, low, size)
    if contrasts is None:
        return None
    placement = place_board(contrasts, lattice.indices)
    places = lattice.indices - placement.origin
    inner = ((places >= 1) & (places <= ROWS - 1)).all(axis=1)
    pixels, _ = apply(view.original_from_view, corners.points[lattice.members[inner]])
    fit = fit_board(places[inner].astype(np.float64), pixels) if inner.sum() >= _CORE else None
    if fit is None:
        return None
    dark_corner = bool(placement.origin.sum() % 2 == 0)
    return Candidate(placement, fit, dark_corner=dark_corner, full_ends=full_ends)


def _distinct(candidates: list[Candidate]) -> list[Candidate]:
    """Without those that lie on a better one."""
    kept: list[Candidate] = []
    for candidate in sorted(candidates, key=_evidence, reverse=True):
        middles, _ = apply(candidate.fit.pixels_from_window, _MIDDLES)
        if all(_overlap(each, middles) < _SAME for each in kept):
            kept.append(candidate)
    return kept


def _overlap(candidate: Candidate, pixels: Array) -> float:
    places, _ = apply(inverse(candidate.fit.pixels_from_window), pixels)
    return float(((places > 0) & (places < ROWS)).all(axis=1).mean())


def _whole(candidate: Candidate, picture: Picture) -> Candidate:
    """The same, if enough of it is in view and large enough.

    Raises:
        BoardNotFoundError: cut off, or too small.
    """
    height, width = picture.shape[:2]
    placement, homography = candidate.placement, candidate.fit.pixels_from_window
    inward, _ = apply(homography, ROWS / 2 + (_MIDDLES - ROWS / 2) * _INWARD)
    out_of_view = ((inward < 0) | (inward > (width - 1, height - 1))).any(axis=1)
    if int(out_of_view.sum()) > _HIDDEN:
        middles, _ = apply(homography, _MIDDLES)
        cut = reasons.cut_off(placement, middles, (width, height))
        if cut is not None:
            raise cut
    small = reasons.too_small(homography)
    if small is not None:
        raise small
    return candidate
