"""What arms do beyond the contract: joint paths, switches, lost steps, wrong devices, damaged lines."""

import asyncio
import re
from itertools import pairwise

import numpy as np
import pytest

from kempelen.core.errors import AlarmError, BusyError, KempelenError, LinkError, MotionError, SettingsError
from kempelen.core.geometry import Array
from kempelen.core.protocols import Follow, FollowJoints, GripperState, Robot, RobotPhase, SetGripper
from kempelen.motion.arm.synchrony import synchronise
from kempelen.robots.arm.driver import StepperArm
from kempelen.robots.arm.latch.driver import LatchArm
from kempelen.testing.arm_rigs import ARM, SPACE, ArmRig
from kempelen.testing.contracts.robot import here, until
from kempelen.testing.rigs import FAST
from kempelen.testing.transports import Coupling
from kempelen.twin.grbl import FLUIDNC, Machine, VirtualArm, VirtualGrbl

HALF_STEP = np.radians(0.026) * 3  # of every motor that the pitch hangs on
both = pytest.mark.parametrize("bridge", ["grblhal", "latch"])


def joints(robot: Robot) -> Array:
    assert robot.state.joints is not None
    return np.array(robot.state.joints)


def turning(start: Array, *degrees: float) -> FollowJoints:
    """All joints together, by so many degrees each."""
    path = synchronise(ARM, start, start + np.radians(degrees))
    return FollowJoints(path.joints, path.times, path.seconds)


@both
async def test_joints_turn_together_and_in_time(bridge: str) -> None:
    async with ArmRig(bridge=bridge) as rig, rig.robot() as robot:
        await robot.home()
        start = joints(robot)
        action = turning(start, 50, -30, 40, 20, 90)
        began = rig.controller.time_s
        running = asyncio.create_task(robot.run([action]))
        shares = []
        while not running.done():
            turned = np.array(rig.controller.joints) - start
            shares.append(turned / (action.vertices[-1] - start))
            await asyncio.sleep(0)
        await running
        assert rig.controller.settled_at - began == pytest.approx(action.seconds, rel=0.05, abs=0.03)
        assert max(np.ptp(share) for share in shares) < 0.02
        assert np.abs(joints(robot) - action.vertices[-1]).max() <= HALF_STEP
        assert np.abs(np.array(rig.controller.joints) - action.vertices[-1]).max() <= HALF_STEP


@both
async def test_remainders_never_add_up(bridge: str) -> None:
    async with ArmRig(bridge=bridge) as rig, rig.robot() as robot:
        await robot.home()
        start = joints(robot)
        for _ in range(4):
            away = turning(start, 7.013, -3.007, 5.001, 1.003, 2.017)
            back = FollowJoints(away.vertices[::-1], away.times[-1] - away.times[::-1], away.seconds)
            await robot.run([away, back])
        assert np.abs(np.array(rig.controller.joints) - start).max() < 1e-9


@both
async def test_a_joint_path_goes_on_after_a_hold(bridge: str) -> None:
    async with ArmRig(bridge=bridge) as rig, rig.robot() as robot:
        await robot.home()
        action = turning(joints(robot), 120, 0, 0, 0, 0)
        running = asyncio.create_task(robot.run([SetGripper(closed=False, seconds=0.1), action]))
        await until(lambda: abs(rig.controller.joints[0]) > 0.5)
        await robot.hold()
        held = rig.controller.joints
        await asyncio.sleep(0.02)
        assert rig.controller.joints == held
        assert not rig.gripper_closed()
        await robot.resume()
        await running
        assert np.abs(np.array(rig.controller.joints) - action.vertices[-1]).max() <= HALF_STEP


@both
async def test_what_joints_cannot_do_is_refused_and_nothing_is_sent(bridge: str) -> None:
    async with ArmRig(bridge=bridge) as rig, rig.robot() as robot:
        await robot.home()
        start, sent = joints(robot), len(rig.coupling.sent)
        step = np.radians([0.0, 10.0, 0.0, 0.0, 0.0])
        for vertices, times, told in (
            ([start, start + 8 * step], [0, 9.0], r"shoulder would have to turn to 170\.0°, 21\.0° beyond"),
            ([start, start + step], [0, 0.1], r"shoulder would turn at 100\.0°/s, its limit is 60\.0°/s"),
            ([start + step, start], [0, 9.0], r"begins with shoulder at 100\.000°, it is at 90\.000°"),
            ([start, start + step], [0, 0.0], "times that rise from 0"),
            ([start, start * np.nan], [0, 1.0], "finite"),
            ([start[:4], start[:4]], [0, 1.0], r"\(2, 4\)"),
            ([start, start], [0.0], r"times \(1,\)"),
        ):
            action = FollowJoints(np.array(vertices), np.array(times), 1.0)
            with pytest.raises(MotionError, match=told):
                await robot.run([SetGripper(closed=False, seconds=0), action])
        assert b"M8" not in rig.coupling.sent[sent:]
        assert b"G 0" not in rig.coupling.sent[sent:]
        assert rig.gripper_closed()
        assert robot.state.phase is RobotPhase.IDLE


