"""A hand whose arm is homed again before what it has drifted can spoil a grasp, when that costs least."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import chess
import numpy as np

from kempelen.app.kept_arm import KeptArm
from kempelen.app.timed_hand import TableHand
from kempelen.core.errors import ReachError
from kempelen.core.geometry import Array
from kempelen.core.pieces import KINDS, PieceShape
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Checkpoint, OnCheckpoint, RobotState, TransferReport
from kempelen.core.table import Gripper, Table
from kempelen.kinematics import least_tilt

STANDS_OFF = 1.5
"""How far off its place's centre a piece may stand before it was ever gripped, mm."""
SET_DOWN = 2.5
"""How far off its place's centre a piece may be set down, mm."""
_STOPS_TO_GRASP, _STOPS_TO_LAND = 1, 2
"""A way is driven without a stop: one leads to the piece, another one to where it is set down."""
_LIKELY = 0.15
"""Share of the pieces whose grasp may fail after a move: with more, the arm is homed while there is time."""
_STOPS_A_MOVE = 2


class Grasp(NamedTuple):
    """What a grasp or a landing asks for.

    Attributes:
        joints: (n,) rad.
        allowed: How far aside the tool point may be, mm.
    """

    joints: Array
    allowed: float


class CarefulHand:
    """Drives another hand; implements `kempelen.core.protocols.Hand`.

    Args:
        hand: Does the work, with ``arm`` for its robot.
        arm: Keeps account of its errors.

    Attributes:
        rehomings: How often the arm was homed again to be sure of the next grasp.
        released: Where the joints were when a piece was let go on a place, rad.
    """

    def __init__(self, hand: TableHand, arm: KeptArm) -> None:
        self._hand = hand
        self._arm = arm
        self.rehomings = 0
        self.released: dict[Place, Array] = {}

    @property
    def state(self) -> RobotState:
        """The robot's latest snapshot."""
        return self._hand.state

    @property
    def table(self) -> Table:
        """Where everything is."""
        return self._hand.table

    @table.setter
    def table(self, table: Table) -> None:
        self._hand.table = table

    def seconds_left(self, pace: float = 1.0) -> float | None:
        """As the hand has it."""
        return self._hand.seconds_left(pace)

    async def prepare(self) -> None:
        """As `Hand.prepare`."""
        await self._hand.prepare()

    async def carry(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> TransferReport:
        """As `Hand.carry`; the arm is homed first when it cannot be sure of the grasp or the landing."""
        grasp, landing = self._grasp(transfer), self._landing(transfer)
        if self._drifted and (self._spent(grasp, _STOPS_TO_GRASP) or self._spent(landing, _STOPS_TO_LAND)):
            await self._hand.park(standing)
            await self._home()

        async def noted(reached: Checkpoint) -> None:
            if reached is Checkpoint.RELEASED and (joints := self._arm.joints) is not None:
                self.released[transfer.target] = joints
            await checkpoint(reached)

        return await self._hand.carry(transfer, standing, noted)

    async def finish_held(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> None:
        """As `Hand.finish_held`."""
        await self._hand.finish_held(transfer, standing, checkpoint)

    async def park(self, standing: Layout) -> None:
        """As `Hand.park`; if the arm must be homed soon, then now, out of the way, while somebody thinks."""
        await self._hand.park(standing)
        grasps = list(self._likely(standing))
        at_risk = sum(self._spent(grasp, _STOPS_A_MOVE) for grasp in grasps)
        if self._drifted and at_risk > _LIKELY * len(grasps):
            await self._home()
            await self._hand.park(standing)  # homing ends where the arm may hide the board

    async def hold(self) -> None:
        """As `Hand.hold`."""
        await self._hand.hold()

    async def resume(self) -> None:
        """As `Hand.resume`."""
        await self._hand.resume()

    async def stop(self) -> None:
        """As `Hand.stop`."""
        await self._hand.stop()

    # --- the budget -----------------------------------------------------------------------------------------

    def seen(self, offsets: Callable[[Place], Array | None]) -> None:
        """The camera has looked at the board.

        Args:
            offsets: (3,) mm, robot frame, by which what stands on a place stands off its centre; NaN for what
                was not seen, None for nothing.
        """
        released, self.released = self.released, {}
        for place, joints in released.items():
            if (off := offsets(place)) is not None:
                self._arm.seen(joints, off)

    async def _home(self) -> None:
        await self._arm.home()
        self.rehomings += 1
        self.released.clear()

    @property
    def _drifted(self) -> bool:
        """Whether homing would help: just homed, the arm is as sure as it can be."""
        return int(self._arm.errors.stops.max()) > _STOPS_TO_LAND

    def _spent(self, grasp: Grasp, stops: int) -> bool:
        """Whether after so many stops of every joint the grasp may fail."""
        arm, turned = self._arm.arm, np.arange(stops + 1)[:, None]
        later = self._arm.errors.after(arm, grasp.joints + turned)
        return later.tool(arm, grasp.joints).aside_known > grasp.allowed

    def _grasp(self, transfer: Transfer) -> Grasp:
        point = self.table.grip_point(transfer.source, transfer.piece.piece_type)
        return self._at(point, tolerance(self.table, transfer.piece.piece_type))

    def _landing(self, transfer: Transfer) -> Grasp:
        return self._at(self.table.release_point(transfer.target, transfer.piece.piece_type), SET_DOWN)

    def _at(self, point: Array, allowed: float) -> Grasp:
        try:
            return Grasp(least_tilt(self._arm.arm, point).joints, allowed)
        except ReachError:  # the hand says so itself, and better
            return Grasp(self._arm.arm.home, allowed)

    def _likely(self, standing: Layout) -> Iterable[Grasp]:
        """The grasps that the next move may ask for: of every piece on the board."""
        for place, piece in standing.items():
            if place.is_square:
                kind = piece.piece_type
                yield self._at(self.table.grip_point(place, kind), tolerance(self.table, kind))


def tolerance(table: Table, kind: chess.PieceType) -> float:
    """How far aside the open gripper may be from where a piece is thought to stand and still take it, mm."""
    return max(_margin(table.gripper, table.pieces[kind]) - STANDS_OFF, 0.0)


def tightest(table: Table) -> chess.PieceType:
    """The kind whose grasp forgives least."""
    return min(KINDS, key=lambda kind: tolerance(table, kind))


def _margin(gripper: Gripper, shape: PieceShape) -> float:
    return (gripper.opening - max(shape.head_diameter, shape.grip_diameter)) / 2
