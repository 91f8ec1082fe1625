"""The hand: a robot with a gripper, and a planner; what all hands share, and that of any Cartesian robot.

A transfer is two atomic groups with checkpoints between them::

    GRIPPING   [approach, close]   CARRYING   [carry, open]   RELEASED

Each group ends at a barrier, so that what a checkpoint says is physically true when it is journaled.
"""

import asyncio
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple

import chess
import numpy as np

from kempelen.core.errors import NotHomedError
from kempelen.core.geometry import Array
from kempelen.core.pieces import KINDS
from kempelen.core.places import Layout, Transfer
from kempelen.core.protocols import (
    Action,
    Checkpoint,
    Follow,
    FollowJoints,
    GripperState,
    OnCheckpoint,
    Robot,
    RobotPhase,
    RobotState,
    SetGripper,
    TransferReport,
)
from kempelen.core.table import Table
from kempelen.motion.plan import Plan, plan_approach, plan_carry, plan_leave
from kempelen.motion.planners import DEFAULT_PLANNER
from kempelen.motion.scene import Clearances, Scene

_HELPLESS = frozenset({RobotPhase.ALARM, RobotPhase.DISCONNECTED})


class Way(NamedTuple):
    """A planned motion.

    Attributes:
        action: What the robot is sent.
        bound: No motion is faster, s.
    """

    action: Follow | FollowJoints
    bound: float

    @property
    def seconds(self) -> float:
        """Predicted time, s."""
        return self.action.seconds

    @property
    def end(self) -> Array:
        """Where it leads: the tool point (3,) mm, or joint angles (n,) rad."""
        last: Array = self.action.vertices[-1]
        return last


