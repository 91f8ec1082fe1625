"""A lattice of X-corners, grown from a few of them through local homographies.

Lattice points are pairs of whole numbers. The origin and the turn are arbitrary: which eight rows and columns
are the board is settled afterwards (:mod:`kempelen.sensing.board.placement`).
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from kempelen.core.geometry import Array
from kempelen.sensing.board.corners import Corners

Indices = npt.NDArray[np.int64]

_NEAR = 14  # neighbours looked at: a corner's four true ones are among them unless clutter crowds the place
_ALONG = np.radians(12.0)  # a neighbour lies along an edge, that closely ...
_PARALLEL = np.radians(20.0)  # ... and its own edges point the same way, perspective and noise allowed for
_CATCH = 0.25  # squares from its place at which a corner still joins a growing lattice
_KEEP = 0.15  # and stays in it after the fit
_REACH = 2  # rows beyond those found that the next may be in: one may be hidden behind pieces
_STALLED = 2  # rounds without a new corner: the fit may still have settled in the first
_ROUNDS = 16  # of growing; a board is covered in five
_SEEDS = 12  # tried in one picture
_TRUSTED = 0.5  # share of a board's inner points from which a lattice is no chance
_ENOUGH = 9  # corners that make a lattice worth a look
_HOMOGRAPHY = 4
TINY = 1e-12
"""Less is taken for zero, so that nothing is divided by it."""
_INNER = 7  # lattice points a side, inside a board
_WIDEST = 24  # rows: a growing lattice is stopped there (a tiled floor)


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """Corners with their places.

    Attributes:
        view_from_lattice: (3, 3) homography from lattice points to pixels of the view.
        indices: (n, 2) lattice points.
        members: (n,) which corners they are.

    The lattice is never mirrored (from x to y is the picture's from right to down), and the square from (0,
    0) to (1, 1) is a dark one: both follow from the order of a corner's axes.
    """

    view_from_lattice: Array
    indices: Indices
    members: Indices

    def __len__(self) -> int:
        return len(self.members)

    @property
    def filled(self) -> float:
        """Share of the inner points of a board that were seen."""
        return len(self.core(_INNER)) / _INNER**2

    def core(self, span: int) -> "Lattice":
        """The part of it in the fullest window of ``span`` rows and columns: without chance clutter."""
        low = self.indices.min(axis=0)
        table = np.zeros(np.ptp(self.indices, axis=0) + 1 + 2 * span)
        table[tuple((self.indices - low + span).T)] = 1
        counts = window_sums(table, span, span)
        start = np.array(np.unravel_index(int(np.argmax(counts)), counts.shape)) - span + low
        inside = ((self.indices >= start) & (self.indices < start + span)).all(axis=1)
        return replace(self, indices=self.indices[inside], members=self.members[inside])


def grow_lattices(corners: Corners, most: int = 3) -> list[Lattice]:
    """Up to ``most`` lattices that share no corner, the largest first."""
    if len(corners) < _HOMOGRAPHY:
        return []
    links = _links(corners)
    degree = (links >= 0).sum(axis=1)
    free = np.ones(len(corners), dtype=bool)
    found: list[Lattice] = []
    tried = 0
    for seed in np.lexsort((-corners.response, -degree)):
        if tried >= _SEEDS or degree[seed] < 2:  # noqa: PLR2004 - one along each edge
            break
        if not free[seed]:
            continue
        lattice = _grow(corners, int(seed), links[seed], free)
        tried += 1
        if lattice is None or len(lattice) < _ENOUGH:
            continue
        found.append(lattice)
        if lattice.filled > _TRUSTED:
            free[lattice.core(_INNER).members] = False  # what fits beyond may be another board
    return _apart_from_each_other(sorted(found, key=_weight, reverse=True))[:most]


def _weight(lattice: Lattice) -> int:
    """Corners in as many rows and columns as a board has."""
    return len(lattice.core(_INNER))


def _apart_from_each_other(lattices: list[Lattice]) -> list[Lattice]:
    """Without those that share corners with a larger one."""
    kept: list[Lattice] = []
    for lattice in lattices:
        if all(not np.isin(lattice.core(_INNER).members, other.core(_INNER).members).any() for other in kept):
            kept.append(lattice)
    return kept


def fit_homography(lattice: Array, pixels: Array, weights: Array | None = None) -> Array | None:
    """(3, 3) least-squares homography (normalised DLT) from (n, 2) lattice points to (n, 2) pixels, n >= 4.

    None when the points do not determine it.
    """
    from_unit, source = _normalised(lattice)
    to_unit, target = _normalised(pixels)
    x, y = source[:, 0], source[:, 1]
    one, zero = np.ones_like(x), np.zeros_like(x)
    u, v = target[:, 0], target[:, 1]
    first = np.stack([x, y, one, zero, zero, zero, -u * x, -u * y, -u], axis=1)
    second = np.stack([zero, zero, zero, x, y, one, -v * x, -v * y, -v], axis=1)
    rows = np.concatenate([first, second])
    if weights is not None:
        rows = rows * np.concatenate([weights, weights])[:, None]
    values, vectors = np.linalg.eigh(rows.T @ rows)
    if values[1] < 1e-9 * values[-1]:  # two solutions: points on a line
        return None
    unit = vectors[:, 0].reshape(3, 3)
    out: Array = np.linalg.inv(to_unit) @ unit @ from_unit
    if abs(out[2, 2]) < TINY * np.abs(out).max():
        return None
    out = out / out[2, 2]
    return out if np.isfinite(out).all() else None


def inverse(homography: Array) -> Array:
    """(3, 3) from pixels back.

    Raises:
        numpy.linalg.LinAlgError: the homography flattens the plane.
    """
    return np.asarray(np.linalg.inv(homography), dtype=np.float64)


def apply(homography: Array, points: Array) -> tuple[Array, Array]:
    """(n, 2) points moved, and (n,) their denominators: those of another sign lie beyond the horizon."""
    raised = points @ homography[:, :2].T + homography[:, 2]
    depth = raised[:, 2]
    return raised[:, :2] / np.where(np.abs(depth) < TINY, TINY, depth)[:, None], depth


def window_sums(values: Array, rows: int, columns: int) -> Array:
    """Sums over all windows of that many rows and columns, by the window's first row and column."""
    table = np.zeros((values.shape[0] + 1, values.shape[1] + 1))
    table[1:, 1:] = values.cumsum(axis=0).cumsum(axis=1)
    sums: Array = (
        table[rows:, columns:] - table[:-rows, columns:] - table[rows:, :-columns] + table[:-rows, :-columns]
    )
    return sums


