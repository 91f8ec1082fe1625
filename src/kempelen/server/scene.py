"""What stands still in the 3D view, and the shapes of what moves; told once."""

import chess
import numpy as np

from kempelen.core.geometry import Array, Transform
from kempelen.core.pieces import KINDS, PieceShape
from kempelen.core.table import Gripper, Table, Tray, WorkSpace
from kempelen.kinematics import Arm
from kempelen.server.model import Model
from kempelen.server.topics import Point
from kempelen.twin.look import DEFAULT_LOOK

BOARD_THICKNESS = 20.0
"""Of the board as drawn, mm: the twin's; an arm stands on the table that the board lies on."""
_DIGITS = 2  # of a millimetre


class ShapeView(Model):
    """One kind of piece, mm, as `kempelen.core.pieces.PieceShape`."""

    height: float
    base_diameter: float
    head_diameter: float
    grip_height: float
    grip_diameter: float


class BoardView(Model):
    """The board.

    Attributes:
        origin: a1's outer corner on the playing surface, mm, robot frame.
        quaternion: w, x, y, z of robot_from_board; the board's x runs to h1, its y to a8.
        square: Side of a square, mm.
        border: Of the board around its squares, mm, as drawn.
        thickness: Of the board, mm, as drawn: the table top is so far below the playing surface.
    """

    origin: Point
    quaternion: tuple[float, float, float, float]
    square: float
    border: float
    thickness: float


class SlotView(Model):
    """A slot of a tray: its name and its centre, mm, robot frame."""

    name: str
    at: Point


class TrayView(Model):
    """A tray.

    Attributes:
        pitch: Distance of neighbouring slots, mm.
        rows: Slots along the board's y.
        columns: Slots along the board's x.
        slots: In order of their numbers: along the rows first.
    """

    name: str
    pitch: float
    rows: int
    columns: int
    slots: tuple[SlotView, ...]


class GripperView(Model):
    """The hand, mm, as `kempelen.core.table.Gripper`."""

    closing_axis: float
    plumb: bool
    opening: float
    finger_thickness: float
    finger_width: float
    below_tool: float
    finger_length: float
    palm_radius: float


class SpaceView(Model):
    """The box that the tool point can reach, mm, robot frame."""

    lower: Point
    upper: Point


class LinkView(Model):
    """One row of an arm's table by Denavit and Hartenberg.

    The frame after joint q is that before it turned about z by q + ``offset``, shifted along z by ``d``, then
    along x by ``a``, then turned about x by ``alpha``.

    Attributes:
        a: mm.
        alpha: rad.
        d: mm.
        offset: rad.
    """

    a: float
    alpha: float
    d: float
    offset: float


class ArmView(Model):
    """An arm: its foot at the robot frame's origin, its last frame at the tool point, z the way it points.

    Attributes:
        home: Joint angles where homing ends, rad: how it stands until more is known.
    """

    links: tuple[LinkView, ...]
    home: tuple[float, ...]


class SceneGeometry(Model):
    """All that stands still, and the shapes of what moves.

    Attributes:
        robot_kind: Name of the driver.
        live: Whether poses are the physics' own (twin) rather than the journal's.
        shapes: By letter, ``K`` to ``P``.
    """

    robot_kind: str
    live: bool
    board: BoardView
    trays: tuple[TrayView, ...]
    gripper: GripperView
    space: SpaceView
    shapes: dict[str, ShapeView]
    arm: ArmView | None = None


def scene_geometry(table: Table, *, robot_kind: str, live: bool, arm: Arm | None = None) -> SceneGeometry:
    """What the 3D view is built from.

    Args:
        table: As it is in use: as configured and calibrated.
        robot_kind: Name of the driver.
        live: Whether the twin's own poses are to be had.
        arm: The robot, if it is an arm.
    """
    level = float(table.robot_from_board.translation[2])
    return SceneGeometry(
        robot_kind=robot_kind,
        live=live,
        board=BoardView(
            origin=_point(table.robot_from_board.translation),
            quaternion=quaternion(table.robot_from_board),
            square=table.square,
            border=DEFAULT_LOOK.border_width,
            thickness=BOARD_THICKNESS if arm is None else max(BOARD_THICKNESS, level),
        ),
        trays=tuple(_tray(table, tray) for tray in table.trays),
        gripper=_gripper(table.gripper),
        space=_space(table.space),
        shapes={chess.piece_symbol(kind).upper(): _shape(table.pieces[kind]) for kind in KINDS},
        arm=None if arm is None else _arm(arm),
    )


def _arm(arm: Arm) -> ArmView:
    return ArmView(
        links=tuple(LinkView(**link._asdict()) for link in arm.links), home=tuple(arm.home.tolist())
    )


def _tray(table: Table, tray: Tray) -> TrayView:
    slots = tuple(SlotView(name=slot.name, at=_point(table.centre(slot))) for slot in tray.slots)
    return TrayView(name=tray.name, pitch=tray.pitch, rows=tray.rows, columns=tray.columns, slots=slots)


def _gripper(gripper: Gripper) -> GripperView:
    return GripperView.model_validate(gripper.model_dump(include=set(GripperView.model_fields)))


def _space(space: WorkSpace) -> SpaceView:
    return SpaceView(lower=space.lower, upper=space.upper)


def _shape(shape: PieceShape) -> ShapeView:
    return ShapeView.model_validate(shape.model_dump(include=set(ShapeView.model_fields)))


def _point(where: Array) -> Point:
    x, y, z = np.round(where, _DIGITS).tolist()
    return x, y, z


def quaternion(transform: Transform) -> tuple[float, float, float, float]:
    """(w, x, y, z) of a transform's rotation, w not negative; by the largest of the four, for accuracy."""
    r = transform.rotation
    trace = float(np.trace(r))
    squares = np.array([trace, *(2 * np.diag(r) - trace)]) + 1  # 4w², 4x², 4y², 4z²
    products = np.array(
        [
            [squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], squares[1], r[0, 1] + r[1, 0], r[2, 0] + r[0, 2]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], squares[2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[2, 0] + r[0, 2], r[1, 2] + r[2, 1], squares[3]],
        ]
    )  # 4 q qᵀ
    row = products[int(squares.argmax())]
    w, x, y, z = (row / np.linalg.norm(row) * (1 if row[0] >= 0 else -1)).tolist()
    return w, x, y, z
