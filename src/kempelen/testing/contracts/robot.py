"""What every `kempelen.core.protocols.Robot` must do.

Inherit from `RobotContract` in a test module and give it a ``rig``::

    class TestMyRobot(RobotContract):
        @pytest_asyncio.fixture
        async def rig(self):
            yield MyRig()

The machine behind the rig has just been switched on. Times are the machine's own: nothing here measures them.
"""

import asyncio
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
import pytest

from kempelen.core.errors import BusyError, LinkError, MotionError, NotHomedError, RobotError, StoppedError
from kempelen.core.protocols import Follow, GripperState, Robot, RobotPhase, RobotState, SetGripper
from kempelen.core.table import WorkSpace

_PATIENCE = 20.0  # s, wall clock; a machine that takes longer has failed


class Rig(Protocol):
    """A machine, and drivers for it."""

    def robot(self) -> Robot:
        """A new driver for the machine, not entered yet."""
        ...

    def position(self) -> tuple[float, float, float]:
        """Where the tool point truly is, robot frame, mm."""
        ...

    def gripper_closed(self) -> bool:
        """What the gripper truly is told."""
        ...

    def unplug(self) -> None:
        """Pull the cable; it is plugged in again when a driver connects."""
        ...


def path(*points: Sequence[float]) -> Follow:
    """A polyline through tool points, robot frame, mm."""
    return Follow(np.array(points, dtype=np.float64), seconds=0.0)


def inside(space: WorkSpace, *shares: float) -> tuple[float, float, float]:
    """The point at these shares of the work space."""
    x, y, z = (
        round(low + share * (high - low))
        for low, high, share in zip(space.lower, space.upper, shares, strict=True)
    )
    return float(x), float(y), float(z)


def here(robot: Robot) -> tuple[float, float, float]:
    """Where the robot says it is, mm."""
    assert robot.state.reported_position is not None
    return robot.state.reported_position


def phase(robot: Robot) -> RobotPhase:
    """Asked anew each time."""
    return robot.state.phase


def gripper(robot: Robot) -> GripperState:
    """Asked anew each time."""
    return robot.state.gripper


def apart(a: Sequence[float], b: Sequence[float]) -> float:
    """Largest distance along an axis, mm."""
    return float(np.abs(np.subtract(a, b)).max())


async def until(condition: Callable[[], bool]) -> None:
    """Let the machine work until something is so."""
    async with asyncio.timeout(_PATIENCE):
        while not condition():  # noqa: ASYNC110 - the machine is another process; there is no event to wait for
            await asyncio.sleep(0.001)