@both
async def test_the_tool_point_keeps_to_its_line(bridge: str) -> None:
    async with ArmRig(bridge=bridge) as rig, rig.robot() as robot:
        await robot.home()
        ends = np.array([here(robot), (200.0, 140.0, 320.0), (330.0, -130.0, 100.0)])
        await robot.run([Follow(ends[:2], 0.0)])
        begin = np.array(here(robot))
        running = asyncio.create_task(robot.run([Follow(np.array([begin, ends[2]]), 0.0)]))
        way = (ends[2] - begin) / np.linalg.norm(ends[2] - begin)
        bows = [0.0]
        while not running.done():
            off = np.array(rig.position()) - begin
            bows.append(float(np.linalg.norm(off - (off @ way) * way)))
            await asyncio.sleep(0)
        await running
        assert 0.1 < max(bows) < 3.0


async def test_a_place_out_of_reach_is_told_and_nothing_moves() -> None:
    space = SPACE.model_copy(update={"upper": (600.0, 150.0, 345.0)})
    async with ArmRig() as rig, StepperArm(rig.connect, ARM, space, timing=FAST) as robot:
        await robot.home()
        start = here(robot)
        with pytest.raises(MotionError, match="mm"):
            await robot.run([Follow(np.array([start, (590.0, 0.0, 200.0)]), 0.0)])
        assert rig.position() == pytest.approx(start)
        await robot.jog((1.0, 0.0, 0.0), 100.0)
        for _ in range(200):
            await robot.jog((1.0, 0.0, 0.0), 100.0)
            await asyncio.sleep(0.005)
        await robot.jog_stop()
        assert 300 < here(robot)[0] < 500  # at the edge of its reach it stands
        await robot.retract()


# --- switches and lost steps --------------------------------------------------------------------------------


@both
async def test_joints_that_stand_on_their_switches_leave_them_first(bridge: str) -> None:
    beyond = tuple(np.radians([30.0, 120.0, -130.0, -3.0, -20.0]))
    async with ArmRig(bridge=bridge, joints=beyond) as rig, rig.robot() as robot:
        await robot.home()
        assert rig.controller.joints == pytest.approx(ARM.home.tolist(), abs=1e-3)


@both
async def test_a_switch_that_never_closes_names_its_joint(bridge: str) -> None:
    async with ArmRig(bridge=bridge) as rig, rig.robot() as robot:
        rig.controller.faults.dead_switches = {2}
        with pytest.raises(AlarmError, match="While homing the elbow: .* not found"):
            await robot.home()
        assert robot.state.phase is RobotPhase.ALARM
        assert not robot.state.homed
        resting = rig.controller.joints
        await asyncio.sleep(0.02)
        assert rig.controller.joints == resting
        rig.controller.faults.dead_switches = set()
        await robot.recover()
        await robot.home()
        assert robot.state.homed


@both
async def test_a_stalled_joint_is_not_taken_for_homed(bridge: str) -> None:
    async with ArmRig(bridge=bridge) as rig, rig.robot() as robot:
        rig.controller.faults.stalled = {0}
        with pytest.raises(AlarmError, match="While homing the base"):
            await robot.home()


@both
async def test_lost_steps_are_found_when_the_arm_is_homed_again(bridge: str) -> None:
    async with ArmRig(bridge=bridge) as rig, rig.robot() as robot:
        await robot.home()
        await robot.run([turning(joints(robot), 20, -20, 10, 5, 30)])
        await robot.home()
        assert robot.lost is not None
        assert robot.lost.steps == (0, 0, 0, 0, 0)
        rig.controller.faults.lose_steps(1, 30)
        rig.controller.faults.lose_steps(3, -12)
        await robot.home()
        steps = robot.lost.steps
        assert [abs(a or 0) for a in steps] == pytest.approx([0, 30, 0, 12, 0], abs=1)
        assert np.sign(steps[1] or 0) == -np.sign(steps[3] or 0)


@both
async def test_too_many_lost_steps_are_an_error_with_the_arm_at_rest(bridge: str) -> None:
    async with ArmRig(bridge=bridge, most_lost=20) as rig, rig.robot() as robot:
        await robot.home()
        rig.controller.faults.lose_steps(0, 130)
        with pytest.raises(AlarmError, match=r"The base had lost 1(29|30|31) steps .* allowed 20 steps"):
            await robot.home()
        assert robot.state.phase is RobotPhase.IDLE
        assert rig.controller.joints == pytest.approx(ARM.home.tolist(), abs=1e-3)
        await robot.home()
        assert robot.lost is not None
        assert robot.lost.steps == (0, 0, 0, 0, 0)


async def test_more_than_can_be_looked_for() -> None:
    async with ArmRig() as rig, rig.robot() as robot:
        await robot.home()
        rig.controller.faults.lose_steps(0, -2000)
        with pytest.raises(AlarmError, match="The base had lost more than 30°"):
            await robot.home()


# --- the line -----------------------------------------------------------------------------------------------


