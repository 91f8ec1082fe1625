"""MuJoCo bodies of what stands still and of the pieces.

Contacts are made of the cheapest exact pairs (sphere-box, capsule-box). A piece stands on a ring of small
feet, is gripped by its stem and may lie on stem and head; its base meets other pieces and the fingers only.
"""

import math
from enum import IntFlag
from typing import Any

import mujoco
import numpy as np

from kempelen.core.geometry import Array, Transform
from kempelen.core.pieces import PieceShape
from kempelen.twin.physics.appearance import BLACK, HIDDEN, TABLE, WHITE, Rgba, add_board_paint, add_paint
from kempelen.twin.physics.scene import KINDS_BY_LETTER, TRAY_THICKNESS, Scene, StandingPiece
from kempelen.twin.physics.units import KILOGRAMS, METRES

FEET = 8
FOOT_RADIUS = 1.5
FELT_FRICTION = 0.3
"""Of a felt or polished base on wood: below base radius over grip height, so that a pushed piece slides."""
FELT = (0.008, 1.0)
"""Time constant (s) and damping ratio of a landing: smooth at the time step, no bouncing."""
CENTRE_OF_MASS = 0.3
"""Height of the centre of mass over the piece's height: sets worth playing with are weighted."""
TABLE_HALF = 6.0
"""Half the side of the table top, m: as far as any camera sees."""


class Touch(IntFlag):
    """Collision groups: two geoms meet when one's group is among the other's partners."""

    NOTHING = 0
    SURFACE = 1
    PIECE = 2
    GRIPPER = 4


def quaternion(transform: Transform) -> Array:
    """(4,) w x y z of a transform's rotation."""
    out = np.zeros(4)
    mujoco.mju_mat2Quat(out, transform.rotation.flatten())
    return out


def add_surfaces(spec: Any, scene: Scene) -> None:
    """Table top, board with its squares, trays."""
    table = scene.table
    board = spec.worldbody.add_body(
        name="board", pos=table.robot_from_board.translation * METRES, quat=quaternion(table.robot_from_board)
    )
    side, look = 8 * table.square, scene.look
    edge = side / 2 + look.border_width
    middle, half = np.array([side / 2, side / 2, 0.0]), np.array([edge, edge, scene.board_thickness / 2])
    _add_slab(board, "board", middle, half, (*look.border, 1.0))
    for tray in table.trays:
        first, last = tray.centre(1), tray.centre(tray.rows * tray.columns)
        half = np.array([*((last - first)[:2] + tray.pitch) / 2, TRAY_THICKNESS / 2])
        _add_slab(board, tray.name, (first + last) / 2, half, (*look.tray, 1.0))
    add_board_paint(board, table.square, look)
    spec.worldbody.add_geom(
        name="table", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(TABLE_HALF, TABLE_HALF, 0.1), material=TABLE,
        pos=(0.0, 0.0, scene.table_top * METRES), contype=Touch.SURFACE, conaffinity=0,
        friction=_friction(FELT_FRICTION),
    )  # fmt: skip


def _add_slab(body: Any, name: str, top: Array, half: Array, rgba: Rgba) -> None:
    """A box by its top's middle and its half sizes, mm."""
    body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_BOX, rgba=rgba, pos=(top - [0.0, 0.0, half[2]]) * METRES,
        size=half * METRES, contype=Touch.SURFACE, conaffinity=0, friction=_friction(FELT_FRICTION),
    )  # fmt: skip


def _friction(sliding: float) -> tuple[float, float, float]:
    return (sliding, 0.005, 0.0001)


def add_piece(spec: Any, piece: StandingPiece, shape: PieceShape, up: Transform) -> None:
    """A free body whose origin is the base's centre and whose z axis is its own.

    Args:
        spec: MjSpec to add to.
        piece: Where it stands.
        shape: Its measures.
        up: Rotation of the surface that it stands on.
    """
    pose = up @ Transform.about_z(piece.turn)
    body = spec.worldbody.add_body(
        name=piece.piece_id, pos=np.array([piece.x, piece.y, piece.z]) * METRES, quat=quaternion(pose)
    )
    body.add_freejoint(name=piece.piece_id)
    _add_inertia(body, shape)
    _add_feet(body, shape)
    _add_column(body, shape)
    add_paint(body, KINDS_BY_LETTER[piece.kind], shape, WHITE if piece.white else BLACK)


def _add_inertia(body: Any, shape: PieceShape) -> None:
    mass = shape.mass * KILOGRAMS
    base, height = shape.base_diameter / 2 * METRES, shape.height * METRES
    across = mass * (base**2 / 4 + (0.7 * height) ** 2 / 12)
    body.explicitinertial = True
    body.mass = mass
    body.ipos = (0.0, 0.0, CENTRE_OF_MASS * height)
    body.inertia = (across, across, mass * base**2 * 0.35)


def _add_feet(body: Any, shape: PieceShape) -> None:
    ring = shape.base_diameter / 2 - FOOT_RADIUS
    for i in range(FEET):
        angle = math.tau * i / FEET
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(FOOT_RADIUS * METRES, 0, 0), group=HIDDEN,
            pos=np.array([ring * math.cos(angle), ring * math.sin(angle), FOOT_RADIUS]) * METRES,
            contype=0, conaffinity=Touch.SURFACE,
            friction=_friction(FELT_FRICTION), condim=3, priority=1, solref=FELT,
        )  # fmt: skip


def _add_column(body: Any, shape: PieceShape) -> None:
    """Base disc, stem and head."""
    head, stem = shape.head_diameter / 2, shape.grip_diameter / 2
    disc = base_height(shape)
    common = {"group": HIDDEN, "contype": int(Touch.PIECE), "friction": _friction(FELT_FRICTION), "condim": 3}
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=(0, 0, (disc + 0.5) / 2 * METRES),
        size=(shape.base_diameter / 2 * METRES, (disc - 0.5) / 2 * METRES, 0),
        conaffinity=Touch.PIECE | Touch.GRIPPER, **common,
    )  # fmt: skip
    solid = Touch.SURFACE | Touch.PIECE | Touch.GRIPPER
    low, high = stem + 0.5, shape.height - max(head, stem)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=(stem * METRES, 0, 0), conaffinity=solid,
        fromto=np.array([0, 0, low, 0, 0, max(high, low + 1)]) * METRES, **common,
    )  # fmt: skip
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(head * METRES, 0, 0), conaffinity=solid,
        pos=(0, 0, (shape.height - head) * METRES), **common,
    )  # fmt: skip


def base_height(shape: PieceShape) -> float:
    """Thickness of the foot disc, mm."""
    return min(8.0, 0.15 * shape.height)
