"""The table: everything that stands still, in the robot's frame.

Frames (mm, right-handed, z up):

* **robot**: the machine's work coordinates. Its origin is the work origin; z = 0 is the level at which the
  pads' centres would touch the board when the table is level.
* **board**: origin at a1's outer corner on the playing surface, x along rank 1 towards h1, y along the a-file
  towards a8.

A *tool point* is the centre between the two pads. A piece that stands on a place is gripped with the tool
point above the place's centre, at the piece's grip height above the surface.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Self

import chess
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from kempelen.core.errors import FitError
from kempelen.core.geometry import Array, Transform
from kempelen.core.pieces import KINDS, PRESETS, PieceSet
from kempelen.core.places import Layout, Place
from kempelen.core.surfaces import Surface

_Offset = Annotated[float, Field(ge=-5000, le=5000)]


class Tray(BaseModel):
    """A grid of slots beside the board, fixed to the board's frame.

    Slot 1 is at ``origin``; numbers run along board y first (``rows``), then along board x (``columns``).

    Attributes:
        name: Lower-case letters; the slots are ``name1`` .. ``name<rows*columns>``.
        origin: Centre of slot 1 in the board frame: x, y, mm.
        rows: Slots along the board's y.
        columns: Slots along the board's x.
        pitch: Distance of neighbouring slots, mm.
        height: Of the tray's surface above the playing surface, mm; negative when lower.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: Annotated[str, Field(pattern=r"^[a-z]{2,12}$")]
    origin: tuple[_Offset, _Offset]
    rows: Annotated[int, Field(ge=1, le=20)] = 8
    columns: Annotated[int, Field(ge=1, le=8)] = 2
    pitch: Annotated[float, Field(ge=15, le=150)] = 50.0
    height: Annotated[float, Field(ge=-50, le=50)] = 0.0

    @property
    def slots(self) -> tuple[Place, ...]:
        """All slots, in order of their numbers."""
        return tuple(Place.slot(self.name, n) for n in range(1, self.rows * self.columns + 1))

    def centre(self, number: int) -> Array:
        """(3,) centre of slot ``number`` on the tray's surface, board frame, mm."""
        column, row = divmod(number - 1, self.rows)
        return np.array(
            [self.origin[0] + column * self.pitch, self.origin[1] + row * self.pitch, self.height]
        )


class Gripper(BaseModel):
    """A two-finger gripper: sizes for planning, mm.

    Attributes:
        closing_axis: Angle of the direction in which the fingers close, from the robot's x axis, rad; from
            the direction across the arm where they are ``tangential``.
        tangential: Whether the gripper turns with an arm's base, closing across the vertical plane through
            the base's axis (the robot's z axis) and the tool point; else it does not turn.
        plumb: Whether the pads hang on pivots along the closing axis, so that they and what they hold stay
            plumb when the gripper tilts. Rigid pads lean a piece over to their own tilt.
        opening: Diameter of the round passage between the open pads.
        finger_thickness: From that passage to the outside of a finger, along the closing axis.
        finger_width: Of a finger, across the closing axis.
        below_tool: How far the fingers reach below the tool point.
        finger_length: From the tool point up to the palm.
        palm_radius: Of a cylinder that holds everything above the fingers.
        close_seconds: From "close" until the piece may be lifted.
        open_seconds: From "open" until the hand may move.
        release_height: How far above its place a piece is let go.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    closing_axis: float = 0.0
    tangential: bool = False
    plumb: bool = False
    opening: Annotated[float, Field(gt=5, le=120)] = 31.0
    finger_thickness: Annotated[float, Field(gt=0.5, le=30)] = 8.4
    finger_width: Annotated[float, Field(gt=2, le=60)] = 20.0
    below_tool: Annotated[float, Field(ge=1, le=60)] = 7.0
    finger_length: Annotated[float, Field(ge=20, le=300)] = 95.0
    palm_radius: Annotated[float, Field(gt=5, le=200)] = 35.0
    close_seconds: Annotated[float, Field(ge=0, le=5)] = 0.15
    open_seconds: Annotated[float, Field(ge=0, le=5)] = 0.1
    release_height: Annotated[float, Field(ge=0, le=5)] = 0.8

    @property
    def half_length_open(self) -> float:
        """From the tool point to the outside of an open finger, along the closing axis, mm."""
        return self.opening / 2 + self.finger_thickness

    def closing_angles(self, points: Array) -> Array:
        """Angle of the closing direction from the robot's x axis over points (..., 2 or 3), (...) rad."""
        if not self.tangential:
            return np.full(points.shape[:-1], self.closing_axis)
        return np.asarray(np.arctan2(points[..., 1], points[..., 0]) + np.pi / 2 + self.closing_axis)


