"""The closed form for many poses at once, block by block so that what is at work stays in the cache."""

from math import pi
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.closed import BRANCHES, closed
from kempelen.kinematics.planar import TURN, WITH_PITCH, Planar

_BLOCK = 8192


class Solutions(NamedTuple):
    """Of m poses.

    Attributes:
        joints: (m, b, n) rad, each in the turn nearest to the middle of its range; NaN out of reach.
        within: (m, b) whether they are within the ranges.
    """

    joints: Array
    within: npt.NDArray[np.bool_]


def inverse_batch(
    arm: Arm,
    positions: npt.ArrayLike,
    pitch: npt.ArrayLike = pi,
    roll: npt.ArrayLike = 0.0,
    *,
    flipped: bool = True,
) -> Solutions:
    """Joint angles of many poses; meaning of the arguments as in `kempelen.kinematics.closed.inverse`.

    Args:
        arm: Of the planar family.
        positions: (m, 3) mm.
        pitch: (m,) or one for all, rad.
        roll: (m,) or one for all, rad.
        flipped: Also the branches with the base the other way round.

    Returns:
        b = 4 branches in the order of `BRANCHES`, or 2 without the flipped ones.

    Raises:
        MotionError: the arm is of another family.
    """
    planar = closed(arm).planar
    points = np.ascontiguousarray(np.asarray(positions, dtype=np.float64).reshape(-1, 3).T)
    count = points.shape[1]
    tilts = pi - np.asarray(pitch, dtype=np.float64)
    rolls = np.asarray(roll, dtype=np.float64)
    chosen = BRANCHES if flipped else BRANCHES[:2]
    joints = np.empty((len(chosen), arm.n, count))
    within = np.empty((len(chosen), count), dtype=bool)
    for start in range(0, count, _BLOCK):
        part = slice(start, min(start + _BLOCK, count))
        tilt = tilts if tilts.ndim == 0 else tilts[part]
        turn = rolls if rolls.ndim == 0 else rolls[part]
        ahead = _ahead(planar, points[:, part], tilt, turn)
        _solve(arm, planar, ahead, joints[:2, :, part], within[:2, part])
        if flipped:
            _solve(
                arm, planar, _flipped(planar, points[:, part], ahead), joints[2:, :, part], within[2:, part]
            )
    return Solutions(joints.transpose(2, 0, 1), within.T)


class _Planes(NamedTuple):
    """Poses as seen in the arm's plane: azimuth, roll axis at the tool point (radial, up), tilt, roll."""

    heading: Array
    azimuth: Array
    radial: Array
    up: Array
    cos_tilt: Array
    sin_tilt: Array
    tilt: Array
    roll: Array
    flipped: bool


def _ahead(planar: Planar, points: Array, tilt: Array, roll: Array) -> _Planes:
    """With the base turned towards the points (3, m)."""
    x, y, up = points
    c, s = np.cos(tilt), np.sin(tilt)
    square, heading = x * x + y * y, np.arctan2(y, x)
    if planar.offset != (0.0, 0.0):
        return _on_axis(planar, _Planes(heading, heading, square, up, c, s, tilt, roll, flipped=False))
    with np.errstate(invalid="ignore"):
        radial = np.sqrt(square - planar.lateral**2 if planar.lateral else square)
    azimuth = heading - np.arctan2(planar.lateral, radial) if planar.lateral else heading
    return _Planes(heading, azimuth, radial, up, c, s, tilt, roll, flipped=False)


def _flipped(planar: Planar, points: Array, ahead: _Planes) -> _Planes:
    """With the base the other way round; the lateral shift turns the other way, too."""
    planes = ahead._replace(
        azimuth=2 * ahead.heading - ahead.azimuth + pi,
        radial=-ahead.radial,
        sin_tilt=-ahead.sin_tilt,
        tilt=-ahead.tilt,
        roll=ahead.roll + pi,
        flipped=True,
    )
    if planar.offset == (0.0, 0.0):
        return planes
    x, y, up = points
    return _on_axis(planar, planes._replace(radial=x * x + y * y, up=up))


def _on_axis(planar: Planar, planes: _Planes) -> _Planes:
    """From tool points (``radial`` still squared, from the base's axis) to the roll axis beside them."""
    ex, ey = planar.offset
    c, s = np.cos(planes.roll), np.sin(planes.roll)
    aside, along = planar.lateral + ex * s + ey * c, ey * s - ex * c
    with np.errstate(invalid="ignore"):
        radial = np.sqrt(planes.radial - aside * aside) * (-1 if planes.flipped else 1)
    return planes._replace(
        azimuth=planes.heading - np.arctan2(aside, radial),
        radial=radial - along * planes.cos_tilt,
        up=planes.up - along * planes.sin_tilt,
    )


def _solve(arm: Arm, planar: Planar, planes: _Planes, out: Array, within: npt.NDArray[np.bool_]) -> None:
    """Both elbows of one way of the base; ``out`` (2, n, m), ``within`` (2, m)."""
    tool_r, tool_z = planar.tool
    c, s = planes.cos_tilt, planes.sin_tilt
    r = planes.radial - (planar.shoulder[0] + c * tool_r - s * tool_z)
    up = planes.up - (planar.shoulder[1] + s * tool_r + c * tool_z)
    bend, lead = _triangle(planar, r, up)
    line = np.arctan2(up, r)
    s2, s3, s4, s5 = planar.signs
    f0, a0, b0, t0, r0 = planar.zero
    for mine, good, sign in zip(out, within, (1.0, -1.0) if planes.flipped else (-1.0, 1.0), strict=True):
        arm_angle = line - sign * lead
        fore_angle = arm_angle + sign * bend
        np.subtract(planes.azimuth, f0, out=mine[0])
        np.multiply(s2, arm_angle - a0, out=mine[1])
        np.multiply(s3, fore_angle - arm_angle + (a0 - b0), out=mine[2])
        if arm.n >= WITH_PITCH:
            np.multiply(s4, planes.tilt - fore_angle + (b0 - t0), out=mine[3])
        if arm.n > WITH_PITCH:
            mine[4] = s5 * (planes.roll - r0)
        good[:] = _turned(arm, mine)


def _triangle(planar: Planar, r: Array, up: Array) -> tuple[Array, Array]:
    """Bend of the elbow, lead of the upper arm over the line to the wrist: at least 0, NaN out of reach."""
    upper, lower = planar.upper, planar.lower
    bend_cos = (r * r + up * up - (upper * upper + lower * lower)) / (2 * upper * lower)
    with np.errstate(invalid="ignore"):
        bend_sin = np.sqrt(1 - bend_cos * bend_cos)
    bend = np.arctan2(bend_sin, bend_cos)
    if upper == lower:  # an isosceles triangle
        return bend, 0.5 * bend
    return bend, np.arctan2(lower * bend_sin, upper + lower * bend_cos)


def _turned(arm: Arm, joints: Array) -> npt.NDArray[np.bool_]:
    """Bring joints (n, m) into the turn nearest to the middle of their ranges, in place; which are within."""
    good: npt.NDArray[np.bool_] = np.ones(joints.shape[1], dtype=bool)
    for angles, (low, high) in zip(joints, arm.ranges, strict=True):
        middle, half = 0.5 * (low + high), 0.5 * (high - low) + 1e-9
        away = np.abs(angles - middle)
        if not away.max(initial=0.0) <= pi:  # or not a number
            np.subtract(angles, TURN * np.rint((angles - middle) / TURN), out=angles)
            np.abs(angles - middle, out=away)
        good &= away <= half
    return good
