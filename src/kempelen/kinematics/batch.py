"""The closed form for many poses at once, block by block so that what is at work stays in the cache."""

from math import pi
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.closed import BRANCHES, closed
from kempelen.kinematics.planar import BASE_SHOULDER_ELBOW, TURN, WITH_PITCH, Planar

_BLOCK = 4096


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
        for half in range(len(chosen) // 2):
            two = slice(2 * half, 2 * half + 2)
            _solve(
                arm, planar, points[:, part], tilt, turn, half == 1, joints[two, :, part], within[two, part]
            )
    return Solutions(joints.transpose(2, 0, 1), within.T)


def _solve(  # noqa: PLR0917 - inside of one loop
    arm: Arm,
    planar: Planar,
    points: Array,
    tilt: Array,
    roll: Array,
    flipped: bool,  # noqa: FBT001 - one of two halves
    out: Array,
    within: npt.NDArray[np.bool_],
) -> None:
    """Both elbows of one way of the base; ``out`` (2, n, m), ``within`` (2, m)."""
    if flipped:
        tilt, roll = -tilt, roll + pi
    azimuth, r, up = _wrist(planar, points, tilt, roll, flipped)
    bend, lead = _triangle(planar, r, up)
    line = np.arctan2(up, r)
    s2, s3, s4, s5 = planar.signs
    f0, a0, b0, t0, r0 = planar.zero
    for number, sign in enumerate((1.0, -1.0) if flipped else (-1.0, 1.0)):
        arm_angle = line - sign * lead
        fore_angle = arm_angle + sign * bend
        mine = out[number]
        mine[0] = azimuth - f0
        mine[1] = s2 * (arm_angle - a0)
        mine[2] = s3 * (fore_angle - arm_angle + (a0 - b0))
        if arm.n >= WITH_PITCH:
            mine[3] = s4 * (tilt - fore_angle + (b0 - t0))
        if arm.n > WITH_PITCH:
            mine[4] = s5 * (roll - r0)
        within[number] = _turned(arm, mine)


def _wrist(
    planar: Planar,
    points: Array,
    tilt: Array,
    roll: Array,
    flipped: bool,  # noqa: FBT001 - one of two halves
) -> tuple[Array, Array, Array]:
    """Azimuth of the plane, and the wrist from the shoulder within it (radial, up)."""
    x, y, z = points
    (tool_r, tool_z), lateral = planar.tool, planar.lateral
    along: float | Array = tool_r
    shift: float | Array = lateral
    if planar.offset != (0.0, 0.0):
        ex, ey = planar.offset
        c, s = np.cos(roll), np.sin(roll)
        shift, along = lateral + ex * s + ey * c, tool_r - ex * c + ey * s
    azimuth = np.arctan2(y, x)
    with np.errstate(invalid="ignore"):
        radial = np.sqrt(x * x + y * y - shift * shift)
    if flipped:
        radial = -radial
    if np.any(shift):
        azimuth = azimuth - np.arctan2(shift, radial)
    elif flipped:
        azimuth = azimuth + pi
    if planar.n == BASE_SHOULDER_ELBOW:
        return azimuth, radial - planar.shoulder[0], z - planar.shoulder[1]
    c, s = np.cos(tilt), np.sin(tilt)
    r = radial - (planar.shoulder[0] + c * along - s * tool_z)
    up = z - (planar.shoulder[1] + s * along + c * tool_z)
    return azimuth, r, up


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
        away = angles - middle
        if np.nanmax(np.abs(away), initial=0.0) > pi:
            np.subtract(angles, TURN * np.rint(away / TURN), out=angles)
            away = angles - middle
        good &= np.abs(away) <= half
    return good
