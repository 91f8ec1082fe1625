"""The virtual person's hand and forearm as cameras see them; nothing can be touched by them.

The hand's frame has its origin between the finger tips, z up, and x towards the elbow.
"""

import math
from typing import Any

import mujoco
import numpy as np

from kempelen.core.geometry import Array, Transform
from kempelen.core.table import Table
from kempelen.twin.physics.appearance import PAINT
from kempelen.twin.physics.bodies import quaternion
from kempelen.twin.physics.scene import Scene
from kempelen.twin.physics.units import METRES

HAND = "person"
"""Name of the body."""
_AWAY = 450.0
"""From the board's edge to where the hand rests, mm: out of sight of a camera over the board."""
_LEVEL = 120.0
"""Of the resting hand above the board, mm."""
_SHOULDER = 350.0
"""From the resting hand on to the shoulder, mm."""

# Capsules: from, to (mm), radius; skin or sleeve.
_FINGERS = (
    ((0, 9, 4), (34, 17, 42), 7.5),
    ((34, 17, 42), (74, 20, 52), 8.5),
    ((0, -9, 4), (22, -26, 34), 8.5),
    ((22, -26, 34), (78, -26, 48), 10.0),
    ((14, 21, 16), (44, 32, 46), 7.5),
    ((44, 32, 46), (80, 28, 52), 8.5),
    ((24, 36, 24), (52, 44, 46), 7.0),
    ((52, 44, 46), (84, 34, 50), 8.0),
)
_PALM = ((96, 4, 56), (36, 38, 17))
_WRIST = ((120, 4, 60), (175, 2, 82), 27.0)
_SLEEVE = (((170, 2, 80), (430, 0, 190), 39.0), ((430, 0, 190), (820, 0, 330), 50.0))
Point3 = tuple[float, float, float]


def add_hand(spec: Any, scene: Scene) -> None:
    """The body, moved from outside; at rest at first."""
    at_white, look = scene.person == "white", scene.look
    pose = hand_pose(scene.table, resting_place(scene.table, at_white=at_white), at_white=at_white)
    body = spec.worldbody.add_body(
        name=HAND, mocap=True, pos=pose.translation * METRES, quat=quaternion(pose)
    )
    skin, sleeve = (*look.skin, 1.0), (*look.sleeve, 1.0)
    for start, end, radius in (*_FINGERS, _WRIST):
        _limb(body, start, end, radius, skin)
    for start, end, radius in _SLEEVE:
        _limb(body, start, end, radius, sleeve)
    middle, half = _PALM
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID, pos=np.array(middle) * METRES, size=np.array(half) * METRES,
        rgba=skin, **_painted(),
    )  # fmt: skip


def _limb(body: Any, start: Point3, end: Point3, radius: float, rgba: Any) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=np.array([*start, *end]) * METRES,
        size=(radius * METRES, 0, 0), rgba=rgba, **_painted(),
    )  # fmt: skip


def _painted() -> dict[str, Any]:
    return {"contype": 0, "conaffinity": 0, "group": PAINT, "mass": 0.0}


def resting_place(table: Table, *, at_white: bool) -> Array:
    """(3,) where the hand is when it has nothing to do: beside the board, robot frame, mm."""
    side = 8 * table.square
    y = -_AWAY if at_white else side + _AWAY
    return table.robot_from_board @ np.array([side / 2, y, _LEVEL])


def hand_pose(table: Table, tip: Array, *, at_white: bool) -> Transform:
    """robot_from_hand with the finger tips at ``tip`` (3,) mm and the forearm towards the person."""
    way = _SHOULDER * (-1.0 if at_white else 1.0) * table.robot_from_board.rotation[:, 1]
    shoulder = resting_place(table, at_white=at_white) + way
    return Transform.about_z(math.atan2(shoulder[1] - tip[1], shoulder[0] - tip[0]), tip)
