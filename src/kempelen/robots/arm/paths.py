"""From actions to joint angles over time: what an arm's driver sends, whichever wire it goes over."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import pi

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.core.protocols import Follow, FollowJoints
from kempelen.core.table import WorkSpace
from kempelen.kinematics import Arm, forward, tilt_range
from kempelen.kinematics.tilt import MOST_TILT
from kempelen.motion.arm.grasp import TILT_MARGIN, least_of
from kempelen.motion.arm.guidance import Pose, joints_at, pose_of, through
from kempelen.motion.arm.motors import Motors
from kempelen.motion.arm.pacing import paced, rounded
from kempelen.motion.arm.synchrony import TimedPath, require_ranges, synchronise
from kempelen.robots.grbl.gcode import checked_path

START_TOLERANCE = 1.0
"""mm between where a path of the tool point begins and where it is: motors stand at whole steps."""
_SHARP = 10.0 * pi / 180  # a corner beyond this is stopped at, a finer one belongs to a curve
_TOO_FAST = 1.05  # of a joint's speed: rounding, no more
_TITLE = "Following a path"


class ArmPaths:
    """What an arm can be told to drive, checked before anything is sent.

    Args:
        motors: Of the arm.
        space: The box that the tool point keeps to, robot frame.
    """

    def __init__(self, motors: Motors, space: WorkSpace) -> None:
        self.motors = motors
        self.arm: Arm = motors.arm
        self.space = space

    def tool(self, joints: npt.ArrayLike) -> tuple[float, float, float]:
        """(x, y, z) mm of the tool point at joint angles (n,) rad."""
        x, y, z = forward(self.arm, np.asarray(joints, dtype=np.float64))[:3, 3].tolist()
        return x, y, z

    def timed(self, action: Follow | FollowJoints, joints: Array) -> TimedPath:
        """Joint angles over time for an action that begins at joint angles (n,) rad.

        Raises:
            MotionError: it leaves the work space, the reach or a joint's range, is too fast, or begins
                elsewhere.
        """
        if isinstance(action, Follow):
            return self.follow(action.vertices, joints)
        return self._joint_path(action, joints)

    def follow(self, vertices: Array, joints: Array) -> TimedPath:
        """Along a polyline of the tool point (n, 3) mm, from joint angles (n,) rad, with the least tilt.

        Sharp corners are stopped at; fine ones, of a curve cut into pieces, are driven through.

        Raises:
            MotionError: as `timed`.
        """
        points = checked_path(vertices, self.tool(joints), self.space, START_TOLERANCE)
        runs, here = [], joints
        for points_of_run in _runs(points):
            runs.append(self._run(points_of_run, here))
            here = runs[-1].joints[-1]
        return _joined(runs, joints)

    def retract(self, joints: Array) -> TimedPath:
        """Straight up to the top of the work space, or as far as the arm reaches.

        Raises:
            MotionError: a joint comes to its limit on the way.
        """
        x, y, z = self.tool(joints)
        top = max(self.space.upper[2], z)
        ways = self._rows(np.array([[x, y, z], [x, y, top]]), self.posed(joints))
        reached = (rows[: self._reached(rows)] for rows in ways)
        return self._paced([through(self.arm, rows, _TITLE) for rows in reached], joints)

    def _reached(self, rows: Array) -> int:
        """So many of the poses (m, 5), from the first on, are within reach one after the other."""
        joints = joints_at(self.arm, rows)
        lost = np.isnan(joints[:, 0])
        lost[1:] |= (np.abs(np.diff(joints, axis=0)) > _LEAP).any(axis=1)
        return int(lost.argmax()) if lost.any() else len(rows)

    def straight(self, point: Array, joints: Array) -> TimedPath:
        """The tool point straight to (3,) mm, wherever it is now.

        Raises:
            MotionError: out of reach, or a joint comes to its limit on the way.
        """
        return self._run(np.array([self.tool(joints), point]), joints)

    def turn(self, start: Array, end: Array) -> TimedPath:
        """All joints together from (n,) rad to (n,) rad."""
        return synchronise(self.arm, start, end)

    def home(self, joints: Array) -> list[TimedPath]:
        """Home in two goes: first the joint that lifts the hand, then all others."""
        lifting, home = self.motors.order[0], self.arm.home
        up = joints.copy()
        up[lifting] = home[lifting]
        return [self.turn_freely(joints, up), self.turn_freely(up, home)]

    def turn_freely(self, start: Array, end: Array) -> TimedPath:
        """As `turn`, also beyond a joint's range: a joint that has lost its place is not where it seems."""
        beyond = np.stack([np.minimum(start, end), np.maximum(start, end)], axis=1)
        low, high = (pick(beyond, self.arm.ranges) for pick in (np.minimum, np.maximum))
        ranges = np.stack([low[:, 0], high[:, 1]], axis=1)
        return synchronise(replace(self.arm, ranges=ranges), start, end)

    # --- the tool point ------------------------------------------------------------------------------------

    def _run(self, points: Array, joints: Array) -> TimedPath:
        """Points (m, 3) without sharp corners, from rest to rest; ``joints`` is where the arm is then."""
        pieces = self._rows(points, self.posed(joints))
        return self._paced([through(self.arm, rows, _TITLE) for rows in pieces], joints)

    def _paced(self, knots: Sequence[Array], joints: Array) -> TimedPath:
        path = np.concatenate([joints[None, :], *(more[1:] for more in knots)])
        if len(path) == 1:
            return TimedPath(path, np.zeros(1))
        return paced(self.arm, rounded(self.arm, path))

    def _rows(self, points: Array, start: Pose) -> list[Array]:
        """Poses (k, 5) closely along each piece of a polyline (m, 3); tilts as `_leaning` chooses them."""
        pieces = [(a, b) for a, b in pairwise(points) if (a != b).any()]
        counts = [_stations(float(np.linalg.norm(b - a))) for a, b in pieces]
        ways = [
            a + np.linspace(0.0, 1.0, k)[:, None] * (b - a) for (a, b), k in zip(pieces, counts, strict=True)
        ]
        if not ways:
            return []
        every = np.concatenate(ways)
        azimuths = np.unwrap(np.append(start.azimuth, np.arctan2(every[:, 1], every[:, 0])))[1:]
        radii, rolls = np.hypot(every[:, 0], every[:, 1]), np.full(len(every), start.roll)
        rows = np.column_stack([azimuths, radii, every[:, 2], self._leaning(every, start), rolls])
        rows[0] = start.row
        return np.split(rows, np.cumsum(counts)[:-1])

    def _leaning(self, points: Array, start: Pose) -> Array:
        """(m,) tilts, rad, along a way of the tool point (m, 3): the least ones, approached little by little.

        Where one is out of reach the one before is kept, and the way there says what is wrong.
        """
        most = max(MOST_TILT, abs(start.tilt) + TILT_MARGIN)
        tilt, before, out = start.tilt, points[0], list[float]()
        for point, (low, high) in zip(points, tilt_range(self.arm, points, most, start.roll), strict=True):
            change = _TILT_PER_MM * float(np.linalg.norm(point - before))
            if np.isfinite(low):
                wanted = min(max(least_of(low, high), tilt - change), tilt + change)
                tilt = min(max(wanted, low), high)
            out.append(tilt)
            before = point
        return np.array(out)

    def posed(self, joints: Array) -> Pose:
        """The hand at joint angles that hold the arm ahead with its elbow up, as guided motion keeps it.

        Raises:
            MotionError: they do not.
        """
        within = np.clip(joints, *self.arm.ranges.T)  # whole steps may be half a step beyond
        pose = pose_of(self.arm, within)
        same = joints_at(self.arm, pose.row[None, :])[0]
        if not np.isfinite(same).all() or float(np.abs(same - within).max()) > _SAME:
            raise MotionError(
                f"{_TITLE}: the arm is turned over or its elbow is down; the tool point cannot be guided "
                "from here. Nothing was sent.",
                hint="Home it first.",
            )
        return pose

    # --- joints --------------------------------------------------------------------------------------------

    def _joint_path(self, action: FollowJoints, joints: Array) -> TimedPath:
        vertices = np.asarray(action.vertices, dtype=np.float64)
        times = np.asarray(action.times, dtype=np.float64)
        self._check_shape(vertices, times)
        inside = np.clip(vertices, *self.arm.ranges.T)
        if (np.abs(vertices - inside) > self.motors.gearing.resolution()).any():
            require_ranges(self.arm, vertices, "Turning the joints")
        self._check_start(vertices[0], joints)
        self._check_speed(vertices, times)
        return TimedPath(inside, times)

    def _check_shape(self, vertices: Array, times: Array) -> None:
        if vertices.ndim != 2 or vertices.shape[1:] != (self.arm.n,) or times.shape != vertices.shape[:1]:  # noqa: PLR2004
            raise MotionError(
                f"A path of joint angles has the shape {vertices.shape} and times {times.shape}, wanted "
                f"(n, {self.arm.n}) and (n,).",
                hint="This is a fault; report it.",
            )
        finite = np.isfinite(vertices).all() and np.isfinite(times).all()
        if not (len(times) and finite and times[0] == 0 and (np.diff(times) > 0).all()):
            raise MotionError(
                "A path of joint angles must be finite, with times that rise from 0.",
                hint="This is a fault; report it.",
            )

    def _check_start(self, first: Array, joints: Array) -> None:
        allowed = 2.0 * self.motors.gearing.resolution() + _REPORTED
        apart = np.abs(first - joints)
        worst = int((apart - allowed).argmax())
        if apart[worst] > allowed[worst]:
            raise MotionError(
                f"A path begins with {self.arm.joint_names[worst]} at {np.degrees(first[worst]):.3f}°, it is "
                f"at {np.degrees(joints[worst]):.3f}°: {np.degrees(apart[worst]):.3f}° apart, allowed "
                f"{np.degrees(allowed[worst]):.3f}°. Nothing was sent.",
                hint="Plan again from where the arm is.",
            )

    def _check_speed(self, vertices: Array, times: Array) -> None:
        if len(times) < 2:  # noqa: PLR2004
            return
        share = np.abs(np.diff(vertices, axis=0)) / np.diff(times)[:, None] / self.arm.velocity
        piece, joint = np.unravel_index(int(share.argmax()), share.shape)
        if share[piece, joint] > _TOO_FAST:
            limit = float(np.degrees(self.arm.velocity[joint]))
            raise MotionError(
                f"Between vertices {piece} and {piece + 1} the {self.arm.joint_names[joint]} would turn at "
                f"{limit * share[piece, joint]:.1f}°/s, its limit is {limit:.1f}°/s. Nothing was sent.",
                hint="Plan with the arm's own parameter file.",
            )


