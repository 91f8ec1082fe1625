"""An arm whose drift is kept account of: its joints lose a little at each stop, and the steps do not show it.

`KeptArm` stands before the driver. It knows from the model of the drift how far off each joint should be by
now, takes that away from every command, and says how far off the tool point may be nevertheless. What the
camera sees of the pieces set down makes it surer; homing makes it as good as new.
"""

from collections.abc import AsyncIterator, Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.protocols import Action, Follow, FollowJoints, Robot, RobotState, SetGripper
from kempelen.kinematics import Arm, forward
from kempelen.kinematics.drift import JointErrors

LOOK_SPREAD = 1.0
"""Standard deviation of a piece's place as the camera sees it and as the pads have let go of it, mm."""
WARMTH = 2.0
"""By so much, K, an arm may become warmer or colder until it is homed again."""


class KeptArm:
    """A robot in all that a robot does. Async context manager.

    Args:
        robot: The driver of an arm.
        arm: Its model.

    Attributes:
        name: The driver's.
        space: The driver's.
        errors: What is known of the joints.
        homings: How often they were homed.
        looks: How many pieces that were set down have been looked at.
    """

    def __init__(self, robot: Robot, arm: Arm) -> None:
        self._robot = robot
        self.name, self.space = robot.name, robot.space
        self.arm = arm
        self.errors = self._fresh()
        self.homings = self.looks = 0

    def _fresh(self) -> JointErrors:
        return JointErrors.homed(self.arm).warmed(self.arm, 0.0, WARMTH)

    @property
    def state(self) -> RobotState:
        """The driver's, with joints and tool point where they are thought to be in truth."""
        return self._believed(self._robot.state)

    @property
    def joints(self) -> Array | None:
        """(n,) rad where the joints are thought to be in truth; None before homing."""
        reported = self._robot.state.joints
        return None if reported is None else np.array(reported) + self.errors.mean

    def _believed(self, state: RobotState) -> RobotState:
        if state.joints is None:
            return state
        joints = np.array(state.joints) + self.errors.mean
        x, y, z = forward(self.arm, joints)[:3, 3].tolist()
        return replace(state, joints=tuple(joints.tolist()), reported_position=(x, y, z))

    async def __aenter__(self) -> Self:
        """Connect."""
        await self._robot.__aenter__()
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Let go."""
        await self._robot.__aexit__(*exc)

    async def watch(self) -> AsyncIterator[RobotState]:
        """Each new snapshot; a slow reader skips to the newest."""
        async for state in self._robot.watch():
            yield self._believed(state)

    async def home(self) -> None:
        """As `Robot.home`; afterwards the joints are where they are said to be."""
        await self._robot.home()
        self.errors = self._fresh()
        self.homings += 1

    async def run(self, group: Sequence[Action]) -> None:
        """As `Robot.run`; paths of joints begin where the joints are and end corrected."""
        before = self._robot.state.joints
        corrected = self._corrected(group)
        ends = [action.vertices[-1] for action in corrected if isinstance(action, FollowJoints)]
        try:
            await self._robot.run(corrected)
        finally:
            self._count([before, *ends[:-1], self._robot.state.joints])

    def _corrected(self, group: Sequence[Action]) -> list[Action]:
        """Paths that begin where the steps have the joints, and come to end where these should be in truth.

        What the errors are thought to be may have changed since a path was planned: it is made up for on the
        way, little by little.
        """
        here, out = self._robot.state.joints, list[Action]()
        for action in group:
            if here is None or isinstance(action, SetGripper):
                out.append(action)
            elif isinstance(action, Follow):
                out.append(replace(action, vertices=action.vertices - self._shift(np.array(here))))
            else:
                out.append(self._made_up(action, np.array(here)))
                here = tuple(self.errors.compensated(action.vertices[-1]).tolist())
        return out

    def _shift(self, here: Array) -> Array:
        """(3,) mm by which the tool point is thought to be off, with joints at (n,) rad."""
        truly, reported = forward(self.arm, np.array([here + self.errors.mean, here]))[:, :3, 3]
        return np.asarray(truly - reported)

    def _made_up(self, action: FollowJoints, here: Array) -> FollowJoints:
        vertices = self.errors.compensated(action.vertices)
        left = 1.0 - action.times / max(float(action.times[-1]), 1e-9)
        return replace(action, vertices=vertices + left[:, None] * (here - vertices[0]))

    def _count(self, stops: Sequence[Array | tuple[float, ...] | None]) -> None:
        known = [np.asarray(joints) for joints in stops if joints is not None]
        if len(known) > 1:
            self.errors = self.errors.after(self.arm, np.array(known))

    def seen(self, joints: Array, off: Array) -> None:
        """A piece that was set down with the joints at (n,) rad stands (3,) mm off; NaN: not seen."""
        self.errors = self.errors.seen(self.arm, joints, off, LOOK_SPREAD)
        self.looks += 1

    async def retract(self) -> None:
        """As `Robot.retract`."""
        before = self._robot.state.joints
        await self._robot.retract()
        self._count([before, self._robot.state.joints])

    async def hold(self) -> None:
        """As `Robot.hold`."""
        await self._robot.hold()

    async def resume(self) -> None:
        """As `Robot.resume`."""
        await self._robot.resume()

    async def cancel(self) -> None:
        """As `Robot.cancel`."""
        await self._robot.cancel()

    async def stop(self) -> None:
        """As `Robot.stop`."""
        await self._robot.stop()

    async def recover(self) -> None:
        """As `Robot.recover`."""
        await self._robot.recover()

    async def jog(self, direction: tuple[float, float, float], speed: float) -> None:
        """As `Robot.jog`."""
        await self._robot.jog(direction, speed)

    async def jog_stop(self) -> None:
        """As `Robot.jog_stop`."""
        before = self._robot.state.joints
        await self._robot.jog_stop()
        self._count([before, self._robot.state.joints])