class RobotContract:
    """The suite; each test gets a machine that has just been switched on.

    Attributes:
        tolerance: mm between where a robot is told to be, where it says that it is and where it is: motors
            make whole steps.
    """

    tolerance = 0.3

    async def _homed(self, robot: Robot) -> tuple[float, float, float]:
        await robot.home()
        return here(robot)

    async def _under_way(
        self, robot: Robot, rig: Rig
    ) -> tuple[asyncio.Task[None], tuple[float, float, float]]:
        """A long way begun: the task and its end."""
        start = await self._homed(robot)
        end = inside(robot.space, 0.9, 0.5, 0.5)
        began = rig.position()
        running = asyncio.create_task(robot.run([path(start, end)]))
        await until(lambda: apart(rig.position(), began) > 30)
        return running, end

    # --- power-up and homing -------------------------------------------------------------------------------

    async def test_after_power_up_nothing_is_believed(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            assert phase(robot) is RobotPhase.LOCKED
            assert not robot.state.homed
            assert not robot.state.memory_kept
            assert robot.state.reported_position is None
            assert robot.state.message
            before = rig.position()
            with pytest.raises(NotHomedError):
                await robot.run([path((0, 0, 0), (1, 1, 1))])
            with pytest.raises(NotHomedError):
                await robot.jog((1.0, 0.0, 0.0), 10.0)
            assert apart(rig.position(), before) <= self.tolerance
        assert phase(robot) is RobotPhase.DISCONNECTED

    async def test_home(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            await robot.home()
            assert robot.state.homed
            assert phase(robot) is RobotPhase.IDLE
            assert robot.space.excess(np.array(here(robot))) == 0.0
            assert apart(here(robot), rig.position()) <= self.tolerance

    async def test_unconnected_it_refuses(self, rig: Rig) -> None:
        robot = rig.robot()
        assert phase(robot) is RobotPhase.DISCONNECTED
        with pytest.raises(LinkError):
            await robot.home()

    # --- following -----------------------------------------------------------------------------------------

    async def test_follow_ends_at_the_end(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            start = await self._homed(robot)
            points = [
                start,
                *(
                    inside(robot.space, *shares)
                    for shares in ((0.5, 0.5, 1), (0.5, 0.5, 0.1), (0.2, 0.9, 0.6))
                ),
            ]
            await robot.run([path(*points)])
            assert apart(here(robot), points[-1]) <= self.tolerance
            assert apart(rig.position(), points[-1]) <= self.tolerance
            assert phase(robot) is RobotPhase.IDLE

    async def test_a_group_with_the_gripper_is_carried_out_in_order(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            start = await self._homed(robot)
            end = inside(robot.space, 0.3, 0.3, 0.5)
            await robot.run([SetGripper(closed=False, seconds=0.1)])
            assert gripper(robot) is GripperState.OPEN
            assert not rig.gripper_closed()
            running = asyncio.create_task(robot.run([path(start, end), SetGripper(closed=True, seconds=0.1)]))
            await until(rig.gripper_closed)
            assert apart(rig.position(), end) <= self.tolerance
            await running
            assert gripper(robot) is GripperState.CLOSED

    async def test_a_fine_curve(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            start = np.array(await self._homed(robot))
            end = np.array(inside(robot.space, 0.8, 0.6, 0.2))
            share = np.linspace(0.0, 1.0, 120)[:, None]
            curve = start + (end - start) * np.hstack([share, share**2, share**3])
            await robot.run([Follow(curve, 0.0), path(curve[-1].tolist(), start.tolist())])
            assert apart(rig.position(), start.tolist()) <= self.tolerance

    async def test_retract_goes_straight_up(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            start = await self._homed(robot)
            low = inside(robot.space, 0.5, 0.5, 0.2)
            await robot.run([path(start, low)])
            await robot.retract()
            assert apart(rig.position(), (low[0], low[1], robot.space.upper[2])) <= self.tolerance

    async def test_out_of_reach_is_refused_with_the_numbers_and_nothing_moves(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            start = await self._homed(robot)
            beyond = robot.space.upper[0] + 12.0
            with pytest.raises(MotionError, match=f"{beyond:.3f}"):
                await robot.run(
                    [SetGripper(closed=False, seconds=0), path(start, (beyond, start[1], start[2]))]
                )
            assert apart(rig.position(), start) <= self.tolerance
            assert rig.gripper_closed()
            assert phase(robot) is RobotPhase.IDLE

    async def test_a_path_that_begins_elsewhere_is_refused(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            await self._homed(robot)
            with pytest.raises(MotionError):
                await robot.run(
                    [path(inside(robot.space, 0.5, 0.5, 0.5), inside(robot.space, 0.6, 0.5, 0.5))]
                )

    async def test_a_second_group_is_refused_until_the_first_has_ended(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            running, end = await self._under_way(robot, rig)
            with pytest.raises(BusyError):
                await robot.run([SetGripper(closed=False, seconds=0)])
            with pytest.raises(BusyError):
                await robot.home()
            with pytest.raises(BusyError):
                await robot.jog((1.0, 0.0, 0.0), 10.0)
            await running
            assert apart(rig.position(), end) <= self.tolerance
            await robot.run([SetGripper(closed=False, seconds=0)])

    # --- pause, cancel, stop -------------------------------------------------------------------------------

    async def test_hold_and_resume(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            running, end = await self._under_way(robot, rig)
            await robot.hold()
            assert phase(robot) is RobotPhase.HELD
            held_at = rig.position()
            assert apart(held_at, end) > self.tolerance
            await asyncio.sleep(0.02)
            assert apart(rig.position(), held_at) <= self.tolerance
            assert not running.done()
            await robot.resume()
            await running
            assert apart(rig.position(), end) <= self.tolerance
            assert phase(robot) is RobotPhase.IDLE

    async def test_hold_between_groups_keeps_the_next_one_waiting(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            start = await self._homed(robot)
            await robot.hold()
            assert phase(robot) is RobotPhase.HELD
            end = inside(robot.space, 0.2, 0.2, 0.9)
            running = asyncio.create_task(robot.run([path(start, end)]))
            await asyncio.sleep(0.02)
            assert apart(rig.position(), start) <= self.tolerance
            await robot.resume()
            await running
            assert apart(rig.position(), end) <= self.tolerance

    async def test_homing_goes_on_after_a_hold(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            before = rig.position()
            homing = asyncio.create_task(robot.home())
            await until(lambda: apart(rig.position(), before) > 1)
            await robot.hold()
            held_at = rig.position()
            await asyncio.sleep(0.02)
            assert apart(rig.position(), held_at) <= self.tolerance
            await robot.resume()
            await homing
            assert robot.state.homed

    async def test_cancel_keeps_the_position(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            running, end = await self._under_way(robot, rig)
            await robot.cancel()
            with pytest.raises(StoppedError):
                await running
            await self._at_rest_and_usable(robot, rig, end)

    async def test_cancel_while_held(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            running, end = await self._under_way(robot, rig)
            await robot.hold()
            await robot.cancel()
            with pytest.raises(StoppedError):
                await running
            await self._at_rest_and_usable(robot, rig, end)

    async def test_a_cancelled_task_leaves_the_machine_at_rest(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            running, end = await self._under_way(robot, rig)
            running.cancel()
            with pytest.raises(asyncio.CancelledError):
                await running
            await self._at_rest_and_usable(robot, rig, end)

    async def _at_rest_and_usable(self, robot: Robot, rig: Rig, end: tuple[float, float, float]) -> None:
        stopped_at = rig.position()
        assert apart(stopped_at, end) > self.tolerance
        await asyncio.sleep(0.02)
        assert apart(rig.position(), stopped_at) <= self.tolerance
        assert robot.state.homed
        assert phase(robot) is RobotPhase.IDLE
        assert apart(here(robot), stopped_at) <= self.tolerance
        await robot.run([path(here(robot), end)])
        assert apart(rig.position(), end) <= self.tolerance

    async def test_cancel_keeps_the_gripper(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            start = await self._homed(robot)
            await robot.run([SetGripper(closed=False, seconds=0)])
            end = inside(robot.space, 0.9, 0.5, 0.5)
            running = asyncio.create_task(robot.run([path(start, end), SetGripper(closed=True, seconds=0)]))
            await until(lambda: apart(rig.position(), start) > 30)
            await robot.cancel()
            with pytest.raises(StoppedError):
                await running
            assert gripper(robot) is GripperState.OPEN
            assert not rig.gripper_closed()

    async def test_stop_acts_at_once_and_needs_homing(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            running, end = await self._under_way(robot, rig)
            await robot.stop()
            with pytest.raises(StoppedError):
                await running
            stopped_at = rig.position()
            assert apart(stopped_at, end) > self.tolerance
            await asyncio.sleep(0.02)
            assert apart(rig.position(), stopped_at) <= self.tolerance
            assert not robot.state.homed
            assert robot.state.message
            with pytest.raises(RobotError):
                await robot.run([path((0, 0, 0), (1, 1, 1))])
            await robot.recover()
            with pytest.raises(NotHomedError):
                await robot.run([path((0, 0, 0), (1, 1, 1))])
            await robot.home()
            assert apart(here(robot), rig.position()) <= self.tolerance

    async def test_stop_while_held_and_while_homing(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            before = rig.position()
            homing = asyncio.create_task(robot.home())
            await until(lambda: apart(rig.position(), before) > 1)
            await robot.stop()
            with pytest.raises(StoppedError):
                await homing
            await robot.recover()
            running, _ = await self._under_way(robot, rig)
            await robot.hold()
            await robot.stop()
            with pytest.raises(StoppedError):
                await running
            assert not robot.state.homed
            await robot.recover()
            await robot.home()
            assert robot.state.homed

    async def test_stop_with_nothing_at_work(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            await self._homed(robot)
            await robot.stop()
            assert not robot.state.homed
            await robot.recover()
            await robot.home()
            assert robot.state.homed

    # --- the line ------------------------------------------------------------------------------------------

    async def test_a_lost_line_is_an_error_and_nothing_is_sent_twice(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            running, _ = await self._under_way(robot, rig)
            rig.unplug()
            with pytest.raises(LinkError):
                await running
            assert phase(robot) is RobotPhase.DISCONNECTED
            assert not robot.state.homed
            assert robot.state.message
            with pytest.raises(LinkError):
                await robot.home()
            await robot.recover()
            assert not robot.state.homed
            resting = rig.position()
            await asyncio.sleep(0.02)
            assert apart(rig.position(), resting) <= self.tolerance
            await robot.home()
            assert apart(here(robot), rig.position()) <= self.tolerance

    async def test_leaving_brings_the_machine_to_rest(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            running, end = await self._under_way(robot, rig)
        with pytest.raises(RobotError):
            await running
        stopped_at = rig.position()
        assert apart(stopped_at, end) > self.tolerance
        await asyncio.sleep(0.02)
        assert apart(rig.position(), stopped_at) <= self.tolerance

    async def test_it_can_be_entered_again(self, rig: Rig) -> None:
        robot = rig.robot()
        async with robot:
            await robot.home()
        async with robot:
            assert not robot.state.homed
            await robot.home()
            assert robot.state.homed

    # --- jogging -------------------------------------------------------------------------------------------

    async def test_a_jog_ends_by_itself(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            start = await self._homed(robot)
            await robot.jog((1.0, 1.0, -1.0), 40.0)
            await until(lambda: phase(robot) is RobotPhase.JOGGING)
            await until(lambda: phase(robot) is RobotPhase.IDLE)
            assert apart(rig.position(), start) > 1
            assert apart(here(robot), rig.position()) <= self.tolerance
            await robot.run([path(here(robot), start)])
            assert apart(rig.position(), start) <= self.tolerance

    async def test_a_jog_is_kept_alive_and_ended(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            start = await self._homed(robot)
            direction = (1.0, 0.0, 0.0) if start[0] < robot.space.upper[0] / 2 else (-1.0, 0.0, 0.0)
            for _ in range(3):
                await robot.jog(direction, 60.0)
                await asyncio.sleep(0.05)
            await robot.jog_stop()
            assert phase(robot) is RobotPhase.IDLE
            stopped_at = rig.position()
            assert apart(stopped_at, start) > 1
            assert apart(here(robot), stopped_at) <= self.tolerance
            await asyncio.sleep(0.02)
            assert apart(rig.position(), stopped_at) <= self.tolerance

    async def test_a_jog_stays_within_the_work_space(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            await self._homed(robot)
            await robot.jog((0.0, 0.0, 1.0), 100.0)
            await asyncio.sleep(0.05)
            await robot.jog_stop()
            assert robot.space.excess(np.array(here(robot))) <= self.tolerance

    async def test_a_jog_refuses_nonsense(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            await self._homed(robot)
            for direction, speed in (
                ((0.0, 0.0, 0.0), 10.0),
                ((1.0, 0.0, 0.0), 0.0),
                ((1.0, 0.0, 0.0), float("nan")),
            ):
                with pytest.raises(MotionError):
                    await robot.jog(direction, speed)
            assert phase(robot) is RobotPhase.IDLE

    async def test_stop_ends_a_jog(self, rig: Rig) -> None:
        async with rig.robot() as robot:
            start = await self._homed(robot)
            await robot.jog((1.0, 1.0, -1.0), 40.0)
            await until(lambda: apart(rig.position(), start) > 1)
            await robot.stop()
            stopped_at = rig.position()
            await asyncio.sleep(0.02)
            assert apart(rig.position(), stopped_at) <= self.tolerance
            assert not robot.state.homed
            with pytest.raises(StoppedError):
                await robot.jog_stop()
            await robot.recover()
            await robot.home()

    # --- watching ------------------------------------------------------------------------------------------

    async def test_watchers_see_what_happens_and_end_with_the_robot(self, rig: Rig) -> None:
        seen: list[RobotState] = []
        async with rig.robot() as robot:
            watching = asyncio.create_task(_collect(robot, seen))
            await until(lambda: bool(seen))
            await robot.home()
        await watching
        phases = [state.phase for state in seen]
        assert phases[0] is RobotPhase.LOCKED
        assert RobotPhase.HOMING in phases
        assert phases[-1] is RobotPhase.DISCONNECTED


async def _collect(robot: Robot, seen: list[RobotState]) -> None:
    async for state in robot.watch():
        seen.append(state)  # noqa: PERF401 - the list is read while it grows
