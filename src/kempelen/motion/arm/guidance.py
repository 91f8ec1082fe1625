"""Cartesian guidance: a wanted way of the tool cut into the fewest joint-synchronous pieces that bow little.

Between two postures all joints move in proportion, so the tool point leaves the line between them: it bows. A
line is cut where one more step would bow too much, each piece as long as it can be.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.batch import inverse_batch
from kempelen.kinematics.chain import forward
from kempelen.kinematics.closed import inverse

BOW = 2.0
"""How far guided motion may leave its line near pieces, mm."""
_STATIONS = 33
"""Places of a line at which it may be cut."""
_LOOKS = 9
"""Places of a piece at which its bow is looked at while cutting; twice as many when it is proven."""


Away = Callable[[Array], Array]
"""How far (...) tool points (..., 3) are from the wanted way, mm."""


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Of the hand, in the frame of the upright plane that the base turns.

    Attributes:
        azimuth: Of the plane, rad.
        radius: Of the tool point from the base's axis, mm.
        height: z of the tool point, robot frame, mm.
        tilt: From straight down, rad, tip outwards positive.
        roll: About the approach vector, rad; 0: the fingers close across the plane.
    """

    azimuth: float
    radius: float
    height: float
    tilt: float = 0.0
    roll: float = 0.0

    @property
    def row(self) -> Array:
        """(5,) the five numbers."""
        return np.array([self.azimuth, self.radius, self.height, self.tilt, self.roll])

    @property
    def point(self) -> Array:
        """(3,) the tool point, robot frame, mm."""
        return np.array([
            self.radius * np.cos(self.azimuth),
            self.radius * np.sin(self.azimuth),
            self.height,
        ])  # fmt: skip


def pose_of(arm: Arm, joints: Array) -> Pose:
    """Where joint angles (5,) rad hold the hand."""
    matrix = forward(arm, joints)
    x, y, z = matrix[:3, 3].tolist()
    azimuth = float(np.arctan2(y, x))
    outwards = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    across = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    tilt = float(np.arctan2(matrix[:3, 2] @ outwards, -matrix[2, 2]))
    roll = float(np.arctan2(matrix[:3, 0] @ across, matrix[:3, 1] @ across))
    return Pose(azimuth, float(np.hypot(x, y)), z, tilt, roll)


def joints_at(arm: Arm, rows: Array) -> Array:
    """Joint angles (m, n) rad of poses (m, 5), arm ahead and elbow up; NaN where it does not reach."""
    points = np.stack([rows[:, 1] * np.cos(rows[:, 0]), rows[:, 1] * np.sin(rows[:, 0]), rows[:, 2]], axis=1)
    found = inverse_batch(arm, points, pi - rows[:, 3], rows[:, 4], flipped=False)
    return np.where(found.within[:, :1], found.joints[:, 0, :], np.nan)


def posture(arm: Arm, pose: Pose, title: str) -> Array:
    """Joint angles (n,) rad of one pose.

    Raises:
        MotionError: out of reach, with the joint or the distance and by how much.
    """
    joints: Array = joints_at(arm, pose.row[None, :])[0]
    if np.isfinite(joints).all():
        return joints
    raise _unreached(arm, pose.row, title)


def straight(arm: Arm, start: Pose, end: Pose, title: str, bow: float = BOW) -> Array:
    """Knots (k, n) rad of a straight way of the tool point, in the fewest pieces that bow at most ``bow`` mm.

    Tilt and roll change evenly along the way.

    Raises:
        MotionError: a joint comes to its limit on the way, or the way leads through a singular pose: where.
    """
    share = np.linspace(0.0, 1.0, _STATIONS)[:, None]
    points = start.point + share * (end.point - start.point)
    rows = start.row + share * (end.row - start.row)
    rows[:, 0] = _unwound(np.arctan2(points[:, 1], points[:, 0]), start.azimuth)
    rows[:, 1] = np.hypot(points[:, 0], points[:, 1])
    rows[0], rows[-1] = start.row, end.row
    return through(arm, rows, title, bow)


