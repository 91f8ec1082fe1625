"""What goes wrong between driver and controller: nothing is believed that did not happen."""

import asyncio
from dataclasses import replace

import pytest

from kempelen.core.errors import AlarmError, LinkError, RobotError
from kempelen.core.protocols import Follow, GripperState, RobotPhase, SetGripper
from kempelen.robots.grbl.gantry import GrblGantry
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.robots.grbl.timing import Timing
from kempelen.testing.contracts.robot import apart, gripper, here, inside, path, phase, until
from kempelen.testing.rigs import FAST, MemoryRig

OPEN = SetGripper(closed=False, seconds=0.1)
CLOSE = SetGripper(closed=True, seconds=0.1)


def long_way(robot: GrblGantry) -> Follow:
    start = here(robot)
    stops = [inside(robot.space, share, 0.5, 0.6) for share in (0.9, 0.1, 0.9, 0.1, 0.9)]
    return path(start, *stops)


async def under_way(robot: GrblGantry, rig: MemoryRig, *more: SetGripper) -> asyncio.Task[None]:
    before = rig.position()
    running = asyncio.create_task(robot.run([long_way(robot), *more]))
    await until(lambda: apart(rig.position(), before) > 30)
    return running


async def usable(robot: GrblGantry, rig: MemoryRig) -> None:
    """Whatever happened: recovered and homed, it is where it says."""
    if phase(robot) in {RobotPhase.ALARM, RobotPhase.DISCONNECTED}:
        await robot.recover()
    if not robot.state.homed:
        await robot.home()
    assert apart(here(robot), rig.position()) <= 0.1
    end = inside(robot.space, 0.4, 0.4, 0.9)
    await robot.run([path(here(robot), end), OPEN])
    assert apart(rig.position(), end) <= 0.1
    assert not rig.gripper_closed()


async def test_a_missing_acknowledgement_means_stop() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        running = await under_way(robot, rig)
        rig.controller.faults.swallow_oks = 1
        with pytest.raises(LinkError, match="owes 1 acknowledgements"):
            await running
        assert phase(robot) is RobotPhase.IDLE
        await usable(robot, rig)


async def test_a_missing_acknowledgement_of_a_gripper_command() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        rig.controller.faults.swallow_oks = 2
        with pytest.raises(LinkError, match="acknowledgements"):
            await robot.run([OPEN])
        await usable(robot, rig)


@pytest.mark.parametrize("seed", range(6))
async def test_noise_towards_the_controller_never_ends_in_a_false_success(seed: int) -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        faults = rig.controller.faults
        faults._random.seed(seed)
        faults.garble_in = 0.01
        group = [long_way(robot)]
        try:
            await robot.run(group)
            assert apart(rig.position(), group[0].vertices[-1].tolist()) <= 0.1
        except RobotError:
            stopped_at = rig.position()
            await asyncio.sleep(0.01)
            assert rig.position() == stopped_at
        faults.garble_in = 0.0
        await usable(robot, rig)


@pytest.mark.parametrize("seed", range(6))
async def test_noise_towards_the_host_never_ends_in_a_false_success(seed: int) -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        faults = rig.controller.faults
        faults._random.seed(seed)
        faults.garble_out = 0.002
        group = [long_way(robot)]
        try:
            await robot.run(group)
            assert apart(rig.position(), group[0].vertices[-1].tolist()) <= 0.1
        except RobotError:
            pass
        faults.garble_out = 0.0
        await usable(robot, rig)


async def test_the_board_restarts_by_itself() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        running = await under_way(robot, rig)
        rig.controller.faults.reset = True
        with pytest.raises(LinkError, match="restarted"):
            await running
        assert not robot.state.homed
        assert "power supply" in robot.state.message
        await usable(robot, rig)


async def test_the_board_restarts_at_rest() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        await robot.run([OPEN])
        rig.controller.faults.reset = True
        await until(lambda: not robot.state.homed)
        assert gripper(robot) is GripperState.CLOSED
        assert phase(robot) is RobotPhase.LOCKED
        await usable(robot, rig)


async def test_a_dead_switch() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        rig.controller.faults.dead_switches = {0}
        with pytest.raises(AlarmError, match="switch was not found"):
            await robot.home()
        assert not robot.state.homed
        rig.controller.faults.dead_switches = set()
        await usable(robot, rig)


async def test_lost_steps_end_at_a_limit_switch() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        await robot.run([path(here(robot), inside(robot.space, 0.5, 0.5, 0.5))])
        rig.controller.faults.lose_steps(0, -80 * 20)
        with pytest.raises(AlarmError, match="limit switch"):
            await robot.run([path(here(robot), (0.0, 200.0, 100.0))])
        assert not robot.state.homed
        assert phase(robot) is RobotPhase.ALARM
        await usable(robot, rig)


