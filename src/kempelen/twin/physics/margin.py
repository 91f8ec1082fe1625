"""How far an arm's gripper may be off a piece and still take it: tried out in physics.

A piece alone is gripped with the pads off its axis, lifted, put back and let go. What counts as taken was not
touched before the fingers closed, hung between the pads and stands afterwards: a finger that comes down on a
head would press it into the board, or stall the arm.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import chess
import numpy as np

from kempelen.core.errors import ReachError
from kempelen.core.geometry import Array
from kempelen.core.pieces import KINDS
from kempelen.core.places import Layout, Place
from kempelen.core.table import Table
from kempelen.kinematics import Arm, inverse
from kempelen.twin.physics.scene import Scene, StandingArm
from kempelen.twin.physics.world import World

DIRECTIONS = ("across", "inwards", "outwards")
"""Along the closing axis (either way is the same), towards the base, away from it."""
RESOLUTION = 0.25
"""mm"""
FARTHEST = 16.0
"""No gripper for a chessboard takes a piece from farther off, mm."""
_UNITS = {"across": (0.0, 1.0), "inwards": (-1.0, 0.0), "outwards": (1.0, 0.0)}  # radial, tangential
_TICK = 0.008
_SPEED = 120.0
"""mm/s"""
_ABOVE = 70.0
"""How high the hand begins, mm."""
_LIFT = 40.0
"""mm"""
_UP = np.array([0.0, 0.0, 1.0])
_UNTOUCHED = 0.2
"""mm"""
_CENTRED = 2.0
"""Half of what a placement may be off, mm."""


@dataclass(frozen=True, slots=True)
class Margin:
    """What error a grasp forgives.

    Attributes:
        kind: Of piece.
        tilt: Of the gripper, rad.
        across: mm, along the closing axis.
        inwards: mm, with the pads too near to the base.
        outwards: mm, with the pads too far from it.
    """

    kind: chess.PieceType
    tilt: float
    across: float
    inwards: float
    outwards: float

    @property
    def least(self) -> float:
        """In the worst of these directions, mm."""
        return min(self.across, self.inwards, self.outwards)


class GraspTrial:
    """A piece alone before an arm.

    Args:
        table: Whose pieces and gripper.
        arm: The arm; it does as it is told here.
        kind: Of the piece.
        place: Where it stands.
    """

    def __init__(self, table: Table, arm: Arm, kind: chess.PieceType, place: Place) -> None:
        layout = Layout({place: chess.Piece(kind, chess.WHITE)})
        scene = Scene.from_layout(table, layout, scatter=0.0)
        self._table, self._arm, self._place, self._kind = table, arm, place, kind
        self._world = World(Scene(table, scene.pieces, arm=StandingArm(arm)), joints=arm.home.tolist())
        self._id = scene.pieces[0].piece_id
        self._ticks = max(1, math.ceil(table.gripper.close_seconds / _TICK))

    def taken(self, tilt: float, radial: float, tangential: float) -> bool:
        """Whether the piece is taken with the pads off its axis by so many mm, and stands afterwards.

        Raises:
            ReachError: the arm does not reach the place at that tilt.
        """
        x, y, _ = self._table.centre(self._place).tolist()
        self._world.place(self._id, x, y)
        outwards = np.array([x, y, 0.0]) / math.hypot(x, y)
        aside = radial * outwards + tangential * np.array([-outwards[1], outwards[0], 0.0])
        grip = self._table.grip_point(self._place, self._kind) + aside
        self._world.teleport(self._joints(grip + _UP * _ABOVE, tilt))
        self._drive(grip, tilt, _ABOVE, 0.0, closed=False)
        untouched = self._world.piece(self._id).distance(x, y) < _UNTOUCHED
        self._wait(closed=True)
        self._drive(grip, tilt, 0.0, _LIFT, closed=True)
        held = self._world.held() == self._id and self._centred()
        self._drive(grip, tilt, _LIFT, self._table.gripper.release_height, closed=True)
        self._wait(closed=False)
        self._drive(grip, tilt, 0.0, _ABOVE, closed=False)
        return untouched and held and self._stands()

    def _centred(self) -> bool:
        """Whether the pads have it, rather than the fingers above them."""
        x, y, _ = self._world.tool_mm
        return self._world.piece(self._id).distance(x, y) < _CENTRED

    def _stands(self) -> bool:
        for _ in range(int(3.0 / _TICK)):
            if self._world.settled():
                break
            self._world.step(_TICK, self._world.joints, gripper_closed=False)
        return self._world.piece(self._id).upright

    def _joints(self, point: Array, tilt: float) -> Array:
        return inverse(self._arm, point, math.pi - tilt, 0.0, near=np.array(self._world.joints)).joints

    def _drive(self, grip: Array, tilt: float, low: float, high: float, *, closed: bool) -> None:
        """Straight up or down from ``low`` to ``high`` mm above the grip, gently at both ends."""
        for share in _gentle(abs(high - low) / _SPEED):
            point = grip + _UP * (low + (high - low) * share)
            self._world.step(_TICK, self._joints(point, tilt).tolist(), closed)

    def _wait(self, *, closed: bool) -> None:
        here = self._world.joints
        for _ in range(self._ticks):
            self._world.step(_TICK, here, closed)


def _gentle(seconds: float) -> Iterator[float]:
    count = max(1, math.ceil(1.5 * seconds / _TICK))
    for k in range(1, count + 1):
        share = k / count
        yield share * share * (3 - 2 * share)


def grasp_margin(
    table: Table, arm: Arm, kind: chess.PieceType, tilt: float = 0.0, place: Place | None = None
) -> Margin:
    """The margin of one kind at one tilt.

    Args:
        table: Whose pieces and gripper.
        arm: The arm.
        kind: Of piece.
        tilt: Of the gripper from straight down, rad.
        place: Where it is tried; default d4.

    Raises:
        ReachError: the arm does not reach the place at that tilt.
    """
    trial = GraspTrial(table, arm, kind, place or Place("d4"))
    across, inwards, outwards = (_farthest(trial, tilt, _UNITS[name]) for name in DIRECTIONS)
    return Margin(kind, tilt, across, inwards, outwards)


def _farthest(trial: GraspTrial, tilt: float, unit: tuple[float, float]) -> float:
    """Largest error, mm, up to which it works, to the resolution; 0 when it does not even without one."""
    low, high = 0.0, FARTHEST
    if not trial.taken(tilt, 0.0, 0.0):
        return 0.0
    while high - low > RESOLUTION:
        middle = (low + high) / 2
        works = trial.taken(tilt, middle * unit[0], middle * unit[1])
        low, high = (middle, high) if works else (low, middle)
    return low


def grasp_margins(table: Table, arm: Arm, tilts: tuple[float, ...] = (0.0,)) -> Iterator[Margin]:
    """Every kind at every tilt that the arm reaches d4 with."""
    for tilt in tilts:
        for kind in KINDS:
            try:
                yield grasp_margin(table, arm, kind, tilt)
            except ReachError:
                continue
