"""How far from straight down the gripper has to lean at a place, and how far it can: exactly.

For a tool point the wrist lies on a circle around it, one point per tilt. Where tilts begin or cease to be
possible something is at its limit: the links stretched or folded, elbow, shoulder or pitch at an end of its
range. Each such event is a meeting of two circles, ``|c - m e(T + µ)| = R``, hence has a closed form in T.
Between two neighbouring events all tilts are possible or none is, so one look at the middle settles it.
"""

from itertools import pairwise
from math import pi
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import ReachError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.batch import inverse_batch
from kempelen.kinematics.closed import BRANCHES, Branch, Closed, closed, inverse, off_axis
from kempelen.kinematics.planar import TURN

MOST_TILT = float(np.radians(60.0))
"""Beyond this the gripper is refused unless the caller allows more, rad."""

_INWARDS = 1e-7  # rad, by which the ends of a range are kept off the limits, against rounding
_SLIGHT = 1e-6  # rad: no tilt at all is a range of this width
_SAME = 1e-9  # rad: events no farther apart are one


class Posture(NamedTuple):
    """How an arm stands at a place.

    Attributes:
        joints: (n,) rad.
        tilt: From straight down, rad, tip outwards positive.
    """

    joints: Array
    tilt: float


class Tilts(NamedTuple):
    """Tilts that are possible without passing one that is not.

    Attributes:
        low: Least, rad.
        high: Greatest, rad.
        branch: With which the arm can take all of them.
    """

    low: float
    high: float
    branch: Branch

    @property
    def least(self) -> float:
        """The one nearest to straight down."""
        return min(max(0.0, self.low), self.high)


def least_tilt(
    arm: Arm,
    position: npt.ArrayLike,
    near: npt.ArrayLike | None = None,
    most: float = MOST_TILT,
    roll: float = 0.0,
) -> Posture:
    """The posture at a place with the gripper as near straight down as reach allows.

    Args:
        arm: Of the planar family with a pitch joint.
        position: (3,) mm.
        near: (n,) rad; of the postures with the least tilt the nearest one.
        most: Greatest tilt allowed, rad.
        roll: rad; 0 where the gripper leans, so that it closes across the plane.

    Raises:
        ReachError: no tilt up to ``most`` is possible there.
    """
    found = tilts(arm, position, most, roll)
    if not found:
        raise _no_tilt(arm, position, most)
    tilt = min((one.least for one in found), key=abs)
    return Posture(inverse(arm, position, pi - tilt, roll, near).joints, tilt)


def tilts(arm: Arm, position: npt.ArrayLike, most: float = MOST_TILT, roll: float = 0.0) -> list[Tilts]:
    """All ranges of tilts at a place (3,) mm, per branch, least tilt first; empty where there are none."""
    point, most = np.asarray(position, dtype=np.float64).reshape(1, 3), max(most, _SLIGHT)
    edges, fits = _stretches(arm, point, most, roll)
    found = [
        Tilts(*ends, branch)
        for branch, mine in zip(BRANCHES, fits[0].T, strict=True)
        for ends in _merged(edges[0].tolist(), mine.tolist(), most)
    ]
    return sorted(found, key=lambda one: abs(one.least))


def tilt_range(arm: Arm, positions: npt.ArrayLike, most: float = MOST_TILT, roll: float = 0.0) -> Array:
    """Which tilts are possible at many places.

    Args:
        arm: Of the planar family with a pitch joint.
        positions: (..., 3) mm.
        most: Greatest tilt that counts, rad.
        roll: rad.

    Returns:
        (..., 2) rad: ends of the range that holds the least tilt; NaN where there is none.
    """
    points, most = np.asarray(positions, dtype=np.float64), max(most, _SLIGHT)
    edges, fits = _stretches(arm, points.reshape(-1, 3), most, roll)
    low, high = edges[:, :-1], edges[:, 1:]
    away = np.maximum(np.maximum(low, -high), 0.0)[:, :, None]
    away = np.where(fits, away, np.inf)
    flat = away.transpose(0, 2, 1).reshape(len(away), -1)
    branch, first = np.divmod(flat.argmin(axis=1), low.shape[1])
    rows = np.arange(len(flat))
    mine = fits[rows, :, branch]
    start = _reach_out(mine[:, ::-1], low.shape[1] - 1 - first)
    begin, end = low.shape[1] - 1 - start, _reach_out(mine, first)
    out = np.stack(_inwards(low[rows, begin], high[rows, end], most), axis=-1)
    out[~np.isfinite(flat.min(axis=1))] = np.nan
    return out.reshape(*points.shape[:-1], 2)


def least_tilts(arm: Arm, positions: npt.ArrayLike, most: float = MOST_TILT, roll: float = 0.0) -> Array:
    """The least tilt at each of (..., 3) mm: (...) rad, NaN where there is none."""
    found = tilt_range(arm, positions, most, roll)
    return np.asarray(np.clip(0.0, found[..., 0], found[..., 1]))