async def test_a_stop_right_after_an_alarm_is_not_forgotten() -> None:
    """In the half second after ALARM:1 the firmware loses a reset byte."""
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        await robot.run([path(here(robot), inside(robot.space, 0.5, 0.5, 0.5))])
        rig.controller.faults.lose_steps(0, -80 * 20)
        with pytest.raises(AlarmError, match="limit switch"):
            await robot.run([path(here(robot), (0.0, 200.0, 100.0))])
        await robot.stop()
        assert rig.controller.state == "Alarm"
        await usable(robot, rig)


async def test_the_line_falls_silent() -> None:
    async with MemoryRig() as rig, rig.robot(timing=replace(FAST, answer=0.1)) as robot:
        await robot.home()
        running = await under_way(robot, rig)
        rig.coupling.garble = lambda _output: b""
        with pytest.raises(LinkError, match="no answer"):
            await running
        assert phase(robot) is RobotPhase.DISCONNECTED
        assert b"!" in rig.coupling.sent  # perhaps it still heard that
        rig.coupling.garble = None
        await usable(robot, rig)


async def test_the_line_falls_silent_at_rest() -> None:
    async with MemoryRig() as rig, rig.robot(timing=replace(FAST, answer=0.1, idle_watch=0.02)) as robot:
        await robot.home()
        rig.coupling.garble = lambda _output: b""
        await until(lambda: phase(robot) is RobotPhase.DISCONNECTED)
        assert "no answer" in robot.state.message


async def test_homing_that_never_ends() -> None:
    async with MemoryRig() as rig, rig.robot(timing=replace(FAST, homing=0.05)) as robot:
        rig.controller.faults.swallow_oks = 1
        with pytest.raises(LinkError, match="did not end"):
            await robot.home()
        assert not robot.state.homed


async def test_a_cancelled_homing_is_broken_off() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        before = rig.position()
        homing = asyncio.create_task(robot.home())
        await until(lambda: apart(rig.position(), before) > 1)
        homing.cancel()
        with pytest.raises(asyncio.CancelledError):
            await homing
        stopped_at = rig.position()
        await asyncio.sleep(0.01)
        assert rig.position() == stopped_at
        await usable(robot, rig)


async def test_the_safety_door() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        running = await under_way(robot, rig)
        rig.controller.receive(b"\x84")
        rig.coupling._spoken_to.set()
        await until(lambda: phase(robot) is RobotPhase.HELD)
        assert "door" in robot.state.message
        await robot.resume()
        await running
        await usable(robot, rig)


async def test_a_hold_from_outside() -> None:
    """Somebody presses the board's own hold button at the end of a motion."""
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        running = await under_way(robot, rig)
        rig.controller.receive(b"!")
        await until(lambda: phase(robot) is RobotPhase.HELD)
        await robot.resume()
        await running
        await usable(robot, rig)


async def test_hold_during_the_settling_of_the_gripper() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        running = asyncio.create_task(robot.run([SetGripper(closed=False, seconds=2.0)]))
        await until(lambda: not rig.gripper_closed())
        await robot.hold()
        assert not running.done()
        await robot.resume()
        await running
        assert gripper(robot) is GripperState.OPEN


async def test_no_more_than_five_questions_a_second() -> None:
    """Each report costs the firmware a hundred bytes of its line."""
    async with MemoryRig() as rig, rig.robot(timing=Timing(quiet=0.05)) as robot:
        await robot.home()
        rig.coupling._step = 0.0002
        way = long_way(robot)
        back = path(way.vertices[-1].tolist(), way.vertices[0].tolist())
        running = asyncio.create_task(robot.run([way, back] * 20))
        await until(lambda: apart(rig.position(), way.vertices[0].tolist()) > 30)
        rig.coupling.sent.clear()
        loop = asyncio.get_running_loop()
        began = loop.time()
        for _ in range(4):
            await robot.hold()
            await asyncio.sleep(0.1)
            await robot.resume()
        await robot.hold()
        await asyncio.sleep(0.5)
        # Each hold may ask at once, each resume twice; beyond that, five a second.
        at_once = 5 + 2 * 4
        assert rig.coupling.sent.count(b"?") <= at_once + 5 * (loop.time() - began) + 1
        await robot.cancel()
        with pytest.raises(RobotError):
            await running


# --- this program dies, the board does not ---------------------------------------------------------------


