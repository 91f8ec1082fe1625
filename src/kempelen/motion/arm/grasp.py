"""How the gripper stands at a place: which tilt, which roll, and where it waits.

The fingers close across the arm's upright plane, so that tilting turns the pads about their own closing
axis. Pads that hang on that axis keep the piece upright at any tilt. Between rigid ones, let go at another
tilt than it was gripped at, it would lean: one tilt serves both ends of a transfer.
"""

from functools import lru_cache

import numpy as np

from kempelen.core.errors import ReachError
from kempelen.core.geometry import Array
from kempelen.core.pieces import piece_name
from kempelen.core.places import Transfer
from kempelen.core.table import Table
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.chain import forward, frames
from kempelen.kinematics.tilt import tilt_range
from kempelen.motion.arm.body import capsules, hand, hand_capsule, prisms
from kempelen.motion.arm.guidance import Pose, joints_at
from kempelen.motion.arm.links import room_within
from kempelen.motion.arm.obstacles import gaps, obstacles
from kempelen.motion.scene import Scene

TILT_MARGIN = float(np.radians(1.0))
"""How far inside the possible tilts one is chosen, if there is room: at their ends the arm is stretched."""
_ROLLS = np.radians([0.0, 15.0, -15.0, 30.0, -30.0, 45.0, -45.0, 60.0, -60.0, 75.0, -75.0, 90.0])
_LOOK = 30.0
"""Neighbours farther from the fingers than this do not matter, mm."""


def transfer_tilts(arm: Arm, table: Table, transfer: Transfer) -> tuple[float, float]:
    """The tilts, rad, at which a piece is gripped and let go: one for both, the least that both ends allow.

    Where no tilt serves both ends, hanging pads, which keep the piece upright at any, take the least of each.

    Raises:
        ReachError: out of reach; or rigid pads, and no tilt serves both ends: which end allows which.
    """
    kind = transfer.piece.piece_type
    points = np.array([table.grip_point(transfer.source, kind), table.release_point(transfer.target, kind)])
    ranges = tilt_range(arm, points)
    low, high = float(ranges[:, 0].max()), float(ranges[:, 1].min())
    if low <= high:
        return least_of(low, high), least_of(low, high)
    if np.isnan(ranges).any() or not table.gripper.plumb:
        raise _no_tilt(arm, transfer, ranges)
    first, last = (least_of(*ends) for ends in ranges.tolist())
    return first, last


def least_of(low: float, high: float) -> float:
    """The tilt nearest to straight down that keeps its distance from the ends of a range, rad."""
    margin = min(TILT_MARGIN, (high - low) / 2)
    return float(np.clip(0.0, low + margin, high - margin))


def _no_tilt(arm: Arm, transfer: Transfer, ranges: Array) -> ReachError:
    ends = (
        f"{place}: " + ("out of reach" if np.isnan(row).any() else f"{row[0]:.0f}° to {row[1]:.0f}°")
        for place, row in zip((transfer.source, transfer.target), np.degrees(ranges), strict=True)
    )
    why = (
        "it is out of reach" if np.isnan(ranges).any() else "no tilt of the gripper is possible at both ends"
    )
    return ReachError(
        f"The {piece_name(transfer.piece)} cannot be carried from {transfer.source} to {transfer.target} by "
        f"{arm.title or arm.name}: {why} ({', '.join(ends)}).",
        hint="Move board and trays nearer together, or let the pads hang (gripper.plumb = true): rigid ones "
        "must let go at the tilt at which they gripped.",
    )


def pose_over(point: Array, tilt: float = 0.0, roll: float = 0.0) -> Pose:
    """The hand's pose with the tool point at (3,) mm."""
    x, y, z = point.tolist()
    return Pose(float(np.arctan2(y, x)), float(np.hypot(x, y)), z, tilt, roll)


def transfer_rolls(
    arm: Arm, scene: Scene, transfer: Transfer, tilts: tuple[float, float]
) -> tuple[float, float]:
    """The rolls, rad, at which open fingers around a piece stay farthest from its neighbours, at both ends.

    No turn (0) is best wherever it leaves `_ENOUGH` room. Only straight down is there a choice: turned while
    leaning, the fingers would not stand upright beside the piece.

    Args:
        arm: Whose.
        scene: With the piece on its source.
        transfer: What is carried.
        tilts: Of the gripper at the source and at the target, rad.
    """
    kind = transfer.piece.piece_type
    source = scene.table.grip_point(transfer.source, kind)
    target = scene.table.release_point(transfer.target, kind)
    if max(map(abs, tilts)) > _UPRIGHT:
        return 0.0, 0.0
    rooms = _room(arm, scene, source), _room(arm, scene.without(transfer.source), target)
    first, last = (0.0 if room[0] >= _ENOUGH else float(_ROLLS[int(room.argmax())]) for room in rooms)
    return first, last