def _normalised(points: Array) -> tuple[Array, Array]:
    """Matrix and points with their mean at 0 and a spread of 1 (Hartley 1997)."""
    centre = points.mean(axis=0)
    spread = max(float(np.abs(points - centre).mean()), 1e-9)
    matrix = np.array([[1 / spread, 0, -centre[0] / spread], [0, 1 / spread, -centre[1] / spread], [0, 0, 1]])
    return matrix, (points - centre) / spread


def lines_apart(first: npt.ArrayLike, second: npt.ArrayLike) -> Array:
    """Angle between lines of those directions, 0 to pi / 2; rad."""
    turned = np.abs(np.subtract(first, second)) % np.pi
    out: Array = np.minimum(turned, np.pi - turned)
    return out


def _links(corners: Corners) -> Indices:
    """(n, 4) the neighbour along +axis 0, -axis 0, +axis 1, -axis 1 of each corner; -1 for none."""
    count = len(corners)
    distance, near = cKDTree(corners.points).query(corners.points, k=min(_NEAR + 1, count))
    distance, near = distance[:, 1:], near[:, 1:]
    step = corners.points[near] - corners.points[:, None]
    heading = np.arctan2(step[..., 1], step[..., 0])
    out = np.full((count, 4), -1, dtype=np.int64)
    for axis in (0, 1):
        mine, other = corners.axes[:, axis, None], corners.axes[:, 1 - axis, None]
        fits = lines_apart(heading, mine) < _ALONG
        fits &= lines_apart(heading, corners.axes[near, 1 - axis]) < _ALONG
        fits &= lines_apart(other, corners.axes[near, axis]) < _PARALLEL
        ahead = np.cos(heading - mine) > 0
        for side, wanted in enumerate((ahead, ~ahead)):
            usable = fits & wanted
            first = np.argmax(usable, axis=1)  # the neighbours come sorted by distance
            hit = usable[np.arange(count), first]
            out[hit, 2 * axis + side] = near[np.flatnonzero(hit), first[hit]]
    return out


_STEPS = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])