async def test_killed_while_moving_with_an_open_gripper() -> None:
    """The board ends what is in its buffer; then it is found open, remembered, and not homed."""
    async with MemoryRig() as rig:
        async with rig.robot() as robot:
            await robot.home()
            await robot.run([OPEN])
            running = await under_way(robot, rig, CLOSE)
            rig.unplug()
            with pytest.raises(LinkError):
                await running
        async with rig.robot() as robot:
            assert robot.state.memory_kept
            assert not robot.state.homed
            assert gripper(robot) in {GripperState.OPEN, GripperState.CLOSED}
            assert (gripper(robot) is GripperState.CLOSED) == rig.gripper_closed()
            await usable(robot, rig)


@pytest.mark.parametrize("opened", [True, False])
async def test_killed_while_held(opened: bool) -> None:
    async with MemoryRig() as rig:
        async with rig.robot() as robot:
            await robot.home()
            await robot.run([SetGripper(closed=not opened, seconds=0)])
            running = await under_way(robot, rig)
            await robot.hold()
            rig.unplug()
            with pytest.raises(LinkError):
                await running
        held_at = rig.position()
        async with rig.robot() as robot:
            assert robot.state.memory_kept
            assert apart(rig.position(), held_at) <= 0.02
            assert (gripper(robot) is GripperState.OPEN) == opened
            assert rig.gripper_closed() != opened
            await usable(robot, rig)


async def test_killed_in_the_middle_of_a_line() -> None:
    """What a dead program left in the controller's line buffer must not become a motion."""
    async with MemoryRig() as rig:
        async with rig.robot() as robot:
            await robot.home()
        rig.controller.receive(b"G0X300")
        resting = rig.position()
        async with rig.robot() as robot:
            assert rig.position() == resting
            await usable(robot, rig)


async def test_killed_while_jogging() -> None:
    async with MemoryRig() as rig:
        async with rig.robot() as robot:
            await robot.home()
            await robot.jog((1.0, 1.0, -1.0), 20.0)
            await until(lambda: phase(robot) is RobotPhase.JOGGING)
            rig.unplug()
            with pytest.raises(LinkError):
                await robot.jog_stop()
        async with rig.robot() as robot:
            await usable(robot, rig)


async def test_killed_after_an_e_stop() -> None:
    async with MemoryRig() as rig:
        async with rig.robot() as robot:
            await robot.home()
            await robot.run([OPEN])
            await robot.stop()
            rig.unplug()
        async with rig.robot() as robot:
            assert gripper(robot) is GripperState.CLOSED
            await usable(robot, rig)


# --- work offsets ----------------------------------------------------------------------------------------


async def test_the_work_offset_is_written_once() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        assert rig.coupling.sent.count(b"G10L2P1") == 1
        rig.coupling.sent.clear()
        await robot.home()
        async with rig.robot() as other:
            await other.home()
        assert b"G10" not in rig.coupling.sent


async def test_negative_work_offsets_are_not_unhomed() -> None:
    """The original read "not homed" out of negative offsets; machine space is negative by nature."""
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        assert all(value < 0 for value in robot._session.greeting.offsets["G54"])
        assert robot.state.homed
        assert robot.state.reported_position == (0.0, 0.0, 200.0)


async def test_somebody_elses_offsets_do_not_matter() -> None:
    async with MemoryRig() as rig:
        async with rig.robot() as robot:
            await robot.home()
        for line in (b"G10L2P2X-100Y-100Z-100\n", b"G55\n", b"G92X0Y0Z0\n"):
            rig.controller.receive(line)
            rig.coupling._spoken_to.set()
            await until(rig.controller.idle)
        async with rig.robot() as robot:
            await usable(robot, rig)


async def test_reports_in_work_coordinates_do_as_well() -> None:
    async with MemoryRig() as rig:
        rig.controller.receive(b"$10=0\n")
        await until(rig.controller.idle)
        async with rig.robot() as robot:
            await usable(robot, rig)


async def test_a_servo_gripper() -> None:
    async with MemoryRig() as rig, rig.robot(wiring=GripperWiring.servo(200, 800)) as robot:
        await robot.home()
        await robot.run([OPEN])
        assert gripper(robot) is GripperState.OPEN
        assert rig.controller.spindle_rpm == 200
        running = await under_way(robot, rig, CLOSE)
        await robot.cancel()
        with pytest.raises(RobotError):
            await running
        assert rig.controller.spindle_rpm == 200  # told again after the reset
        await robot.run([CLOSE])
        assert rig.controller.spindle_rpm == 800
