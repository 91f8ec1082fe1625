"""From a pose to joint angles in closed form, one pose at a time, in plain floats (about 3 µs).

Paper, inverse kinematics: wrist centre, base by atan2 (or the other way round), elbow by the law of cosines
with both signs, the rest by difference. `kempelen.kinematics.batch` does many at once.
"""

from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import product
from math import atan2, cos, degrees, hypot, isfinite, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import MotionError, ReachError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.planar import BASE_SHOULDER_ELBOW, TURN, WITH_PITCH, Planar, planar_or_error

_RANGE_TOLERANCE = 1e-9  # rad: rounding at a joint's limit is no violation
_STRETCH_TOLERANCE = 1e-9  # of the cosine of the elbow: rounding at full stretch
_PLANE_TOLERANCE = 1e-6  # rad: an approach vector so far out of the plane counts as within it

Raw = tuple[float, ...]


class Branch(NamedTuple):
    """Which of the solutions it is.

    Attributes:
        flipped: The base looks the other way and the arm leans back over it.
        elbow_up: The elbow is above the line from shoulder to wrist.
    """

    flipped: bool
    elbow_up: bool

    def __str__(self) -> str:
        return (
            f"{'base flipped' if self.flipped else 'base ahead'}, elbow {'up' if self.elbow_up else 'down'}"
        )


class Solution(NamedTuple):
    """Joint angles within the ranges that bring the tool point where it was wanted.

    Attributes:
        joints: (n,) rad.
        branch: Which one.
    """

    joints: Array
    branch: Branch


BRANCHES = tuple(Branch(flipped, up) for flipped in (False, True) for up in (True, False))


def inverse(
    arm: Arm,
    position: npt.ArrayLike,
    pitch: float = pi,
    roll: float = 0.0,
    near: npt.ArrayLike | None = None,
) -> Solution:
    """Joint angles for a tool point and a direction of the gripper.

    Args:
        arm: Of the planar family with 3 to 5 joints; fewer than 5 ignore ``roll``, 3 ignore ``pitch`` too.
        position: (3,) mm in the robot's frame.
        pitch: The paper's Θ, rad: pi straight down, less with the tip outwards.
        roll: The paper's ψ, rad.
        near: (n,) rad; of all solutions within the ranges the one least far from here (sum of angles).
            Without it the first of `BRANCHES` that is within.

    Returns:
        The joint angles, with the branch they belong to.

    Raises:
        ReachError: no solution; the message says by how much.
        MotionError: the arm is of another family, or a number is not finite.
    """
    found = branches(arm, position, pitch, roll, near)
    if found:
        return found[0]
    raise _unreached(arm, closed(arm), position, pi - pitch, roll)


def branches(
    arm: Arm,
    position: npt.ArrayLike,
    pitch: float = pi,
    roll: float = 0.0,
    near: npt.ArrayLike | None = None,
) -> list[Solution]:
    """All solutions within the ranges, whole turns apart included; nearest first where ``near`` is given.

    Raises:
        MotionError: the arm is of another family, or a number is not finite.
    """
    x, y, z = _finite(arm, position, pitch, roll)
    solver = closed(arm)
    found = [
        Solution(np.array(joints), branch)
        for branch in BRANCHES
        for joints in solver.windows(solver.raw(x, y, z, pi - pitch, roll, branch))
    ]
    if near is not None:
        here = np.asarray(near, dtype=np.float64)
        found.sort(key=lambda one: float(np.abs(one.joints - here).sum()))
    return found


def inverse_pose(arm: Arm, pose: npt.ArrayLike, near: npt.ArrayLike | None = None) -> Solution:
    """Joint angles for a whole pose of the tool.

    Args:
        arm: Of the planar family.
        pose: (4, 4) robot_from_tool.
        near: As in `inverse`.

    Raises:
        ReachError: no solution; with five joints also where the approach vector leans out of the upright
            plane through base axis and tool point.
        MotionError: the arm is of another family, or a number is not finite.
    """
    matrix = np.asarray(pose, dtype=np.float64)
    position, tilt, roll, out_of_plane = closed(arm).taken_apart(matrix)
    if abs(out_of_plane) > _PLANE_TOLERANCE and arm.n >= WITH_PITCH:
        raise ReachError(
            f"Arm {arm.name} cannot lean the gripper {degrees(abs(out_of_plane)):.3g}° sideways out of the "
            f"upright plane through its base; with {arm.n} joints 0° is what it can do.",
            hint="Tilt the gripper towards the base or away from it, or keep it straight down.",
        )
    return inverse(arm, position, pi - tilt, roll, near)