def _grow(corners: Corners, seed: int, links: Indices, free: npt.NDArray[np.bool_]) -> Lattice | None:
    """From one corner and its neighbours outwards, a ring at a time."""
    present = (links >= 0) & free[links]
    if not (present[:2].any() and present[2:].any()):
        return None
    indices = np.concatenate([np.zeros((1, 2), dtype=np.int64), _STEPS[present]])
    members = np.concatenate([[seed], links[present]])
    if len(set(members.tolist())) < len(members):
        return None
    homography = _first_fit(indices, corners.points[members])
    size = stalled = 0
    for _ in range(_ROUNDS):
        if homography is None:
            return None
        indices, members = _members(corners, homography, indices, free)
        if len(members) < 3:  # noqa: PLR2004 - nothing left to fit
            return None
        homography = _first_fit(indices, corners.points[members])
        stalled = stalled + 1 if len(members) <= size else 0
        if stalled == _STALLED:
            break
        size = max(size, len(members))
        if np.ptp(indices, axis=0).max() > _WIDEST:
            break
    return None if homography is None else _finished(corners, homography, indices, members)


def _first_fit(indices: Indices, pixels: Array) -> Array | None:
    """Homography where the points determine one, else an affine map."""
    places = indices.astype(np.float64)
    if len(indices) > _HOMOGRAPHY or (len(indices) == _HOMOGRAPHY and _in_general_position(indices)):
        fitted = fit_homography(places, pixels)
        if fitted is not None:
            return fitted
    flat = np.column_stack([places, np.ones(len(places))])
    if np.linalg.matrix_rank(flat) < 3:  # noqa: PLR2004 - a line
        return None
    solved = np.linalg.lstsq(flat, pixels, rcond=None)[0]
    return np.vstack([solved.T, [0.0, 0.0, 1.0]])


def _in_general_position(indices: Indices) -> bool:
    for left_out in range(len(indices)):
        three = np.delete(indices, left_out, axis=0)
        if np.linalg.det(np.column_stack([three, np.ones(3)])) == 0:
            return False
    return True


def _members(
    corners: Corners, homography: Array, known: Indices, free: npt.NDArray[np.bool_]
) -> tuple[Indices, Indices]:
    """Lattice points and corners that fit a homography, no farther than ``_REACH`` from those known."""
    try:
        back = inverse(homography)
    except np.linalg.LinAlgError:
        return np.empty((0, 2), dtype=np.int64), np.empty(0, dtype=np.int64)
    seen, _ = apply(back, corners.points)
    bounded = np.clip(seen, -1e6, 1e6)
    places = np.round(bounded).astype(np.int64)
    off = np.abs(bounded - places).max(axis=1)
    low, high = known.min(axis=0) - _REACH, known.max(axis=0) + _REACH
    fits = free & (off < _CATCH) & (places >= low).all(axis=1) & (places <= high).all(axis=1)
    chosen = np.flatnonzero(fits)
    chosen = chosen[axes_fit(homography, places[chosen], corners.axes[chosen])]
    order = chosen[np.argsort(off[chosen], kind="stable")]
    _, first = np.unique(places[order], axis=0, return_index=True)
    kept = order[first]
    return places[kept], kept


def axes_fit(
    homography: Array, places: Indices, axes: Array, *, mirrored: bool = False
) -> npt.NDArray[np.bool_]:
    """(n,) whether a corner's edges run along the lattice's lines, the dark sectors where they belong.

    Args:
        homography: From lattice points to pixels.
        places: (n, 2) lattice points.
        axes: (n, 2) directions of the corners' edges.
        mirrored: Whether the lattice's y runs to the left of its x, as a board's does.
    """
    spots = places.astype(np.float64)
    here, depth = apply(homography, spots)
    headings = []
    for axis in (0, 1):
        # derivative of the projected point along a lattice line
        column = homography[:, axis]
        rate = (column[:2] - here * column[2]) * np.sign(depth)[:, None]  # its direction is what counts
        headings.append(np.arctan2(rate[:, 1], rate[:, 0]))
    turned = (places.sum(axis=1) % 2 == 1) ^ mirrored
    first = np.where(turned, headings[1], headings[0])
    second = np.where(turned, headings[0], headings[1])
    this_side = depth * np.median(depth) > 0 if len(depth) else np.zeros(0, dtype=bool)
    fits: npt.NDArray[np.bool_] = (
        this_side
        & (lines_apart(first, axes[:, 0]) < _PARALLEL)
        & (lines_apart(second, axes[:, 1]) < _PARALLEL)
    )
    return fits


def _finished(corners: Corners, homography: Array, indices: Indices, members: Indices) -> Lattice | None:
    """Without what does not fit the last homography."""
    for _ in range(3):
        seen, _unused = apply(inverse(homography), corners.points[members])
        good = np.abs(seen - indices).max(axis=1) < _KEEP
        if good.sum() <= _HOMOGRAPHY:
            return None
        indices, members = indices[good], members[good]
        fitted = fit_homography(indices.astype(np.float64), corners.points[members])
        if fitted is None:
            return None
        homography = fitted
        if good.all():
            break
    return Lattice(homography, indices, members)