class TransferHand(ABC):
    """What every hand does alike; implements `kempelen.core.protocols.Hand`. Ways are planned below it.

    Args:
        robot: Entered.
        table: Where everything is; may be replaced between transfers, after a new calibration.
        clearances: How far to stay away from things.
        clock: For the measured times, s.

    Attributes:
        home_is_aside: Whether the hand is out of everybody's way where homing ends.
    """

    home_is_aside = True

    def __init__(
        self,
        robot: Robot,
        table: Table,
        *,
        clearances: Clearances | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.robot = robot
        self.table = table
        self._clearances = clearances or Clearances()
        self._clock = clock
        self._underway: tuple[float, float] | None = None  # since when, and for how long, s

    @property
    def state(self) -> RobotState:
        """The robot's latest snapshot."""
        return self.robot.state

    def seconds_left(self, pace: float = 1.0) -> float | None:
        """Until the group of motions at hand should end, s; None when nothing is being driven.

        Args:
            pace: Seconds of the robot for each second of the clock; other than 1 on a twin.
        """
        if self._underway is None:
            return None
        since, seconds = self._underway
        return max(seconds - pace * (self._clock() - since), 0.0)

    async def prepare(self) -> None:
        """Home if needed, open the gripper; afterwards it is empty, open and parked.

        Raises:
            RobotError: what went wrong, and what to do.
        """
        homed_now = await self._homed_now()
        if not homed_now:
            await self._lift()
        if not (homed_now and self.home_is_aside):
            await self.park(self._anything)
        await self._open()

    async def carry(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> TransferReport:
        """Carry one piece over the standing ones (``standing`` includes the piece at its source).

        The carry is planned while the approach is being driven. Cancelled: the machine is at rest, where it
        is.

        Raises:
            MotionError: a path that cannot be planned or would touch something; nothing of it was sent.
            RobotError: as `Robot.run`.
        """
        scene = self._scene(standing)
        if self.state.gripper is not GripperState.OPEN:
            await self._open()
        approach = self._approach(scene, transfer)
        await checkpoint(Checkpoint.GRIPPING)
        started = self._clock()
        plan = await self._while_driving(
            [approach.action, self._grip(closed=True)],
            lambda: self._carry(scene, transfer, after=approach),
        )
        await checkpoint(Checkpoint.CARRYING)
        gripped = self._clock()
        await self._drive(plan.action, *self._let_go())
        released = self._clock()
        await checkpoint(Checkpoint.RELEASED)
        gripper, let_go = self.table.gripper, sum(action.seconds for action in self._let_go())
        return TransferReport(
            transfer=transfer,
            seconds=released - started,
            predicted=approach.seconds + gripper.close_seconds + plan.seconds + let_go,
            bound=plan.bound,
            carry=released - gripped,
        )

    async def finish_held(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> None:
        """After a restart with the piece in the gripper: home with it, put it on its target.

        ``standing`` does not include the piece. The gripper stays closed throughout: homing lifts first.

        Raises:
            MotionError: no path; the piece is still held.
            RobotError: as `Robot.run`.
        """
        if not await self._homed_now():
            await self._lift()
        plan = self._carry(self._scene(standing), transfer, after=None)
        await self._drive(plan.action, *self._let_go())
        await checkpoint(Checkpoint.RELEASED)

    async def park(self, standing: Layout) -> None:
        """High, clear of the camera.

        Raises:
            MotionError: no path.
            RobotError: as `Robot.run`.
        """
        await self._drive(self._leave(self._scene(standing)).action)

    async def hold(self) -> None:
        """Pause at once, also with a piece in the gripper."""
        await self.robot.hold()

    async def resume(self) -> None:
        """Go on after `hold`."""
        await self.robot.resume()

    async def stop(self) -> None:
        """E-stop; never queues."""
        await self.robot.stop()

    # --- steps ----------------------------------------------------------------------------------------------

    async def _drive(self, *group: Action) -> None:
        self._underway = self._clock(), sum(action.seconds for action in group)
        try:
            await self.robot.run(group)
        finally:
            self._underway = None

    async def _while_driving(self, group: Sequence[Action], plan_next: Callable[[], Way]) -> Way:
        """Drive a group and plan what follows meanwhile; a failed plan brings the machine to rest."""
        driving = asyncio.ensure_future(self._drive(*group))
        try:
            await asyncio.sleep(0)  # the first lines go out before the planner takes the processor
            plan = plan_next()
            await asyncio.shield(driving)
        except BaseException:
            driving.cancel()
            await asyncio.gather(driving, return_exceptions=True)
            raise
        return plan

    async def _homed_now(self) -> bool:
        """Home if needed; whether it was: then the hand is in a corner, at the top."""
        if self.state.phase in _HELPLESS:
            await self.robot.recover()
        if self.state.homed:
            return False
        await self.robot.home()
        return True

    @property
    def _anything(self) -> Layout:
        """Whatever may stand on the table, this is taller and more."""
        kind = max(KINDS, key=lambda kind: self.table.pieces[kind].height)
        return Layout(dict.fromkeys(self.table.places, chess.Piece(kind, chess.WHITE)))

    async def _open(self) -> None:
        await self._drive(self._grip(closed=False))

    def _let_go(self) -> Sequence[SetGripper]:
        """What is done with the gripper where a piece is set down."""
        return (self._grip(closed=False),)

    def _grip(self, *, closed: bool) -> SetGripper:
        gripper = self.table.gripper
        return SetGripper(closed, gripper.close_seconds if closed else gripper.open_seconds)

    def _scene(self, standing: Layout) -> Scene:
        return Scene(self.table, standing, self._clearances)

    async def _lift(self) -> None:
        """Straight up, clear of whatever may stand there."""
        await self.robot.retract()

    # --- ways -----------------------------------------------------------------------------------------------

    @abstractmethod
    def _approach(self, scene: Scene, transfer: Transfer) -> Way:
        """With open fingers from here to the grip."""

    @abstractmethod
    def _carry(self, scene: Scene, transfer: Transfer, *, after: Way | None) -> Way:
        """With the piece from the end of its approach, or from here, to where it is let go."""

    @abstractmethod
    def _leave(self, scene: Scene) -> Way:
        """With open fingers from here to where the hand waits."""


class CartesianHand(TransferHand):
    """The hand of a robot whose tool point is moved along straight axes.

    Args:
        robot: As for any hand.
        table: As for any hand.
        planner: One of `kempelen.motion.planners.PLANNERS`.
        clearances: As for any hand.
        clock: As for any hand.
    """

    def __init__(
        self,
        robot: Robot,
        table: Table,
        *,
        planner: str = DEFAULT_PLANNER,
        clearances: Clearances | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(robot, table, clearances=clearances, clock=clock)
        self.planner = planner

    def _approach(self, scene: Scene, transfer: Transfer) -> Way:
        return _way(plan_approach(scene, self._here(), transfer.source, planner=self.planner))

    def _carry(self, scene: Scene, transfer: Transfer, *, after: Way | None) -> Way:
        start = self._here() if after is None else None
        return _way(plan_carry(scene, transfer, start=start, planner=self.planner))

    def _leave(self, scene: Scene) -> Way:
        return _way(plan_leave(scene, self._here(), planner=self.planner))

    def _here(self) -> Array:
        """(3,) the tool point, robot frame, mm; a step's rounding beyond the work space counts as inside."""
        position = self.state.reported_position
        if position is None:
            raise NotHomedError("The hand does not know where it is.", hint="Home it first.")
        here: Array = np.clip(np.array(position), self.table.space.lower, self.table.space.upper)
        return here


def _way(plan: Plan) -> Way:
    return Way(Follow(plan.vertices, plan.seconds), plan.bound)
