"""A path in joint space driven in one go: corners rounded, then as fast as every joint allows.

Nothing stops between the ends, for each stop costs a stepper arm time and accuracy.
"""

import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter1d

from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.motion.arm.synchrony import TICK, TimedPath

_DENSE = 24
"""Points of a rounded corner."""
_GRID = 128
"""Steps along a path at which its speed is decided."""
_FINE = 0.004
"""Of the times at which limits are looked at, s."""
_BEND = 0.6
"""Share of a joint's acceleration that bends of the path may take; the rest is for changing speed."""
_TINY = 1e-12


def rounded(arm: Arm, knots: Array, shares: npt.ArrayLike = 1.0) -> Array:
    """The polyline through ``knots`` (k, n) rad with its corners cut: (m, n) rad.

    Along a corner the tangent turns by a smooth step, so that tangent and curvature are continuous and no
    corner has to be stopped at.

    Args:
        arm: Whose speeds say how long a piece is: by the time that it takes.
        knots: Joint angles, start and end included, no two neighbours alike.
        shares: How much of what is free of the neighbouring pieces a corner takes, 0 to 1: (k - 2,) or one.
    """
    lengths = _lengths(arm, knots)
    corners = len(knots) - 2
    if corners < 1:
        return knots
    wanted = np.broadcast_to(np.asarray(shares, dtype=np.float64), (corners,))
    free = np.full(len(lengths), 0.5)
    free[[0, -1]] = _END_SHARE
    free *= lengths
    reach = np.maximum(wanted, _LEAST_CORNER) * np.minimum(free[:-1], free[1:])
    back = (knots[:-2] - knots[1:-1]) * (reach / lengths[:-1])[:, None]
    ahead = (knots[2:] - knots[1:-1]) * (reach / lengths[1:])[:, None]
    bends = knots[1:-1, None] + _LEAVING[:, None] * back[:, None] + _ENTERING[:, None] * ahead[:, None]
    return np.concatenate([knots[:1], bends.reshape(-1, knots.shape[1]), knots[-1:]])


_STEPS = np.linspace(0.0, 1.0, _DENSE)
_ENTERING = 2 * _STEPS**3 - _STEPS**4
_LEAVING = _ENTERING[::-1]
_LEAST_CORNER = 0.02
_END_SHARE = 0.9  # of the first and the last piece, which have one corner only


def paced(arm: Arm, path: Array, tick: float = TICK) -> TimedPath:
    """The path (m, n) rad in nearly the least time, from rest to rest.

    Speed and acceleration of every joint stay within its limits, and acceleration along the way builds up
    over the time that its limit of jerk asks for.

    Args:
        arm: Whose limits.
        path: Joint angles without sharp corners, see `rounded`.
        tick: Distance of the times at which the motion is passed on, s.
    """
    path = _without_repeats(arm, path)
    if len(path) < 2:  # noqa: PLR2004
        return TimedPath(np.repeat(path, 2, axis=0), np.array([0.0, tick]))
    way = np.concatenate(([0.0], np.cumsum(_lengths(arm, path))))
    joints, seconds = _smooth(arm, path, way)
    count = max(int(np.ceil(seconds / tick)), 1)
    at = np.linspace(0.0, len(joints) - 1.0, count + 1)
    out = _along(joints, np.arange(float(len(joints))), at)
    out[0], out[-1] = path[0], path[-1]
    seconds *= max(1.0, float(_excess(arm, out, seconds / count).max(initial=1.0)))
    return TimedPath(out, np.linspace(0.0, seconds, count + 1))


def _smooth(arm: Arm, path: Array, way: Array) -> tuple[Array, float]:
    """Joint angles (m, n) at even times, and how long it takes, s.

    Smoothing hurries through narrow bends: where that asks too much of a joint, the bend is taken more
    slowly, and what is left is made up for by stretching the time.
    """
    grid = np.linspace(0.0, way[-1], _GRID + 1)
    points = _along(path, way, grid)
    ease = np.ones(_GRID + 1)
    best: tuple[Array, float] | None = None
    for _ in range(_ROUNDS):
        passed = _smoothed(_passed(*_fastest(arm, points, float(grid[1]), ease), grid), arm)
        joints = _along(path, way, passed)
        excess = _excess(arm, joints[::_COARSE], _FINE * _COARSE)
        seconds = _FINE * (len(joints) - 1) * max(1.0, float(excess.max(initial=1.0)))
        if best is None or seconds < best[1]:
            best = joints, seconds
        if excess.max(initial=1.0) < _GOOD:
            break
        local = np.interp(grid, passed[::_COARSE][1:-1], excess)
        ease *= np.maximum(maximum_filter1d(local, _NEIGHBOURS), 1.0)
    return best if best is not None else (path, _FINE)