def through(arm: Arm, rows: Array, title: str, bow: float = BOW) -> Array:
    """Knots (k, n) rad of a straight way of the tool point whose tilts and rolls are given: poses (m, 5).

    Raises:
        MotionError: as `straight`.
    """
    start, end = Pose(*rows[0].tolist()).point, Pose(*rows[-1].tolist()).point

    def away(tool: Array) -> Array:
        return _from_segment(tool, start, end)

    return _cut(arm, rows, away, bow, title)


def arc(arm: Arm, start: Pose, end: Pose, title: str, bow: float) -> Array:
    """Knots (k, n) rad of a way that is straight in azimuth, radius and height.

    Raises:
        MotionError: as `straight`.
    """
    rows = start.row + np.linspace(0.0, 1.0, _STATIONS)[:, None] * (end.row - start.row)
    middle, half = (start.radius + end.radius) / 2, (end.azimuth - start.azimuth) / 2
    first = np.array([0.0, start.radius, start.height])
    last = np.array([middle * (end.azimuth - start.azimuth), end.radius, end.height])

    def away(tool: Array) -> Array:
        turned = half + _unwound_by(np.arctan2(tool[..., 1], tool[..., 0]) - start.azimuth - half)
        flat = np.stack([middle * turned, np.hypot(tool[..., 0], tool[..., 1]), tool[..., 2]], axis=-1)
        return _from_segment(flat, first, last)

    return _cut(arm, rows, away, bow, title)


def bow_of(arm: Arm, knots: Array, start: Array, end: Array, looks: int = 64) -> float:
    """How far the tool point leaves the line from ``start`` to ``end`` (3,) between knots (k, n), mm."""
    share = np.linspace(0.0, 1.0, looks)[:, None, None]
    between = knots[:-1] + share * (knots[1:] - knots[:-1])
    return float(_from_segment(forward(arm, between)[..., :3, 3], start, end).max(initial=0.0))


def _cut(arm: Arm, rows: Array, away: Away, bow: float, title: str) -> Array:
    stations = joints_at(arm, rows)
    lost = np.flatnonzero(~np.isfinite(stations).all(axis=1))
    if len(lost):
        raise _unreached(arm, rows[lost[0]], f"{title}, {100 * lost[0] / (len(rows) - 1):.0f} % of the way")
    share = np.linspace(0.0, 1.0, _LOOKS)[1:-1, None, None]
    chosen = [0]
    while chosen[-1] < len(rows) - 1:
        first, rest = stations[chosen[-1]], stations[chosen[-1] + 1 :]
        between = first + share * (rest - first)  # (looks, rest, n)
        bows = away(forward(arm, between)[..., :3, 3]).max(axis=0)
        fitting = np.flatnonzero(bows <= bow)
        if not len(fitting):
            raise MotionError(
                f"{title}: near a singular pose, {100 * chosen[-1] / (len(rows) - 1):.0f} % of the way, even "
                f"the shortest piece bows {bows[0]:.1f} mm; {bow:.1f} mm is allowed. Nothing was sent.",
                hint="Move the board so that the arm is neither stretched nor folded over it.",
            )
        chosen.append(chosen[-1] + 1 + int(fitting[-1]))
    return stations[chosen]


def _from_segment(points: Array, start: Array, end: Array) -> Array:
    """(...) distances of points (..., d) from the segment between two (d,)."""
    along = end - start
    square = float(along @ along)
    share = (
        np.clip(((points - start) @ along) / square, 0.0, 1.0) if square > 0 else np.zeros(points.shape[:-1])
    )
    off: Array = np.linalg.norm(points - start - share[..., None] * along, axis=-1)
    return off


def _unwound_by(angle: Array) -> Array:
    out: Array = (angle + np.pi) % (2 * np.pi) - np.pi
    return out


def _unwound(angles: Array, near: float) -> Array:
    out: Array = np.unwrap(np.concatenate(([near], angles)))[1:]
    return out


def _unreached(arm: Arm, row: Array, title: str) -> MotionError:
    pose = Pose(*row.tolist())
    try:
        inverse(arm, pose.point, pi - pose.tilt, pose.roll)
    except MotionError as error:
        return MotionError(f"{title}: {error.message} Nothing was sent.", hint=error.hint)
    return MotionError(
        f"{title}: at a radius of {pose.radius:.0f} mm and z = {pose.height:.0f} mm the arm would have to "
        "turn over. Nothing was sent.",
        hint="Move the board or the tray within the arm's reach.",
    )
