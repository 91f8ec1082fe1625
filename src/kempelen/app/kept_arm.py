"""An arm whose drift is kept account of: its joints lose a little at each stop, and the steps do not show it.

`KeptArm` stands before the driver. It knows from the model of the drift how far off each joint should be by
now, takes that away from every command, and says how far off the tool point may be nevertheless. It knows
from which side each joint came, and so at which end of its play it rests. What the camera sees of the pieces
set down makes it surer; homing makes it as good as new.
"""

from collections.abc import AsyncIterator, Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.protocols import Action, Follow, FollowJoints, Robot, RobotState, SetGripper
from kempelen.kinematics import Arm, forward, jacobian
from kempelen.kinematics.drift import SIDE_LEFT, STILL, JointErrors, Slack

LOOK_SPREAD = 1.0
"""Standard deviation of a piece's place as the camera sees it and as the pads have let go of it, mm."""
WARMTH = 2.0
"""By so much, K, an arm may become warmer or colder until it is homed again."""
_ARRIVED = np.radians(0.2)
"""Within the steps of three coupled motors."""
_GUESSES = 3


class KeptArm:
    """A robot in all that a robot does. Async context manager.

    Args:
        robot: The driver of an arm.
        arm: Its model.

    Attributes:
        name: The driver's.
        space: The driver's.
        errors: What is known of the joints.
        slack: Where in their play they rest.
        homings: How often they were homed.
        looks: How many pieces that were set down have been looked at.
    """

    def __init__(self, robot: Robot, arm: Arm) -> None:
        self._robot = robot
        self.name, self.space = robot.name, robot.space
        self.arm = arm
        self.errors = self._fresh()
        self.slack = Slack.unknown(arm)
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
        return None if reported is None else np.array(reported) + self._off

    @property
    def _off(self) -> Array:
        """(n,) rad, true joints minus reported ones, as expected."""
        return self.errors.mean + self.slack.mean

    def _believed(self, state: RobotState) -> RobotState:
        if state.joints is None:
            return state
        joints = np.array(state.joints) + self._off
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
        self.errors, self.slack = self._fresh(), Slack.unknown(self.arm)
        self.homings += 1

    async def run(self, group: Sequence[Action]) -> None:
        """As `Robot.run`; paths of joints begin where the joints are and end corrected."""
        before = self._robot.state.joints
        corrected = self._corrected(group)
        ways = [action.vertices for action in corrected if isinstance(action, FollowJoints)]
        straight = any(isinstance(action, Follow) for action in corrected)
        try:
            await self._robot.run(corrected)
        finally:
            after = self._robot.state.joints
            self._count([before, *(way[-1] for way in ways[:-1]), after])
            self._lead(None if straight else ways, after)

    def _corrected(self, group: Sequence[Action]) -> list[Action]:
        """Paths that begin where the steps have the joints, and come to end where these should be in truth.

        What the errors are thought to be may have changed since a path was planned: it is made up for on the
        way, little by little.
        """
        here, slack, out = self._robot.state.joints, self.slack, list[Action]()
        for action in group:
            if here is None or isinstance(action, SetGripper):
                out.append(action)
            elif isinstance(action, Follow):
                out.append(replace(action, vertices=action.vertices - self._shift(np.array(here))))
            else:
                made_up = self._made_up(action, np.array(here), slack)
                out.append(made_up)
                here = tuple(made_up.vertices[-1].tolist())
                slack = slack.after(self.arm, made_up.vertices)
        return out

    def _shift(self, here: Array) -> Array:
        """(3,) mm by which the tool point is thought to be off, with joints at (n,) rad."""
        truly, reported = forward(self.arm, np.array([here + self._off, here]))[:, :3, 3]
        return np.asarray(truly - reported)

    def _made_up(self, action: FollowJoints, here: Array, slack: Slack) -> FollowJoints:
        """At which end of its play a joint comes to rest depends on the way, and a little the way on that."""
        left = 1.0 - action.times / max(float(action.times[-1]), 1e-9)
        rests, vertices = slack, action.vertices
        for _ in range(_GUESSES):
            vertices = self.errors.compensated(action.vertices) - rests.mean
            vertices = vertices + left[:, None] * (here - vertices[0])
            before, rests = rests, slack.after(self.arm, vertices)
            if np.allclose(before.mean, rests.mean, atol=STILL):
                break
        return replace(action, vertices=vertices)

    def _count(self, stops: Sequence[Array | tuple[float, ...] | None]) -> None:
        known = [np.asarray(joints) for joints in stops if joints is not None]
        if len(known) > 1:
            self.errors = self.errors.after(self.arm, np.array(known))

    def _lead(self, ways: Sequence[Array] | None, end: tuple[float, ...] | None) -> None:
        """Follow the joints through their play; None for ways that are the driver's affair."""
        if ways is not None and not ways:
            return
        if not ways or end is None or np.abs(ways[-1][-1] - end).max() > _ARRIVED:
            self.slack = Slack.unknown(self.arm)
        else:
            self.slack = self.slack.after(self.arm, np.concatenate([*ways, np.array([end])]))

    def seen(self, joints: Array, off: Array) -> None:
        """A piece that was set down with the joints at (n,) rad stands (3,) mm off; NaN: not seen.

        Commands had the expected error taken away: what is seen comes on top of it.
        """
        expected = jacobian(self.arm, joints)[:3] @ self.errors.mean
        play = SIDE_LEFT * self.arm.drift.play
        self.errors = self.errors.seen(self.arm, joints, off + expected, LOOK_SPREAD, play)
        self.looks += 1

    async def retract(self) -> None:
        """As `Robot.retract`."""
        before = self._robot.state.joints
        await self._robot.retract()
        self._count([before, self._robot.state.joints])
        self._lead(None, None)

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
        self._lead(None, None)