_SAME = 0.01  # rad
_STATION = 6.0  # mm between places of a way at which tilts are chosen
_FEWEST, _MOST = 9, 129  # of them in a piece
_TILT_PER_MM = 0.015  # rad: faster the tilt does not change along a way
_TILT_STEP = 0.02  # rad that the tilt may change in one piece of a jog
_REPORTED = 2e-4  # rad: positions are reported with three decimals of a degree


class JogPath:
    """A jog of the tool point along straight lines, one short piece after the other.

    Args:
        paths: Of the arm.
        joints: (n,) rad at its beginning.

    Attributes:
        joints: Where the last piece ends.
    """

    def __init__(self, paths: ArmPaths, joints: Array) -> None:
        self.joints = joints
        self._paths = paths
        self._row = paths.posed(joints).row
        self._point = np.array(paths.tool(joints))

    def go_on(self, velocity: Array, seconds: float) -> float:
        """Move `joints` on by about ``seconds`` at ``velocity`` (3,) mm/s; how long that takes, s.

        Longer where a joint would be too fast; 0 at the edge of what the arm reaches.
        """
        arm, space = self._paths.arm, self._paths.space
        low, high = np.minimum(self._point, space.lower), np.maximum(self._point, space.upper)
        point = np.clip(self._point + velocity * seconds, low, high)
        if float(np.abs(point - self._point).max()) < _SHORTEST:
            return 0.0
        row = self._placed(point)
        found = joints_at(arm, row[None, :])[0]
        if not np.isfinite(found).all():
            return 0.0
        turned = np.abs(found - self.joints)
        share = float((turned / arm.velocity).max())
        if float(turned.max()) > _LEAP:  # through a singular pose: the next line is not a short one
            return 0.0
        way, length = float(np.linalg.norm(point - self._point)), float(np.linalg.norm(velocity))
        self._row, self._point, self.joints = row, point, found
        return max(share, way / length)

    def _placed(self, point: Array) -> Array:
        row = self._row.copy()
        low, high = tilt_range(self._paths.arm, point, roll=row[4])
        if np.isfinite(low):
            least = min(max(0.0, low), high)
            wanted = row[3] + min(max(least - row[3], -_TILT_STEP), _TILT_STEP)
            row[3] = min(max(wanted, low), high)
        turn = float(np.arctan2(point[1], point[0])) - row[0]
        row[0] += turn - 2 * pi * round(turn / (2 * pi))
        row[1:3] = np.hypot(point[0], point[1]), point[2]
        return row


def _stations(length: float) -> int:
    return int(np.clip(np.ceil(length / _STATION) + 1, _FEWEST, _MOST))


_SHORTEST = 0.01  # mm
_LEAP = 0.5  # rad


def _runs(points: Array) -> Sequence[Array]:
    """The polyline (m, 3) cut at its sharp corners; repeated points left out."""
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 0
    kept = points[np.concatenate(([True], moved))]
    if len(kept) < 3:  # noqa: PLR2004 - no corner
        return [kept]
    ways = np.diff(kept, axis=0)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    turn = np.arccos(np.clip((ways[:-1] * ways[1:]).sum(axis=1), -1.0, 1.0))
    cuts = np.flatnonzero(turn > _SHARP) + 1
    ends = [0, *cuts.tolist(), len(kept) - 1]
    return [kept[a : b + 1] for a, b in pairwise(ends)]


def _joined(runs: Sequence[TimedPath], joints: Array) -> TimedPath:
    """One after the other, from ``joints`` (n,)."""
    parts, times, now = [joints[None, :]], [np.zeros(1)], 0.0
    for run in runs:
        parts.append(run.joints[1:])
        times.append(run.times[1:] + now)
        now += run.seconds
    return TimedPath(np.concatenate(parts), np.concatenate(times))
