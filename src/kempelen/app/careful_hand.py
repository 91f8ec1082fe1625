"""A hand whose arm is homed again before what it has drifted can spoil a grasp, when that costs least."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import chess
import numpy as np

from kempelen.app.kept_arm import KeptArm
from kempelen.app.other_hand import OtherHand, TableHand
from kempelen.core.errors import ReachError
from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceShape
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Checkpoint, OnCheckpoint, TransferReport
from kempelen.core.table import Gripper, Table
from kempelen.kinematics import JointErrors, least_tilt
from kempelen.kinematics.drift import SIDE_LEFT, aside

STANDS_OFF = 1.5
"""How far off its place's centre a piece may stand that the arm has not set down itself, mm."""
LET_GO = 0.3
"""Standard deviation of what the pads do to a piece when they let go of it, mm."""
SET_DOWN = 3.5
"""How far off its place's centre a piece may be set down, mm."""
CERTAIN = 3.0
"""Standard deviations that a grasp and a landing are planned for."""
_STOPS_TO_GRASP, _STOPS_TO_LAND = 1, 2
"""A way is driven without a stop: one leads to the piece, another one to where it is set down."""
_LIKELY = 0.3
"""Share of the pieces whose grasp may fail after a move: with more, the arm is homed while there is time."""
_STOPS_A_MOVE = 2


class SetDown(NamedTuple):
    """A piece that the arm has set down: it stands where the arm thought its place was.

    Attributes:
        piece: Which.
        joints: (n,) rad, where the arm let go of it.
        errors: What was known of them.
        known: How often the arm had been homed and had looked until then.
    """

    piece: chess.Piece
    joints: Array
    errors: JointErrors
    known: tuple[int, int]


class Grasp(NamedTuple):
    """What a grasp or a landing asks for.

    Attributes:
        joints: (n,) rad.
        allowed: How far aside the tool point may be, mm.
        stood: How the piece came to its place; None for by another hand than the arm's, or for a landing.
        scatter: Standard deviation of what is held against the tool point, each way, mm.
    """

    joints: Array
    allowed: float
    stood: SetDown | None
    scatter: float


class CarefulHand(OtherHand):
    """Drives another hand; implements `kempelen.core.protocols.Hand`.

    Args:
        hand: Does the work, with ``arm`` for its robot.
        arm: Keeps account of its errors.

    Attributes:
        rehomings: How often the arm was homed again to be sure of the next grasp.
        released: Where the joints were when a piece was let go on a place, rad.
    """

    def __init__(self, hand: TableHand, arm: KeptArm) -> None:
        super().__init__(hand)
        self._arm = arm
        self.rehomings = 0
        self.released: dict[Place, Array] = {}
        self._set_down: dict[Place, SetDown] = {}

    async def carry(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> TransferReport:
        """As `Hand.carry`; the arm is homed first when it cannot be sure of the grasp or the landing."""
        self._forget(standing)
        grasp, landing = self._grasp(transfer.source, transfer.piece), self._landing(transfer)
        if self._drifted and (self._spent(grasp, _STOPS_TO_GRASP) or self._spent(landing, _STOPS_TO_LAND)):
            await self._hand.park(standing)
            await self._home()

        async def noted(reached: Checkpoint) -> None:
            if reached is Checkpoint.RELEASED:
                self._note(transfer)
            await checkpoint(reached)

        return await self._hand.carry(transfer, standing, noted)

    async def park(self, standing: Layout) -> None:
        """As `Hand.park`; if the arm must be homed soon, then now, out of the way, while somebody thinks."""
        await self._hand.park(standing)
        self._forget(standing)
        grasps = list(self._likely(standing))
        at_risk = sum(self._spent(grasp, _STOPS_A_MOVE) for grasp in grasps)
        if self._drifted and at_risk > _LIKELY * len(grasps):
            await self._home()
            await self._hand.park(standing)  # homing ends where the arm may hide the board

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

    def unsure(self, place: Place, piece: chess.Piece) -> float:
        """How far aside of a piece on a place the next grasp may be, mm."""
        return self._aside(self._grasp(place, piece), _STOPS_TO_GRASP)

    async def _home(self) -> None:
        await self._arm.home()
        self.rehomings += 1
        self.released.clear()

    def _note(self, transfer: Transfer) -> None:
        arm = self._arm
        if (joints := arm.joints) is not None:
            self.released[transfer.target] = joints
            known = arm.homings, arm.looks
            self._set_down[transfer.target] = SetDown(transfer.piece, joints, arm.errors, known)

    def _forget(self, standing: Layout) -> None:
        """What is no longer there was taken away by somebody, and may come back otherwise."""
        gone = [place for place, one in self._set_down.items() if standing.get(place) != one.piece]
        for place in gone:
            del self._set_down[place]

    @property
    def _drifted(self) -> bool:
        """Whether homing would help: just homed, the arm is as sure as it can be."""
        return int(self._arm.errors.stops.max()) > _STOPS_TO_LAND

    def _spent(self, grasp: Grasp, stops: int) -> bool:
        """Whether after so many stops of every joint the grasp may fail."""
        return self._aside(grasp, stops) > grasp.allowed

    def _aside(self, grasp: Grasp, stops: int) -> float:
        arm, turned = self._arm.arm, np.arange(stops + 1)[:, None]
        later = self._arm.errors.after(arm, grasp.joints + turned)
        return aside(self._covariance(later, grasp) + np.eye(3) * grasp.scatter**2, CERTAIN)

    def _covariance(self, errors: JointErrors, grasp: Grasp) -> Array:
        """(3, 3) mm² of the tool point against what it is to reach.

        A piece that the arm has set down is off its place by what the arm was off then. Homing or a look
        since then makes both independent; otherwise only what was lost since then counts.
        """
        arm, stood = self._arm, grasp.stood
        side = SIDE_LEFT * arm.arm.drift.play
        if stood is None:
            return errors.tool(arm.arm, grasp.joints, play=side).covariance
        if stood.known == (arm.homings, arm.looks):
            since = errors.since(stood.errors)
            return since.tool(arm.arm, grasp.joints, play=side * np.sqrt(2.0)).covariance
        then = stood.errors.tool(arm.arm, stood.joints, play=side).covariance
        return then + errors.tool(arm.arm, grasp.joints, play=side).covariance

    def _grasp(self, place: Place, piece: chess.Piece) -> Grasp:
        kind, stood = piece.piece_type, self._set_down.get(place)
        scatter = STANDS_OFF / 2 if stood is None else LET_GO  # evenly over a disc, that is half its radius
        point = self.table.grip_point(place, kind)
        return Grasp(self._joints(point), tolerance(self.table, kind), stood, scatter)

    def _landing(self, transfer: Transfer) -> Grasp:
        point = self.table.release_point(transfer.target, transfer.piece.piece_type)
        return Grasp(self._joints(point), SET_DOWN, None, LET_GO)

    def _joints(self, point: Array) -> Array:
        try:
            return least_tilt(self._arm.arm, point).joints
        except ReachError:  # the hand says so itself, and better
            return self._arm.arm.home

    def _likely(self, standing: Layout) -> Iterable[Grasp]:
        """The grasps that the next move may ask for: of every piece on the board."""
        return (self._grasp(place, piece) for place, piece in standing.items() if place.is_square)


def tolerance(table: Table, kind: chess.PieceType) -> float:
    """How far aside a piece the open gripper may be and still take it, mm."""
    return _margin(table.gripper, table.pieces[kind])


def _margin(gripper: Gripper, shape: PieceShape) -> float:
    return (gripper.opening - max(shape.head_diameter, shape.grip_diameter)) / 2
