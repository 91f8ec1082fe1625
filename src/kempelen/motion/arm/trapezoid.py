"""The slanted trapezoid: up and outwards, across, down, without a stop between.

Near pieces, up and down, the tool is guided along straight lines; across, in free air, the base turns while
the arm reaches out. How far the ways up and down lean towards each other, and how far corners are cut, is
tried from bold to careful, each end for itself, until nothing is nearer than the clearances ask.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import hypot
from typing import NamedTuple

import numpy as np

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.core.table import Gripper
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.chain import forward
from kempelen.motion.arm.body import Prisms, hand, prisms
from kempelen.motion.arm.guidance import BOW, Pose, arc, joints_at, pose_of, straight
from kempelen.motion.arm.obstacles import FINEST, Obstacles, gaps, lacks, obstacles
from kempelen.motion.arm.pacing import rounded
from kempelen.motion.arm.sweep import Held
from kempelen.motion.scene import Scene
from kempelen.motion.sweep import slack

FREE_BOW = 3.0
"""How far the way across may leave its line within the arm's plane, mm; what it leaves it by is swept."""
_LOOKS = 96
_OUTWARDS = np.concatenate(([0.0], np.repeat(np.arange(4.0, 124.0, 4.0), 2) * np.tile([1.0, -1.0], 30)))


class Boldness(NamedTuple):
    """How an end of the way is taken.

    Attributes:
        slant: Share of the way across that is covered while going up or down.
        corner: How much of the corner above it is cut.
        lift: How much higher that corner is than the lowest height that would do, mm.
        bow: Share of the bow that is allowed which is used.
    """

    slant: float
    corner: float
    lift: float
    bow: float


BOLDNESS = (
    Boldness(0.2, 1.0, 0.0, 1.0),
    Boldness(0.07, 1.0, 3.0, 1.0),
    Boldness(0.0, 1.0, 6.0, 1.0),
    Boldness(0.0, 0.5, 10.0, 0.2),
    Boldness(0.0, 0.3, 20.0, 0.1),
    Boldness(0.0, 0.3, 40.0, 0.05),
)
"""From bold to careful."""


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """One leg of the arm's way.

    Attributes:
        arm: Whose.
        scene: What stands, without what is held.
        start: Joint angles (n,) rad, at rest.
        end: Joint angles (n,) rad, at rest.
        held: The piece in the closed fingers; None with open fingers.
        title: For messages: ``"Carrying the white knight from g1 to f3"``.
        bow: How far guided motion may leave its line, mm.
    """

    arm: Arm
    scene: Scene
    start: Array
    end: Array
    held: Held | None
    title: str
    bow: float = BOW


def paths(task: Task) -> Iterator[Array]:
    """Ways (m, n) rad that keep the clearances where they can, boldest first, to be paced and swept.

    Raises:
        MotionError: nowhere within reach is there a way.
    """
    first, last = pose_of(task.arm, task.start), pose_of(task.arm, task.end)
    last = replace(last, azimuth=first.azimuth + float(task.end[0] - task.start[0]))
    needed = _height(task, first, last)
    levels, error = [0, 0], None
    while max(levels) < len(BOLDNESS):
        bold = BOLDNESS[levels[0]], BOLDNESS[levels[1]]
        try:
            path = _way(task, (first, last), needed, bold)
        except MotionError as failed:
            error, blocked = failed, (True, True)
        else:
            blocked = _blocked(task, path)
            if not any(blocked):
                yield path
                blocked = (True, True)
        levels = [level + hit for level, hit in zip(levels, blocked, strict=True)]
    if error is not None:
        raise error


def _way(task: Task, ends: tuple[Pose, Pose], height: float, bold: tuple[Boldness, Boldness]) -> Array:
    """The rounded path: up, across, down, as far as each is needed."""
    first, last = ends
    over = [corner_over(task.arm, ends[i], ends[1 - i], height + bold[i].lift, bold[i].slant) for i in (0, 1)]
    parts = [
        straight(task.arm, first, over[0], f"{task.title}, going up", _bow(task, first, bold[0])),
        arc(task.arm, over[0], over[1], f"{task.title}, going across", FREE_BOW),
        straight(task.arm, over[1], last, f"{task.title}, going down", _bow(task, last, bold[1])),
    ]
    knots = np.concatenate([parts[0], parts[1][1:], parts[2][1:]])
    knots[0], knots[-1] = task.start, task.end
    shares = np.ones(len(knots))
    corners = len(parts[0]) - 1, len(knots) - len(parts[2])
    for corner, one in zip(corners, bold, strict=True):
        shares[corner] = min(shares[corner], one.corner)
    keep = np.concatenate(([True], np.abs(np.diff(knots, axis=0)).max(axis=1) > _STILL))
    return rounded(task.arm, knots[keep], shares[keep][1:-1])


_STILL = 1e-9


def _bow(task: Task, end: Pose, bold: Boldness) -> float:
    """Open fingers across the arm's plane may bow within it, along the piece between them; turned, not."""
    free = task.held is not None or abs(end.roll) < _STILL
    return bold.bow * task.bow if free else min(bold.bow * task.bow, _TURNED_BOW)


_TURNED_BOW = 0.1  # mm


