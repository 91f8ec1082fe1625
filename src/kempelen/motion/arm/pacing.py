"""A path in joint space driven in one go: corners rounded, then as fast as every joint allows.

Nothing stops between the ends, for each stop costs a stepper arm time and accuracy.
"""

import numpy as np

from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.motion.arm.synchrony import TICK, TimedPath

_DENSE = 12
"""Points of a rounded corner."""
_GRID = 128
"""Steps along a path at which its speed is decided."""
_FINE = 0.004
"""Of the times at which limits are looked at, s."""
_BEND = 0.6
"""Share of a joint's acceleration that bends of the path may take; the rest is for changing speed."""
_TINY = 1e-12


def rounded(arm: Arm, knots: Array, share: float = 1.0) -> Array:
    """The polyline through ``knots`` (k, n) rad with its corners cut by parabolas: (m, n) rad.

    Args:
        arm: Whose speeds say how long a piece is: by the time that it takes.
        knots: Joint angles, start and end included.
        share: How much of what is free of the neighbouring pieces a corner takes, 0 to 1.

    Returns:
        Its points; tangents are continuous, so that no corner has to be stopped at.
    """
    knots = _without_repeats(arm, knots)
    lengths = _lengths(arm, knots)
    if len(knots) < 3 or share <= 0:  # noqa: PLR2004 - no corner in a single piece
        return knots
    free = np.where(np.arange(len(lengths)) % (len(lengths) - 1) == 0, _END_SHARE, 0.5) * lengths
    t = np.linspace(0.0, 1.0, _DENSE)[:, None]
    parts = [knots[:1]]
    for i in range(1, len(knots) - 1):
        reach = share * min(free[i - 1], free[i])
        before = knots[i] + (knots[i - 1] - knots[i]) * (reach / lengths[i - 1])
        after = knots[i] + (knots[i + 1] - knots[i]) * (reach / lengths[i])
        parts.append((1 - t) ** 2 * before + 2 * t * (1 - t) * knots[i] + t**2 * after)
    return np.concatenate([*parts, knots[-1:]])


_END_SHARE = 0.9  # of the first and the last piece, which have one corner only


def paced(arm: Arm, path: Array, tick: float = TICK) -> TimedPath:
    """The path (m, n) rad in nearly the least time, from rest to rest.

    Speed, acceleration and jerk of every joint stay within its limits.

    Args:
        arm: Whose limits.
        path: Joint angles without sharp corners, see `rounded`.
        tick: Distance of the times at which the motion is passed on, s.
    """
    path = _without_repeats(arm, path)
    if len(path) < 2:  # noqa: PLR2004
        return TimedPath(np.repeat(path, 2, axis=0), np.array([0.0, tick]))
    way = np.concatenate(([0.0], np.cumsum(_lengths(arm, path))))
    grid = np.linspace(0.0, way[-1], _GRID + 1)
    times = _fastest(arm, _along(path, way, grid), float(grid[1]))
    fine = np.arange(0.0, times[-1] + _FINE, _FINE)
    joints = _smoothed(_along(path, way, np.interp(fine, times, grid)), arm)
    seconds = _FINE * (len(joints) - 1) * _excess(arm, joints)
    count = max(int(np.ceil(seconds / tick)), 1)
    at = np.linspace(0.0, len(joints) - 1.0, count + 1)
    out = _along(joints, np.arange(float(len(joints))), at)
    out[0], out[-1] = path[0], path[-1]
    return TimedPath(out, np.linspace(0.0, seconds, count + 1))


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


def _fastest(arm: Arm, points: Array, step: float) -> Array:
    """When (k,) each of the points (k, n), ``step`` apart, is passed, s.

    Forwards as fast as every joint can speed up, backwards as it can brake (time-optimal path
    parameterisation, Bobrow 1985), with the acceleration that a bend takes reserved at both ends of a step.
    """
    slope: Array = np.gradient(points, step, axis=0)
    bend: Array = np.abs(np.gradient(slope, step, axis=0))
    slope = np.maximum(np.abs(slope), _TINY)
    bend = np.maximum(bend, _TINY)
    cap = np.minimum((arm.velocity / slope) ** 2, _BEND * arm.acceleration / bend).min(axis=1)
    cap[0] = cap[-1] = 0.0
    slopes, bends = ([[float(one) for one in row] for row in rows] for rows in (slope, bend))
    squares = [float(one) for one in cap]
    for _ in ("forwards", "backwards"):
        squares = _forwards(squares, slopes, bends, arm.acceleration.tolist(), 2 * step)
        squares, slopes, bends = squares[::-1], slopes[::-1], bends[::-1]
    speeds = np.sqrt(np.array(squares))
    return np.concatenate(([0.0], np.cumsum(2 * step / np.maximum(speeds[:-1] + speeds[1:], _TINY))))


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


def _smoothed(joints: Array, arm: Arm) -> Array:
    """A moving average over the time in which jerk turns full braking into full acceleration.

    Averages of speeds and accelerations within limits are within them, and acceleration cannot change faster
    than from one limit to the other within that time. The motion lasts that much longer, and its corners
    become a little rounder: the swept test looks at what is sent.
    """
    width = max(int(np.ceil(2.0 * float((arm.acceleration / arm.jerk).max()) / _FINE)), 1)
    before, after = np.repeat(joints[:1], width, axis=0), np.repeat(joints[-1:], width, axis=0)
    total = np.cumsum(np.concatenate((before, joints, after)), axis=0)
    smooth: Array = (total[width:] - total[:-width]) / width
    return smooth


def _excess(arm: Arm, joints: Array) -> float:
    """By how much the time has to be stretched for every joint to keep within its limits; at least 1."""
    step = _FINE * _COARSE
    speed = np.diff(joints[::_COARSE], axis=0) / step
    rate = np.diff(speed, axis=0) / step
    jerk = np.diff(rate, axis=0) / step
    over = (
        float((np.abs(values) / limit).max(initial=0.0)) ** (1.0 / order)
        for order, (values, limit) in enumerate(
            ((speed, arm.velocity), (rate, arm.acceleration), (jerk, arm.jerk)), start=1
        )
    )
    return float(max(1.0, *over))


_COARSE = 4  # finer differences would measure the rounding of the path's points
