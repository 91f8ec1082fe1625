"""The hand of an arm: paths of joint angles, with the least tilt of the gripper that serves both ends."""

import time
from collections.abc import Callable, Sequence

import numpy as np

from kempelen.core.errors import NotHomedError
from kempelen.core.geometry import Array
from kempelen.core.places import Transfer
from kempelen.core.protocols import FollowJoints, Robot, SetGripper
from kempelen.core.table import Table
from kempelen.kinematics.arm import Arm
from kempelen.motion.arm.guidance import BOW
from kempelen.motion.arm.plan import (
    ARM_CLEARANCES,
    ArmPlan,
    plan_arm_approach,
    plan_arm_carry,
    plan_arm_leave,
    plan_arm_lift,
)
from kempelen.motion.scene import Clearances, Scene
from kempelen.robots.hand import TransferHand, Way

STILL_SECONDS = 0.3
"""After so long a piece between hanging pads has stopped to swing, s: grease damps it within a period."""


class ArmHand(TransferHand):
    """The hand of an arm; implements `kempelen.core.protocols.Hand`.

    Args:
        robot: Entered; accepts `FollowJoints` and reports its joints.
        table: As for any hand.
        arm: Its chain and limits.
        bow: How far guided motion near pieces may leave its straight line, mm.
        clearances: As for any hand; `ARM_CLEARANCES` without.
        clock: As for any hand.
    """

    home_is_aside = False

    def __init__(
        self,
        robot: Robot,
        table: Table,
        arm: Arm,
        *,
        bow: float = BOW,
        clearances: Clearances | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(robot, table, clearances=clearances or ARM_CLEARANCES, clock=clock)
        self.arm = arm
        self.bow = bow

    def _approach(self, scene: Scene, transfer: Transfer) -> Way:
        return _way(plan_arm_approach(self.arm, scene, self._joints(), transfer, bow=self.bow))

    def _carry(self, scene: Scene, transfer: Transfer, *, after: Way | None) -> Way:
        start = self._joints() if after is None else after.end
        return _way(plan_arm_carry(self.arm, scene, transfer, start, bow=self.bow))

    def _let_go(self) -> Sequence[SetGripper]:
        """Pads that hang let the piece swing on the way: it is let go when it hangs still."""
        opened = super()._let_go()
        return (SetGripper(True, STILL_SECONDS), *opened) if self.table.gripper.plumb else opened  # noqa: FBT003

    def _leave(self, scene: Scene) -> Way:
        return _way(plan_arm_leave(self.arm, scene, self._joints(), bow=self.bow))

    async def _lift(self) -> None:
        plan = plan_arm_lift(self.arm, self.table, self._joints(), bow=self.bow)
        if plan is not None:
            await self._drive(_way(plan).action)

    def _joints(self) -> Array:
        """(n,) where the joints are, rad; a step's rounding beyond a range counts as inside."""
        joints = self.state.joints
        if joints is None:
            raise NotHomedError("The arm does not know how its joints stand.", hint="Home it first.")
        ranges = self.arm.ranges
        here: Array = np.clip(np.array(joints), ranges[:, 0], ranges[:, 1])
        return here


def _way(plan: ArmPlan) -> Way:
    return Way(FollowJoints(plan.joints, plan.times, plan.seconds), plan.bound)