class Closed:
    """The closed form of one arm, its constants at hand.

    Args:
        arm: Of the planar family.

    Raises:
        MotionError: it is of another family.
    """

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.planar = planar_or_error(arm)
        self.n = arm.n
        self.low: list[float] = (arm.ranges[:, 0] - _RANGE_TOLERANCE).tolist()
        self.high: list[float] = (arm.ranges[:, 1] + _RANGE_TOLERANCE).tolist()
        self.raw: Callable[[float, float, float, float, float, Branch], Raw | None] = _raw_solver(self.planar)

    def solve(self, x: float, y: float, z: float, tilt: float, roll: float) -> Raw | None:
        """The first branch within the ranges, (n,) rad, or None; mm and rad. The fast path: no checks."""
        low, high, raw = self.low, self.high, self.raw
        for branch in BRANCHES:
            joints = raw(x, y, z, tilt, roll, branch)
            if joints is None:
                continue
            for angle, least, most in zip(joints, low, high, strict=True):
                if not least <= angle <= most:
                    break
            else:
                return joints
            found = next(self.windows(joints), None)
            if found is not None:
                return found
        return None

    def solve_pose(self, pose: Array) -> Raw | None:
        """As `solve`, for a (4, 4) robot_from_tool whose approach vector lies in the plane."""
        position, tilt, roll, _ = self.taken_apart(pose)
        return self.solve(*position, tilt, roll)

    def windows(self, joints: Raw | None) -> Iterator[Raw]:
        """The same pose within the ranges, with each joint whole turns away or not."""
        if joints is None:
            return iter(())
        choices = []
        for angle, least, most in zip(joints, self.low, self.high, strict=True):
            fitting = [one for k in _TURNS if least <= (one := angle + k) <= most]
            if not fitting:
                return iter(())
            choices.append(fitting)
        return product(*choices)

    def taken_apart(self, pose: Array) -> tuple[tuple[float, float, float], float, float, float]:
        """Position, tilt, roll and lean out of the plane of a (4, 4) pose, as the arm ahead would take it."""
        (xx, xy, ax, x), (yx, yy, ay, y), (_, _, az, z), _ = pose.tolist()
        ex, ey = self.planar.offset
        axis_x, axis_y = x - xx * ex - xy * ey, y - yx * ex - yy * ey
        lateral = self.planar.lateral
        radial = sqrt(max(axis_x * axis_x + axis_y * axis_y - lateral * lateral, 0.0))
        # e_r, from the point (radial, lateral) that it has to bring to (x, y)
        scale = hypot(axis_x, axis_y)
        if scale > 0:
            c = (axis_x * radial + axis_y * lateral) / (scale * scale)
            s = (axis_y * radial - axis_x * lateral) / (scale * scale)
        else:
            c, s = 1.0, 0.0
        tilt = atan2(ax * c + ay * s, -az)
        roll = atan2(yx * c - xx * s, yy * c - xy * s)
        return (x, y, z), tilt, roll, ay * c - ax * s


_TURNS = (0.0, TURN, -TURN, 2 * TURN, -2 * TURN)


@lru_cache(maxsize=64)
def closed(arm: Arm) -> Closed:
    """The arm's solver, made once.

    Raises:
        MotionError: the arm is of another family.
    """
    return Closed(arm)


def _raw_solver(
    planar: Planar,
) -> Callable[[float, float, float, float, float, Branch], Raw | None]:
    """Of one arm: (x, y, z, tilt, roll, branch) to joints in no particular turn, or None out of reach."""
    n = planar.n
    shoulder_r, shoulder_z = planar.shoulder
    upper, lower, lateral0 = planar.upper, planar.lower, planar.lateral
    s2, s3, s4, s5 = planar.signs
    f0, a0, b0, t0, r0 = planar.zero
    tool_r, tool_z = planar.tool
    ex, ey = planar.offset
    has_pitch = n > BASE_SHOULDER_ELBOW
    off_axis = ex != 0.0 or ey != 0.0
    squares, twice = upper * upper + lower * lower, 2 * upper * lower
    beyond = 1 + _STRETCH_TOLERANCE

    def raw(  # noqa: PLR0917 - names would cost time
        x: float, y: float, z: float, tilt: float, roll: float, branch: Branch
    ) -> Raw | None:
        flipped, elbow_up = branch
        if flipped:
            tilt, roll = -tilt, roll + pi
        lateral, along = lateral0, tool_r
        if off_axis:
            c, s = cos(roll), sin(roll)
            lateral, along = lateral0 + ex * s + ey * c, tool_r - ex * c + ey * s
        square = x * x + y * y - lateral * lateral
        if square < 0:
            return None
        radial, azimuth = sqrt(square), atan2(y, x)
        if flipped:
            radial, azimuth = -radial, azimuth + pi
        if lateral:
            azimuth -= atan2(lateral, radial) - (pi if flipped else 0.0)
        c, s = (cos(tilt), sin(tilt)) if has_pitch else (0.0, 0.0)
        r = radial - shoulder_r - c * along + s * tool_z
        up = z - shoulder_z - s * along - c * tool_z
        bend_cos = (r * r + up * up - squares) / twice
        if not -beyond <= bend_cos <= beyond:
            return None
        bend_sin = sqrt(max(1 - bend_cos * bend_cos, 0.0))
        if elbow_up is not flipped:
            bend_sin = -bend_sin
        bend = atan2(bend_sin, bend_cos)
        arm_angle = atan2(up, r) - atan2(lower * bend_sin, upper + lower * bend_cos) - a0
        fore_angle = arm_angle + a0 + bend - b0
        q1, q2, q3 = azimuth - f0, s2 * arm_angle, s3 * (fore_angle - arm_angle)
        return (q1, q2, q3, s4 * (tilt - t0 - fore_angle), s5 * (roll - r0))[:n]

    return raw


