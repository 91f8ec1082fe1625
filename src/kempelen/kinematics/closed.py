"""From a pose to joint angles in closed form, one pose at a time, in plain floats (about 3 µs).

Paper, inverse kinematics: wrist centre, base by atan2 (or the other way round), elbow by the law of cosines
with both signs, the rest by difference. `kempelen.kinematics.batch` does many at once.
"""

from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import product
from math import atan2, cos, degrees, inf, isfinite, pi, remainder, sin, sqrt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import MotionError, ReachError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.chain import forward
from kempelen.kinematics.misses import unreached
from kempelen.kinematics.planar import TURN, WITH_PITCH, WITH_ROLL, Planar, planar_or_error

_RANGE_TOLERANCE = 1e-9  # rad: rounding at a joint's limit is no violation
_STRETCH_TOLERANCE = 1e-9  # of the cosine of the elbow: rounding at full stretch
_SAME_POSE = 1e-6  # mm, and cosines
_PLANE_TOLERANCE = 1e-6  # rad: an approach vector so far out of the plane counts as within it

Joints = tuple[float, ...]
"""n joint angles within the ranges, rad."""

View = tuple[tuple[float, float, float], float, float, float]
"""Position, tilt, roll, and how far the approach vector leans out of the plane (a sine)."""

Raw = tuple[float, float, float, float, float]
"""Five angles in any turn, rad; those that an arm lacks are meaningless."""

_Search = Callable[
    [float, float, float, float, float, float, float, "list[tuple[Branch, Raw]] | None"], Joints | None
]


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
    raise closed(arm).unreached(_finite(arm, position), pi - pitch, roll)


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
    return nearest_first(closed(arm).solutions(x, y, z, pi - pitch, roll), near)


def nearest_first(found: list[Solution], near: npt.ArrayLike | None) -> list[Solution]:
    """In order of the sum of angles from ``near``; as they are without it."""
    if near is None:
        return found
    here = np.asarray(near, dtype=np.float64)
    return sorted(found, key=lambda one: float(np.abs(one.joints - here).sum()))