class WorkSpace(BaseModel):
    """The box that the tool point can reach, and how fast, in the robot frame.

    Attributes:
        lower: (x, y, z) mm.
        upper: (x, y, z) mm.
        velocity: Highest speed of each axis, mm/s.
        acceleration: Of each axis, mm/s².
        junction_deviation: GRBL's $11: how far a corner might be rounded, mm.
        margin: Of each axis beyond the box to the end of its travel (the reference switch), mm.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    lower: tuple[float, float, float] = (0.0, 0.0, 0.0)
    upper: tuple[float, float, float] = (700.0, 450.0, 200.0)
    velocity: tuple[float, float, float] = (300.0, 300.0, 300.0)
    acceleration: tuple[float, float, float] = (1500.0, 1500.0, 1500.0)
    junction_deviation: Annotated[float, Field(gt=0, le=1)] = 0.02
    margin: Annotated[float, Field(ge=0, le=50)] = 5.0

    @model_validator(mode="after")
    def _box(self) -> Self:
        for axis, low, high, speed, rate in zip(
            "xyz", self.lower, self.upper, self.velocity, self.acceleration, strict=True
        ):
            if not low < high:
                raise ValueError(f"work space {axis}: lower {low} mm must be below upper {high} mm")
            if speed <= 0 or rate <= 0:
                raise ValueError(f"work space {axis}: velocity and acceleration must be above 0")
        return self

    @property
    def travel(self) -> tuple[float, float, float]:
        """Full travel of each axis (GRBL's $130..$132), mm."""
        return (
            self.upper[0] - self.lower[0] + 2 * self.margin,
            self.upper[1] - self.lower[1] + 2 * self.margin,
            self.upper[2] - self.lower[2] + 2 * self.margin,
        )

    @property
    def robot_from_machine(self) -> tuple[float, float, float]:
        """What to add to a machine coordinate in [-travel, 0] to get the robot frame, mm.

        The work offset (G54) is this, negated.
        """
        return (self.upper[0] + self.margin, self.upper[1] + self.margin, self.upper[2] + self.margin)

    def excess(self, point: Array) -> float:
        """How far a point (3,) lies outside of the box, mm; 0 inside."""
        low, high = np.asarray(self.lower), np.asarray(self.upper)
        return float(np.maximum(np.maximum(low - point, point - high), 0.0).max())


DEFAULT_TRAYS: tuple[Tray, ...] = (
    Tray(name="left", origin=(-90.0, 25.0)),
    Tray(name="right", origin=(440.0, 25.0)),
)


@dataclass(frozen=True)
class Table:
    """Board, trays, pieces, gripper and work space, ready to be asked where things are.

    Attributes:
        robot_from_board: Pose of the board.
        square: Side of a square, mm.
        trays: Beside the board, in the board's frame.
        pieces: Sizes of the six kinds.
        gripper: Sizes of the hand.
        space: What the tool point can reach.
        aside: How far beyond the board's side the hand parks, as far as it reaches, mm: a camera that sees
            the gantry's beam needs more than the hand alone.

    Raises:
        FitError: two trays have the same name.
    """

    robot_from_board: Transform = field(default_factory=lambda: Transform.about_z(0.0, (150.0, 25.0, 0.0)))
    square: float = 50.0
    trays: tuple[Tray, ...] = DEFAULT_TRAYS
    pieces: PieceSet = PRESETS["club"]
    gripper: Gripper = field(default_factory=Gripper)
    space: WorkSpace = field(default_factory=WorkSpace)
    aside: float = 0.0

    def __post_init__(self) -> None:
        names = [tray.name for tray in self.trays]
        if len(set(names)) != len(names):
            raise FitError(f"Two trays have the same name: {', '.join(sorted(names))}.", hint="Rename one.")

    @cached_property
    def _centres(self) -> Mapping[Place, Array]:
        board: dict[Place, Array] = {
            Place.at(s): np.array(
                [(chess.square_file(s) + 0.5) * self.square, (chess.square_rank(s) + 0.5) * self.square, 0.0]
            )
            for s in chess.SQUARES
        }
        for tray in self.trays:
            board |= {slot: tray.centre(slot.number) for slot in tray.slots}
        robot = {place: self.robot_from_board @ centre for place, centre in board.items()}
        for centre in robot.values():
            centre.setflags(write=False)
        return robot

    @cached_property
    def surfaces(self) -> tuple[Surface, ...]:
        """Playing field and trays; a tray's surface reaches half a pitch beyond its outer slots."""
        side = 8 * self.square
        board = Surface.in_frame("board", self.robot_from_board, (0.0, 0.0, 0.0), (side, side))
        trays = (
            Surface.in_frame(
                tray.name,
                self.robot_from_board,
                (tray.origin[0] - tray.pitch / 2, tray.origin[1] - tray.pitch / 2, tray.height),
                (tray.columns * tray.pitch, tray.rows * tray.pitch),
            )
            for tray in self.trays
        )
        return (board, *trays)

    @cached_property
    def upwards(self) -> Array:
        """(3,) unit normal of the board, robot frame: a piece's axis."""
        return self.robot_from_board.rotation[:, 2]

    @property
    def places(self) -> tuple[Place, ...]:
        """All squares, then all slots."""
        return tuple(self._centres)

    @property
    def slots(self) -> tuple[Place, ...]:
        """All tray slots."""
        return tuple(slot for tray in self.trays for slot in tray.slots)

    def centre(self, place: Place) -> Array:
        """(3,) centre of a place on its surface, robot frame, mm.

        Raises:
            FitError: the table has no such place.
        """
        try:
            return self._centres[place]
        except KeyError:
            raise FitError(
                f"The table has no place '{place}'.",
                hint=f"Trays: {', '.join(t.name for t in self.trays) or 'none'}.",
            ) from None

    def grip_point(self, place: Place, kind: chess.PieceType) -> Array:
        """(3,) tool point that grips a piece of ``kind`` standing on ``place``, robot frame, mm."""
        return _raised(self.centre(place), self.pieces[kind].grip_height)

    def release_point(self, place: Place, kind: chess.PieceType) -> Array:
        """(3,) tool point at which a carried piece is let go, robot frame, mm."""
        return _raised(self.grip_point(place, kind), self.gripper.release_height)

    @cached_property
    def park_xs(self) -> tuple[float, ...]:
        """The x of the board's two sides and ``aside``, robot frame, mm, as far as the work space reaches.

        High above a side the hand does not hide the board from a camera overhead: what is higher appears
        farther out.
        """
        corners = self.robot_from_board @ np.array(
            [[x, y, 0.0] for x in (0.0, 8 * self.square) for y in (0.0, 8 * self.square)]
        )
        low, high = self.space.lower[0], self.space.upper[0]
        sides = ((float(corners[:, 0].min()), -1.0), (float(corners[:, 0].max()), 1.0))
        inside = tuple(
            float(np.clip(x + outwards * self.aside, low, high)) for x, outwards in sides if low <= x <= high
        )
        return inside or (low,)

    @cached_property
    def park_height(self) -> float:
        """Height z of the parking points, mm: even a held piece is clear of the tallest one there."""
        highest = max(float(centre[2]) for centre in self._centres.values())
        hang = max(self.gripper.below_tool, *(self.pieces[kind].grip_height for kind in KINDS))
        return min(highest + self.pieces.tallest + hang + _PARK_CLEARANCE, self.space.upper[2])

    def park_point(self, near: Array) -> Array:
        """(3,) the parking point nearest to a tool point: high, at the board's side, same y."""
        x = min(self.park_xs, key=lambda candidate: abs(candidate - near[0]))
        return np.array([x, near[1], self.park_height])


_PARK_CLEARANCE = 10.0  # mm


def _raised(point: Array, height: float) -> Array:
    return np.array([point[0], point[1], point[2] + height])


def start_layout(table: Table, board: chess.Board) -> Layout:
    """Where everything stands when a game begins from ``board``.

    A set has 32 pieces and a spare queen of each colour; what is not on the board waits in the trays: White's
    from the first slot of the first tray on, Black's from the last slot of the last tray backwards.

    Raises:
        FitError: the trays have too few slots.
    """
    pieces = {Place.at(square): piece for square, piece in board.piece_map().items()}
    off = {colour: pieces_off_board(board, colour) for colour in chess.COLORS}
    waiting = sum(map(len, off.values()))
    if waiting > len(table.slots):
        raise FitError(
            f"{waiting} pieces stand beside the board, the trays have {len(table.slots)} slots.",
            hint="Add slots to the trays in the configuration.",
        )
    pieces |= dict(zip(table.slots, off[chess.WHITE], strict=False))
    pieces |= dict(zip(reversed(table.slots), off[chess.BLACK], strict=False))
    return Layout(pieces)


FULL_SET: Mapping[chess.PieceType, int] = {
    chess.KING: 1, chess.QUEEN: 2, chess.ROOK: 2, chess.BISHOP: 2, chess.KNIGHT: 2, chess.PAWN: 8,
}  # fmt: skip


def pieces_off_board(board: chess.Board, colour: chess.Color) -> list[chess.Piece]:
    """Pieces of a full set (spare queen included) of one colour that are not on the board.

    The spare queens come first, so that they stand at the trays' ends.
    """
    kinds = (chess.QUEEN, chess.ROOK, chess.BISHOP, chess.KNIGHT, chess.PAWN)
    return [
        chess.Piece(kind, colour)
        for kind in kinds
        for _ in range(max(FULL_SET[kind] - len(board.pieces(kind, colour)), 0))
    ]