@both
async def test_a_damaged_line_ends_the_motion_at_rest(bridge: str) -> None:
    async with ArmRig(bridge=bridge) as rig, rig.robot() as robot:
        await robot.home()
        action = turning(joints(robot), 100, 0, 0, 0, 0)
        running = asyncio.create_task(robot.run([action]))
        await until(lambda: abs(rig.controller.joints[0]) > 0.2)
        rig.controller.faults.swallow_oks = 1
        with pytest.raises(LinkError):
            await running
        rig.controller.faults.swallow_oks = 0
        await until(rig.controller.idle)
        await robot.recover()
        await robot.home()


async def test_the_bridge_carries_nothing_out_after_a_damaged_line() -> None:
    async with ArmRig(bridge="latch") as rig, rig.robot() as robot:
        await robot.home()
        action = turning(joints(robot), 100, -20, 10, 0, 0)
        running = asyncio.create_task(robot.run([action]))
        await until(lambda: abs(rig.controller.joints[0]) > 0.2)
        rig.controller.faults.garble_in = 0.02
        with pytest.raises(KempelenError):
            await running
        rig.controller.faults.garble_in = 0.0
        # Only whole blocks of the path were driven: the joints are still in proportion.
        turned = np.degrees(np.array(rig.controller.joints) - ARM.home)
        assert turned[1] / turned[0] == pytest.approx(-0.2, abs=0.01)
        await robot.recover()
        await robot.home()


async def test_another_controller_on_the_port() -> None:
    gantry = VirtualGrbl(Machine((700.0, 450.0, 200.0), (-400.0, -250.0, -100.0)))
    async with Coupling(gantry) as line:
        with pytest.raises(LinkError, match=r"has 3 axes, the arm needs 5 \(XYZAB\)"):
            async with StepperArm(line.connect, ARM, SPACE, timing=FAST):
                pass
    async with Coupling(gantry) as line:
        with pytest.raises(LinkError, match="not a latch bridge"):
            async with LatchArm(line.connect, ARM, SPACE, timing=FAST):
                pass
    async with ArmRig(bridge="latch") as rig:
        with pytest.raises(LinkError, match="not GRBL"):
            async with StepperArm(rig.connect, ARM, SPACE, timing=FAST):
                pass


async def test_settings_that_do_not_fit_are_named_and_mended() -> None:
    async with ArmRig() as rig:
        assert isinstance(rig.controller, VirtualArm)
        rig.controller.eeprom.settings.store(102, 10.0)
        rig.controller.eeprom.settings.store(20, 1.0)
        with pytest.raises(
            SettingsError, match=r"\$102 is 10: steps of a degree of the motor of elbow is 20"
        ):
            async with rig.robot():
                pass
        async with StepperArm(rig.connect, ARM, SPACE, timing=FAST, apply_settings=True) as robot:
            await robot.home()
        assert rig.controller.eeprom.settings[102] == 20.0
        assert rig.controller.eeprom.settings[20] == 0.0


async def test_fluidnc() -> None:
    async with ArmRig(dialect=FLUIDNC) as rig, rig.robot() as robot:
        await robot.home()
        action = turning(joints(robot), 5, -5, 5, 5, 5)
        await robot.run([action])
        assert np.abs(np.array(rig.controller.joints) - action.vertices[-1]).max() <= HALF_STEP


async def test_every_stretch_has_its_inverse_time() -> None:
    async with ArmRig() as rig, rig.robot() as robot:
        await robot.home()
        mark = len(rig.coupling.sent)
        action = turning(joints(robot), 10, -5, 0, 0, 3)
        await robot.run([action])
        lines = [line for line in bytes(rig.coupling.sent[mark:]).replace(b"?", b"").split(b"\n") if line]
        assert lines[0] == b"G21G54G90G93"
        assert lines[-2:] == [b"G94F77", b"G4P0"]
        pattern = re.compile(rb"G1X(\S+)Y(\S+)Z(\S+)A(\S+)B(\S+)F([0-9.]+)")
        stretches = [pattern.fullmatch(line) for line in lines[1:-2]]
        assert all(stretches)
        times = [60.0 / float(match[6]) for match in stretches if match]
        assert (
            action.seconds - 0.05 < sum(times) <= action.seconds + 1e-3
        )  # the last of it is less than a step
        angles = np.array([[float(match[k]) for k in range(1, 6)] for match in stretches if match])
        assert np.abs(angles * 20 - np.rint(angles * 20)).max() < 1e-6  # whole steps
        assert all((np.abs(b - a) > 0).any() for a, b in pairwise(angles))


@both
async def test_what_is_remembered_when_the_program_comes_back(bridge: str) -> None:
    async with ArmRig(bridge=bridge) as rig:
        async with rig.robot() as robot:
            assert not robot.state.memory_kept
            await robot.home()
            await robot.run([SetGripper(closed=False, seconds=0.0)])
        async with rig.robot() as robot:
            assert robot.state.memory_kept
            assert robot.state.gripper is GripperState.OPEN
            assert not rig.gripper_closed()


async def test_an_arm_is_busy_while_it_homes() -> None:
    async with ArmRig() as rig, rig.robot() as robot:
        homing = asyncio.create_task(robot.home())
        await asyncio.sleep(0)
        with pytest.raises(BusyError, match="The arm is busy"):
            await robot.run([])
        await homing