def inverse_pose(arm: Arm, pose: npt.ArrayLike, near: npt.ArrayLike | None = None) -> Solution:
    """Joint angles for a whole pose of the tool.

    Args:
        arm: Of the planar family; with four joints position and approach count, with three the position.
        pose: (4, 4) robot_from_tool.
        near: As in `inverse`.

    Raises:
        ReachError: no solution; with five joints also where the approach vector leans out of the upright
            plane through base axis and tool point.
        MotionError: the arm is of another family, or a number is not finite.
    """
    matrix = np.asarray(pose, dtype=np.float64)
    solver = closed(arm)
    found = solver.posed(matrix, near)
    if found:
        return found[0]
    position, tilt, roll, out_of_plane = min(solver.views(matrix), key=lambda view: abs(view[3]))
    if abs(out_of_plane) > _PLANE_TOLERANCE and arm.n >= WITH_PITCH:
        raise ReachError(
            f"Arm {arm.name} cannot lean the gripper {degrees(abs(out_of_plane)):.3g}° sideways out of the "
            f"upright plane through its base; with {arm.n} joints 0° is what it can do.",
            hint="Tilt the gripper towards the base or away from it, or keep it straight down.",
        )
    raise solver.unreached(position, tilt, roll)


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
        self._placed = _placer(arm)
        self._search = _searcher(self.planar, self._placed)
        self._straight = self.planar.lateral == 0.0 and self.planar.offset == (0.0, 0.0)

    def solve(self, x: float, y: float, z: float, tilt: float, roll: float) -> Joints | None:
        """The first branch within the ranges, (n,) rad, or None; without checks, the fast path."""
        if self.planar.offset != (0.0, 0.0):
            found = self.solutions(x, y, z, tilt, roll)
            return tuple(found[0].joints.tolist()) if found else None
        radial = self._radial(x, y, self.planar.lateral)
        if radial is None:
            return None
        return self._search(radial, atan2(y, x), z, cos(tilt), sin(tilt), tilt, roll, None)

    def solve_pose(self, pose: Array) -> Joints | None:
        """As `solve`, for a (4, 4) robot_from_tool whose approach vector lies in the plane."""
        (xx, xy, ax, x), (yx, yy, ay, y), (_, _, az, z), _ = pose.tolist()
        radial = sqrt(x * x + y * y)
        if not self._straight or radial == 0.0:
            found = self.posed(pose)
            return tuple(found[0].joints.tolist()) if found else None
        c, s = x / radial, y / radial
        lean = ax * c + ay * s
        return self._search(
            radial, atan2(y, x), z, -az, lean, atan2(lean, -az), atan2(yx * c - xx * s, yy * c - xy * s), None
        )

    def posed(self, pose: Array, near: npt.ArrayLike | None = None) -> list[Solution]:
        """All solutions of a (4, 4) pose, nearest first where ``near`` is given."""
        found = [
            one
            for (x, y, z), tilt, roll, out_of_plane in self.views(pose)
            if abs(out_of_plane) <= _PLANE_TOLERANCE or self.arm.n < WITH_PITCH
            for one in self.solutions(x, y, z, tilt, roll)
        ]
        if self.planar.lateral:  # with the base flipped, the same angles turn the gripper another way
            first = (0, 2, 3)[
                WITH_ROLL - self.arm.n
            ]  # column: fewer joints cannot keep the roll, or the tilt
            found = [
                one
                for one in found
                if np.abs((forward(self.arm, one.joints) - pose)[:3, first:]).max() < _SAME_POSE
            ]
        return nearest_first(found, near)

    def solutions(self, x: float, y: float, z: float, tilt: float, roll: float) -> list[Solution]:
        """All within the ranges, whole turns apart included."""
        return [
            Solution(np.array(joints), branch)
            for branch, raw in self.every(x, y, z, tilt, roll)
            for joints in self.windows(raw)
        ]

    def every(self, x: float, y: float, z: float, tilt: float, roll: float) -> list[tuple[Branch, Raw]]:
        """All branches in the order of `BRANCHES`, ranges not looked at, always five angles."""
        found: list[tuple[Branch, Raw]] = []
        for flipped in _WAYS:
            axis = self._on_axis(x, y, z, tilt, roll, flipped=flipped)
            if axis is not None:
                both: list[tuple[Branch, Raw]] = []
                self._search(*axis, cos(tilt), sin(tilt), tilt, roll, both)
                found += [one for one in both if one[0].flipped is flipped]
        return found

    def unreached(self, position: tuple[float, float, float], tilt: float, roll: float) -> ReachError:
        """By how much a pose is missed."""
        return unreached(self.arm, self.planar, position, tilt, self.every(*position, tilt, roll))

    def windows(self, joints: Raw) -> Iterator[Joints]:
        """The same pose within the ranges, with each joint whole turns away or not."""
        choices = []
        for angle, (low, high) in zip(joints, self.arm.ranges.tolist(), strict=False):
            fitting = [one for k in _TURNS if _fits(one := angle + k, low, high)]
            if not fitting:
                return iter(())
            choices.append(fitting)
        return product(*choices)

    def views(self, pose: Array) -> list[View]:
        """A (4, 4) pose as seen in the plane of the base ahead and, where it differs, of the base flipped."""
        (xx, xy, ax, x), (yx, yy, ay, y), (_, _, az, z), _ = pose.tolist()
        ex, ey = self.planar.offset
        axis_x, axis_y = x - xx * ex - xy * ey, y - yx * ex - yy * ey
        lateral = self.planar.lateral
        radial = sqrt(max(axis_x * axis_x + axis_y * axis_y - lateral * lateral, 0.0))
        heading, turn = atan2(axis_y, axis_x), atan2(lateral, radial)
        found = []
        for azimuth in (heading - turn, heading + turn) if lateral else (heading,):
            c, s = cos(azimuth), sin(azimuth)
            tilt, roll = atan2(ax * c + ay * s, -az), atan2(yx * c - xx * s, yy * c - xy * s)
            found.append(((x, y, z), tilt, roll, ay * c - ax * s))
        return found

    def _on_axis(
        self, x: float, y: float, z: float, tilt: float, roll: float, *, flipped: bool
    ) -> tuple[float, float, float] | None:
        """Where the roll axis is at the tool point, for a way of the base: how far out, heading, height."""
        planar = self.planar
        way = -1.0 if flipped else 1.0
        shift, along = off_axis(planar, roll)
        aside = planar.lateral + way * shift
        radial = self._radial(x, y, aside)
        if radial is None:
            return None
        azimuth = atan2(y, x) - atan2(aside, way * radial)
        out = way * radial - way * along * cos(tilt)
        heading = azimuth + atan2(planar.lateral, out)
        return abs(out), heading, z - along * sin(tilt)

    @staticmethod
    def _radial(x: float, y: float, aside: float) -> float | None:
        square = x * x + y * y - aside * aside
        return None if square < 0 else sqrt(square)


def off_axis(planar: Planar, roll: float) -> tuple[float, float]:
    """The tool point from the roll axis, mm: across the plane, and outwards where it points straight down."""
    ex, ey = planar.offset
    c, s = cos(roll), sin(roll)
    return ex * s + ey * c, ey * s - ex * c