def corner_over(arm: Arm, end: Pose, other: Pose, height: float, slant: float) -> Pose:
    """The corner above one end, ``slant`` of the way to the other, at the nearest radius within reach."""
    if height <= end.height:
        return end
    wanted = replace(
        end,
        azimuth=end.azimuth + slant * (other.azimuth - end.azimuth),
        radius=end.radius + slant * (other.radius - end.radius),
        height=height,
    )
    rows = np.tile(wanted.row, (len(_OUTWARDS), 1))
    rows[:, 1] += _OUTWARDS
    reached = np.flatnonzero(np.isfinite(joints_at(arm, rows)).all(axis=1))
    return replace(wanted, radius=float(rows[reached[0], 1])) if len(reached) else wanted


# --- obstacles --------------------------------------------------------------------------------------------


def _columns(gripper: Gripper, held: Held | None) -> list[tuple[float, float]]:
    """The hand as upright columns: radius, and bottom from the tool point."""
    shape = held.shape if held else None
    outer = gripper.half_length_open if shape is None else shape.grip_diameter / 2 + gripper.finger_thickness
    found = [(hypot(outer, gripper.finger_width / 2), -gripper.below_tool - gripper.finger_width / 4)]
    if shape is not None:
        found.append((shape.base_diameter / 2, -shape.grip_height))
    return found


def _height(task: Task, first: Pose, last: Pose) -> float:
    """Z of the tool point, mm, at which the way across clears what stands below it."""
    share = np.linspace(0.0, 1.0, 33)[:, None]
    rows = first.row + share * (last.row - first.row)
    tool = rows[:, 1:2] * np.stack([np.cos(rows[:, 0]), np.sin(rows[:, 0])], axis=1)
    scene = task.scene
    best = _surface_height(task, tool)
    if not scene.places:
        return best
    off = np.linalg.norm(tool[:, None] - scene.centre, axis=2)  # (s, c)
    own = (
        {scene.gripped_at(tuple(pose.point.tolist())) for pose in (first, last)}
        if task.held is None
        else set()
    )
    for radius, bottom in _columns(scene.table.gripper, task.held):
        needed = scene.top + scene.clearances.vertical - bottom
        reach = scene.radius + radius + scene.clearances.lateral + FREE_BOW
        for pose, row in ((first, off[0]), (last, off[-1])):
            reach = np.where(needed > pose.height, np.minimum(reach, row - _TINY), reach)
        reach[[i for i in range(len(reach)) if i % len(scene.places) in own]] = 0.0
        below = (off < reach).any(axis=0)
        best = max(best, float(needed[below].max(initial=-np.inf)))
    for index in (one for one in own if one is not None):
        best = max(
            best,
            float(scene.top[index + len(scene.places)]) + scene.clearances.near + _tips(scene.table.gripper),
        )
    return best


_TINY = 1e-3


def _tips(gripper: Gripper) -> float:
    return gripper.below_tool + gripper.finger_width / 4


def _surface_height(task: Task, tool: Array) -> float:
    """Z at which the hand is clear of board and trays below the way."""
    gripper, near = task.scene.table.gripper, task.scene.clearances.near
    hang = max(_tips(gripper), task.held.shape.grip_height if task.held else 0.0)
    best = -np.inf
    for surface in task.scene.table.surfaces:
        u, v = surface.local(tool[:, 0], tool[:, 1])
        wide = gripper.half_length_open
        over = (u > -wide) & (u < surface.size[0] + wide) & (v > -wide) & (v < surface.size[1] + wide)
        heights = surface.height(tool[:, 0], tool[:, 1])[over]
        best = max(best, float(np.max(heights, initial=-np.inf)) + hang + near + FREE_BOW)
    return best


def _blocked(task: Task, path: Array) -> tuple[bool, bool]:
    """Whether something is nearer than the clearances ask, in the first and in the second half of a path."""
    share = (1.0 - np.cos(np.linspace(0.0, np.pi, _LOOKS))) / 2.0  # denser where pieces are near
    way = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(path, axis=0)).sum(axis=1))))
    joints = np.stack([np.interp(share * way[-1], way, column) for column in path.T], axis=1)
    scene, held = task.scene, task.held
    shape = hand(task.arm, scene.table.gripper, held.shape if held else None, held.tilt if held else 0.0)
    parts = prisms(shape, forward(task.arm, joints))
    found = _kept_away(scene, parts, open_hand=held is None)
    margin = np.full(len(joints), slack(scene) + FINEST)
    flat = [np.flatnonzero((lack > 0).any(axis=1)) for _, lack in lacks(scene, shape, parts, margin)]
    sample = np.concatenate([gaps(parts, found, margin)[0], *flat])
    return bool((sample < _LOOKS / 2).any()), bool((sample >= _LOOKS / 2).any())


def _kept_away(scene: Scene, parts: Prisms, *, open_hand: bool) -> Obstacles:
    """The cylinders grown by the clearances, as far as the ends of the way leave room for that."""
    keep = scene.clearances
    found = obstacles(scene, parts, open_hand=open_hand, lateral=keep.lateral, vertical=keep.vertical)
    ends = Prisms(*(getattr(parts, name)[[0, -1]] for name in Prisms.__slots__))
    room = slack(scene) + FINEST + _GIVE
    _, _, cylinder, gap = gaps(ends, found, np.full(2, room))
    radius = found.radius.copy()
    np.minimum.at(radius, cylinder, found.radius[cylinder] + gap - room)
    return replace(found, radius=np.where(found.own, found.radius, radius))


_GIVE = 1.0
"""By how much a guided way may be nearer to a neighbour than the end that it leads to, mm."""