_ROUNDS = 3
_GOOD = 1.02
_NEIGHBOURS = 5


def _lengths(arm: Arm, path: Array) -> Array:
    """(m - 1,) of each piece: how long it takes at full speed, s."""
    longest: Array = (np.abs(np.diff(path, axis=0)) / arm.velocity).max(axis=1)
    return longest


def _without_repeats(arm: Arm, path: Array) -> Array:
    keep = np.concatenate(([True], _lengths(arm, path) > _TINY))
    return path[keep]


def _along(path: Array, way: Array, at: Array) -> Array:
    """Joint angles (k, n) at distances ``at`` (k,) along a path."""
    return np.stack([np.interp(at, way, column) for column in path.T], axis=1)


def _fastest(arm: Arm, points: Array, step: float, ease: Array) -> tuple[Array, Array]:
    """When (k,) s and how fast (k,) each of the points (k, n), ``step`` apart, is passed.

    Forwards as fast as every joint can speed up, backwards as it can brake (time-optimal path
    parameterisation, Bobrow 1985), with the acceleration that a bend takes reserved at both ends of a step.
    Speeds are lowered by the factors ``ease`` (k,).
    """
    slope: Array = np.gradient(points, step, axis=0)
    bend: Array = np.abs(np.gradient(slope, step, axis=0))
    slope = np.maximum(np.abs(slope), _TINY)
    bend = np.maximum(bend, _TINY)
    cap = np.minimum((arm.velocity / slope) ** 2, _BEND * arm.acceleration / bend).min(axis=1)
    cap /= ease * ease
    cap[0] = cap[-1] = 0.0
    slopes, bends = ([[float(one) for one in row] for row in rows] for rows in (slope, bend))
    squares = [float(one) for one in cap]
    for _ in ("forwards", "backwards"):
        squares = _forwards(squares, slopes, bends, arm.acceleration.tolist(), 2 * step)
        squares, slopes, bends = squares[::-1], slopes[::-1], bends[::-1]
    speeds = np.sqrt(np.array(squares))
    times = np.concatenate(([0.0], np.cumsum(2 * step / np.maximum(speeds[:-1] + speeds[1:], _TINY))))
    return times, speeds


def _passed(times: Array, speeds: Array, grid: Array) -> Array:
    """How far along the way (m,) at even times, with even acceleration from each point to the next."""
    at = np.arange(0.0, times[-1] + _FINE, _FINE)
    index = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(grid) - 2)
    since = np.minimum(at, times[-1]) - times[index]
    rate = (speeds[index + 1] - speeds[index]) / (times[index + 1] - times[index])
    way: Array = grid[index] + since * (speeds[index] + 0.5 * rate * since)
    return way


def _forwards(
    cap: list[float], slope: list[list[float]], bend: list[list[float]], rate: list[float], twice: float
) -> list[float]:
    """Squared speeds that grow no faster than every joint's acceleration allows, from ``cap`` down."""
    out = [cap[0]]
    for i in range(len(cap) - 1):
        square = out[-1]
        gain = min(
            (a - b * square) / s
            for rows in ((slope[i], bend[i]), (slope[i + 1], bend[i + 1]))
            for s, b, a in zip(rows[0], rows[1], rate, strict=True)
        )
        out.append(min(cap[i + 1], square + twice * max(gain, 0.0)))
    return out


def _smoothed(passed: Array, arm: Arm) -> Array:
    """The way passed (m,) as a moving average over the time in which jerk builds up acceleration.

    The path stays what it is, and the motion lasts that much longer.
    """
    width = max(int(np.ceil(float((arm.acceleration / arm.jerk).max()) / _FINE)), 1)
    total = np.cumsum(np.concatenate((np.full(width, passed[0]), passed, np.full(width, passed[-1]))))
    smooth: Array = (total[width:] - total[:-width]) / width
    return smooth


def _excess(arm: Arm, joints: Array, step: float) -> Array:
    """By how much (k,) the time would have to be stretched for every joint to keep its limits."""
    speed = np.diff(joints, axis=0) / step
    rate = np.abs(np.diff(speed, axis=0)) / step
    over: Array = np.maximum(
        (np.abs(speed[1:]) / arm.velocity).max(axis=1), np.sqrt(rate / arm.acceleration).max(axis=1)
    )
    return over


_COARSE = 4  # finer differences would measure the rounding of the path's points