_TURNS = (0.0, TURN, -TURN, 2 * TURN, -2 * TURN)


@lru_cache(maxsize=64)
def closed(arm: Arm) -> Closed:
    """The arm's solver, made once.

    Raises:
        MotionError: the arm is of another family.
    """
    return Closed(arm)


def _fits(angle: float, low: float, high: float) -> bool:
    return low - _RANGE_TOLERANCE <= angle <= high + _RANGE_TOLERANCE


def _placer(arm: Arm) -> Callable[[float, float, float, float, float], Joints | None]:
    """Of one arm: five angles to n joints within the ranges, whole turns away where needed; else None."""
    n = arm.n
    low, high = arm.ranges[:, 0] - _RANGE_TOLERANCE, arm.ranges[:, 1] + _RANGE_TOLERANCE
    # joints that an arm lacks never forbid anything
    l1, l2, l3, l4, l5 = np.pad(low, (0, WITH_ROLL - n), constant_values=-inf).tolist()
    h1, h2, h3, h4, h5 = np.pad(high, (0, WITH_ROLL - n), constant_values=inf).tolist()
    middles = arm.ranges.mean(axis=1).tolist()

    def placed(q1: float, q2: float, q3: float, q4: float, q5: float) -> Joints | None:
        if l1 <= q1 <= h1 and l2 <= q2 <= h2 and l3 <= q3 <= h3 and l4 <= q4 <= h4 and l5 <= q5 <= h5:
            return (q1, q2, q3, q4, q5)[:n]
        out = []
        for angle, middle, least, most in zip((q1, q2, q3, q4, q5), middles, low, high, strict=False):
            near = middle + remainder(angle - middle, TURN)
            if not least <= near <= most:
                return None
            out.append(near)
        return tuple(out)

    return placed


def _searcher(
    planar: Planar, placed: Callable[[float, float, float, float, float], Joints | None]
) -> _Search:
    """Of one arm: the wrist's triangle in the plane, solved for both ways of the base and of the elbow."""
    shoulder_r, shoulder_z = planar.shoulder
    upper, lower, lateral = planar.upper, planar.lower, planar.lateral
    s2, s3, s4, s5 = planar.signs
    f0, a0, b0, t0, r0 = planar.zero
    tool_r, tool_z = planar.tool
    squares, twice = upper * upper + lower * lower, 2 * upper * lower
    beyond = 1 + _STRETCH_TOLERANCE

    def search(  # noqa: PLR0917 - names would cost time
        radial: float,
        heading: float,
        z: float,
        c: float,
        s: float,
        tilt: float,
        roll: float,
        every: list[tuple[Branch, Raw]] | None,
    ) -> Joints | None:
        azimuth = heading - atan2(lateral, radial) if lateral else heading
        for flipped in _WAYS:
            if flipped:
                azimuth = 2 * heading - azimuth + pi  # the lateral shift turns the other way
                radial, s, tilt, roll = -radial, -s, -tilt, roll + pi
            r = radial - shoulder_r - c * tool_r + s * tool_z
            up = z - shoulder_z - s * tool_r - c * tool_z
            bend_cos = (r * r + up * up - squares) / twice
            if not -beyond <= bend_cos <= beyond:
                continue
            bend_sin = sqrt(1 - bend_cos * bend_cos) if -1 < bend_cos < 1 else 0.0
            line, bend = atan2(up, r), atan2(bend_sin, bend_cos)
            lead = atan2(lower * bend_sin, upper + lower * bend_cos)
            q1, q5 = azimuth - f0, s5 * (roll - r0)
            for sign in _DOWN_UP if flipped else _UP_DOWN:
                arm_angle = line - sign * lead
                fore_angle = arm_angle + sign * bend
                q2, q3 = s2 * (arm_angle - a0), s3 * (fore_angle - arm_angle + a0 - b0)
                q4 = s4 * (tilt - t0 - fore_angle + b0)
                if every is not None:
                    every.append((Branch(flipped, (sign < 0) is not flipped), (q1, q2, q3, q4, q5)))
                    continue
                joints = placed(q1, q2, q3, q4, q5)
                if joints is not None:
                    return joints
        return None

    return search


_WAYS = (False, True)
_UP_DOWN, _DOWN_UP = (-1.0, 1.0), (1.0, -1.0)


def _finite(arm: Arm, position: npt.ArrayLike, *angles: float) -> tuple[float, float, float]:
    x, y, z = np.asarray(position, dtype=np.float64).reshape(3).tolist()
    if not all(map(isfinite, (x, y, z, *angles))):
        raise MotionError(f"Arm {arm.name}: a position or an angle is not finite.", hint="Check its source.")
    return x, y, z