def _finite(arm: Arm, position: npt.ArrayLike, *angles: float) -> tuple[float, float, float]:
    x, y, z = np.asarray(position, dtype=np.float64).reshape(3).tolist()
    if not all(map(isfinite, (x, y, z, *angles))):
        raise MotionError(f"Arm {arm.name}: a position or an angle is not finite.", hint="Check its source.")
    return x, y, z


def _unreached(arm: Arm, solver: Closed, position: npt.ArrayLike, tilt: float, roll: float) -> ReachError:
    """By how much: mm of reach, else degrees of the joint that comes nearest to allowing it."""
    x, y, z = _finite(arm, position, tilt, roll)
    told = f"Arm {arm.name} cannot take the tool point to ({x:.1f}, {y:.1f}, {z:.1f}) mm"
    if arm.n >= WITH_PITCH:
        told += f" with the gripper tilted {degrees(tilt):.1f}°"
    raws = [(branch, solver.raw(x, y, z, tilt, roll, branch)) for branch in BRANCHES]
    known = [(branch, raw) for branch, raw in raws if raw is not None]
    if not known:
        return ReachError(f"{told}: {_missed(solver.planar, x, y, z, tilt)}.", hint=_NEARER)
    excess, branch, joint, angle = min(_worst(solver, branch, raw) for branch, raw in known)
    low, high = (degrees(one) for one in arm.ranges[joint])
    return ReachError(
        f"{told}: its {arm.joint_names[joint]} would have to stand at {degrees(angle):.1f}°, "
        f"{degrees(excess):.1f}° outside its range {low:.0f}° to {high:.0f}° ({branch}).",
        hint=_NEARER,
    )


_NEARER = "Allow more tilt, or move the place; kempelen arm place tells where a board fits."


def _worst(solver: Closed, branch: Branch, raw: Raw) -> tuple[float, Branch, int, float]:
    """The joint farthest outside its range, with the angle in the turn that is least so."""
    worst = (-1.0, branch, 0, 0.0)
    for joint, angle in enumerate(raw):
        low, high = solver.arm.ranges[joint]
        excess, best = min((max(low - one, one - high, 0.0), one) for one in (angle + k for k in _TURNS))
        worst = max(worst, (float(excess), branch, joint, best))
    return worst


def _missed(planar: Planar, x: float, y: float, z: float, tilt: float) -> str:
    """How far the wrist would be from where links can bring it."""
    square = x * x + y * y - planar.lateral**2
    if square < 0:
        return f"it is {abs(planar.lateral) - hypot(x, y):.1f} mm too near to the base's axis"
    (tool_r, tool_z), c, s = planar.tool, cos(tilt), sin(tilt)
    if planar.n == BASE_SHOULDER_ELBOW:
        c = s = 0.0
    r = sqrt(square) - planar.shoulder[0] - c * tool_r + s * tool_z
    up = z - planar.shoulder[1] - s * tool_r - c * tool_z
    distance, most, least = hypot(r, up), planar.upper + planar.lower, abs(planar.upper - planar.lower)
    if distance > most:
        return f"the wrist would be {distance - most:.1f} mm beyond the {most:.0f} mm that the links reach"
    return (
        f"the wrist would be {least - distance:.1f} mm nearer to the shoulder than the {least:.0f} mm allowed"
    )