def _room(arm: Arm, scene: Scene, point: Array) -> Array:
    """(m,) least distance of the open fingers at a point (3,) from what stands around it, per roll, mm."""
    room = np.full(len(_ROLLS), _LOOK)
    rows = np.tile(pose_over(point).row, (len(_ROLLS), 1))
    rows[:, 4] = _ROLLS
    joints = joints_at(arm, rows)
    reached = np.asarray(np.isfinite(joints).all(axis=1))
    room[~reached] = -np.inf
    if not scene.places or not reached.any():
        return room
    shape = hand(arm, scene.table.gripper, None)
    parts = prisms(shape, forward(arm, np.where(reached[:, None], joints, arm.home)))
    found = obstacles(scene, parts, open_hand=True)
    sample, part, cylinder, gap = gaps(parts, found, room.clip(0.0))
    others = (part < _FINGERS) & ~found.own[cylinder]
    np.minimum.at(room, sample[others], gap[others])
    return room


_FINGERS = 2  # the hand's first parts
_UPRIGHT = 1e-6
_ENOUGH = 0.5  # mm, the machine's own inaccuracy included


# --- waiting ----------------------------------------------------------------------------------------------


def park_joints(arm: Arm, table: Table, near: Array) -> Array:
    """Where the arm waits, (n,) rad: all of it beside the board as seen from above, soon reached.

    Without a turn of the base if that is possible: no stop of the joint that loses most at each.
    """
    joints, clear = _waiting(arm, table)
    enough = min(table.aside + _VIEW, float(clear.max()) - _TINY)
    here = _folded(arm, table, near[:1])
    beside = here[_beside_board(arm, table, here) >= enough] if len(here) else here
    good = beside if len(beside) else joints[clear >= enough]
    travel = (np.abs(good - near) / arm.velocity).max(axis=1)
    found: Array = good[int(travel.argmin())]
    return found


_VIEW = 2.0  # mm
_TINY = 1e-6


@lru_cache(maxsize=8)
def _waiting(arm: Arm, table: Table) -> tuple[Array, Array]:
    """Folded postures (m, n) rad and how far they are from the board in plan (m,), mm; below 0 over it."""
    low, high = arm.ranges[0]
    azimuths = np.append(np.linspace(low, high, 64), 0.0)
    joints = np.concatenate((_folded(arm, table, azimuths), arm.home[None]))
    return joints, _beside_board(arm, table, joints)


def _folded(arm: Arm, table: Table, azimuths: Array) -> Array:
    """(m, n) rad, with the hand near the base and at the height of parking."""
    rows = np.array([
        (azimuth, radius, table.park_height + lift, 0.0, 0.0)
        for azimuth in azimuths[np.abs(azimuths) <= _BEHIND]
        for radius in np.arange(60.0, 240.0, 10.0)
        for lift in (10.0, 60.0, 110.0)
    ]).reshape(-1, 5)  # fmt: skip
    joints = joints_at(arm, rows)
    joints = joints[np.isfinite(joints).all(axis=1)]
    at = frames(arm, joints)
    room = room_within(arm, capsules(arm, at), at, hand(arm, table.gripper, None))
    folded: Array = joints[room > _ROOM]
    return folded


_BEHIND = np.radians(135.0)
_ROOM = 5.0  # mm between the arm's own parts where it waits


def _beside_board(arm: Arm, table: Table, joints: Array) -> Array:
    at = frames(arm, joints)
    found, shape = capsules(arm, at), hand(arm, table.gripper, None)
    tip, root, radius = hand_capsule(shape, at[:, -1])
    share = np.linspace(0.0, 1.0, 7)[:, None, None, None]
    start = np.concatenate((found.start, tip[:, None]), axis=1)
    end = np.concatenate((found.end, root[:, None]), axis=1)
    points = start + share * (end - start)  # (7, m, b, 3)
    board = table.surfaces[0]
    u, v = board.local(points[..., 0], points[..., 1])
    du = np.maximum(-u, u - board.size[0])
    dv = np.maximum(-v, v - board.size[1])
    outside = np.hypot(np.maximum(du, 0.0), np.maximum(dv, 0.0)) + np.minimum(np.maximum(du, dv), 0.0)
    out: Array = (outside - np.append(found.radius, radius)).min(axis=(0, 2))
    return out