def _reach_out(fits: npt.NDArray[np.bool_], first: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """(m,) last index of the run of True in (m, k) that holds ``first``."""
    columns = np.arange(fits.shape[1])
    stop = ~fits & (columns > first[:, None])
    return np.asarray(np.where(stop.any(axis=1), stop.argmax(axis=1) - 1, fits.shape[1] - 1), dtype=np.intp)


def _inwards(low: Array, high: Array, most: float) -> tuple[Array, Array]:
    """Ends that rounding does not carry over a limit; those at ``most`` stay."""
    middle = 0.5 * (low + high)
    low = np.where(low > -most, np.minimum(low + _INWARDS, middle), low)
    return low, np.where(high < most, np.maximum(high - _INWARDS, middle), high)


def _merged(edges: list[float], fits: list[bool], most: float) -> list[tuple[float, float]]:
    """Ends of the runs of stretches that fit."""
    out: list[tuple[float, float]] = []
    for (low, high), fit in zip(pairwise(edges), fits, strict=True):
        if fit and out and out[-1][1] == low:
            out[-1] = (out[-1][0], high)
        elif fit:
            out.append((low, high))
    ends = (_inwards(np.array(low), np.array(high), most) for low, high in out)
    return [(float(low), float(high)) for low, high in ends if high > low]


def _stretches(arm: Arm, points: Array, most: float, roll: float) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Sorted events (m, k + 1) of tilt and which stretches between them are possible (m, k, branches)."""
    solver = closed(arm)
    events = np.concatenate(
        [_events(solver, points, roll), -_events(solver, points, roll, flipped=True)], axis=1
    )
    events = np.clip(np.nan_to_num(events, nan=most), -most, most)
    ends = np.tile([-most, most], (len(points), 1))
    edges = np.sort(np.concatenate([events, ends], axis=1), axis=1)
    middle = 0.5 * (edges[:, :-1] + edges[:, 1:])
    repeated = np.repeat(points, middle.shape[1], axis=0)
    within = inverse_batch(arm, repeated, pi - middle.ravel(), roll).within
    fits = within.reshape(*middle.shape, len(BRANCHES))
    same = np.diff(edges, axis=1) < _SAME
    for k in range(fits.shape[1]):  # no width, so it neither begins nor ends a run
        fits[same[:, k], k] = fits[same[:, k], k - 1] if k else False
    return edges, fits


def _events(solver: Closed, points: Array, roll: float, *, flipped: bool = False) -> Array:
    """(m, 16) tilts at which something is at its limit; NaN where it never is."""
    planar = solver.planar
    shift, along = off_axis(planar, roll)
    way = -1 if flipped else 1
    square = (points[:, :2] ** 2).sum(axis=1) - (planar.lateral + way * shift) ** 2
    target = way * np.sqrt(np.maximum(square, 0.0)) + 1j * points[:, 2] - complex(*planar.shoulder)
    tool = complex(planar.tool[0] + way * along, planar.tool[1])
    s2, s3, s4, _ = planar.signs
    _, a0, b0, t0, _ = planar.zero
    ranges = solver.arm.ranges
    upper, lower = planar.upper, planar.lower
    bends = s3 * ranges[2] + b0 - a0
    out = [
        _meet(target, tool, radius)
        for radius in (upper + lower, abs(upper - lower), *np.abs(upper + lower * np.exp(1j * bends)))
    ]
    out += [_meet(target - upper * np.exp(1j * (s2 * q2 + a0)), tool, lower) for q2 in ranges[1]]
    out += [_meet(target, tool + lower * np.exp(1j * (b0 - t0 - s4 * q4)), upper) for q4 in ranges[3]]
    return np.concatenate(out, axis=1)


def _meet(target: npt.NDArray[np.complex128], lever: complex, radius: float) -> Array:
    """(m, 2) the T for which ``|target - lever e(T)| = radius``."""
    size, distance = abs(lever), np.abs(target)
    with np.errstate(invalid="ignore", divide="ignore"):
        half = np.arccos((distance**2 + size**2 - radius**2) / (2 * size * distance))
    middle = np.angle(target) - np.angle(lever)
    both = np.stack([middle - half, middle + half], axis=1)
    return both - TURN * np.rint(both / TURN)


def _no_tilt(arm: Arm, position: npt.ArrayLike, most: float) -> ReachError:
    x, y, z = np.asarray(position, dtype=np.float64).reshape(3)
    anyhow = tilts(arm, position, pi)
    told = f"Arm {arm.name} cannot take the tool point to ({x:.1f}, {y:.1f}, {z:.1f}) mm"
    if anyhow:
        needed = abs(anyhow[0].least)
        return ReachError(
            f"{told} with a tilt up to {np.degrees(most):.0f}°: it needs {np.degrees(needed):.1f}°.",
            hint="Allow more tilt, or move the place nearer.",
        )
    try:
        inverse(arm, position)
    except ReachError as error:
        return ReachError(f"{told} with any tilt. Straight down: {error.message}", hint=error.hint)
    return ReachError(f"{told} with any tilt.")
