"""The gantry's rarer turns, each on a script."""

import asyncio

import pytest

from kempelen.core.errors import AlarmError, BusyError, LinkError, SettingsError, StoppedError
from kempelen.core.protocols import RobotPhase, SetGripper
from kempelen.robots.grbl.session import finish
from kempelen.testing.contracts.robot import apart, here, inside, path, phase, until
from kempelen.testing.grbl import (
    BANNER,
    CORNER,
    OK,
    PULL_OFF,
    RESET,
    UNLOCK,
    expect_boot,
    expect_homing,
    expect_inventory,
    gantry,
    homed,
    offsets,
    report,
    turns,
)
from kempelen.testing.rigs import MemoryRig
from kempelen.testing.wires import ScriptedWire

GO = [path(CORNER, (100.0, 0.0, 200.0))]
GO_LINES = b"G21G54G90G0\nX100\nG4P0\n"
HALFWAY = (50.0, 0.0, 200.0)
RESTORED = b"G21G54G90F77\n"


# --- homing that cannot be believed ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ([(b"$H\n", b"error:5\r\n")], "homing is switched off"),
        ([(b"$H\n", OK), (b"?", report("Alarm", PULL_OFF))], "ended in the state Alarm"),
        ([(b"$H\n", OK), (b"?", report("Idle", (350.0, -3.0, 203.0)))], "x is 355.000 mm from the end"),
    ],
)
async def test_homing_without_proof(answer: list[tuple[bytes, bytes]], words: str) -> None:
    wire = ScriptedWire()
    expect_boot(wire)
    for said, heard in answer:
        wire.expect(said, heard)
    async with gantry(wire) as robot:
        with pytest.raises(AlarmError, match=words):
            await robot.home()
        assert not robot.state.homed
    wire.assert_done()


async def test_a_work_offset_that_does_not_stick() -> None:
    wire = ScriptedWire()
    wire.say(BANNER + UNLOCK)
    expect_inventory(wire, offsets_reply=offsets(g54="0.000,0.000,0.000"))
    wire.expect(b"$H\n", OK).expect(b"?", report("Idle", PULL_OFF))
    wire.expect(b"G10L2P1X-705Y-455Z-205\n", OK).expect(b"$#\n", offsets(g54="0.000,0.000,0.000"))
    async with gantry(wire) as robot:
        with pytest.raises(SettingsError, match="G54 stays at"):
            await robot.home()
        assert not robot.state.homed
    wire.assert_done()


async def test_an_open_gripper_is_opened_again_before_homing_lifts() -> None:
    """After an e-stop it has fallen shut, perhaps around a standing piece."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"G21G54G90G0\nM8\nG4P0\n", OK * 3).expect(b"?", report("Idle"))
        await robot.run([SetGripper(closed=False, seconds=0.0)])
        wire.expect(b"!" + RESET, BANNER)
        await robot.stop()
        wire.expect(b"?", report("Idle")).expect(b"?", report("Idle")).expect(RESTORED, OK).expect(
            b"M8\n", OK
        )
        expect_homing(wire)
        await robot.home()
    wire.assert_done()


# --- the end of a run ------------------------------------------------------------------------------------


async def test_at_rest_elsewhere_is_a_lost_line() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK * 3)
        for _ in range(5):
            wire.expect(b"?", report("Idle", HALFWAY))
        wire.expect(b"!").expect(b"?", report("Hold:0", HALFWAY)).expect(RESET, BANNER)
        wire.expect(b"?", report("Idle", HALFWAY)).expect(RESTORED, OK)
        with pytest.raises(LinkError, match=r"50\.000 mm from its target"):
            await robot.run(GO)
    wire.assert_done()


async def test_locked_at_the_end_of_a_run() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK * 3).expect(b"?", report("Alarm", HALFWAY))
        with pytest.raises(AlarmError, match="locked itself"):
            await robot.run(GO)
    wire.assert_done()


async def test_a_lock_unseen_is_an_alarm_not_a_damaged_line() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, b"error:9\r\n" * 3).expect(b"!").expect(b"?", report("Alarm", HALFWAY))
        with pytest.raises(AlarmError, match="locked"):
            await robot.run(GO)
    wire.assert_done()


# --- recovering ------------------------------------------------------------------------------------------


async def test_recover_waits_for_the_banner_that_an_alarm_announces() -> None:
    """Somebody pressed the board's reset button in mid-motion: ALARM:3, half a second, banner."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK + b"ALARM:3\r\n")
        with pytest.raises(AlarmError):
            await robot.run(GO)
        recovering = asyncio.create_task(robot.recover())
        await turns()
        wire.assert_done()  # nothing is asked in that half second
        wire.expect(b"?", report("Alarm")).expect(b"$X\n", OK)
        wire.expect(b"?", report("Idle")).expect(RESTORED, OK)
        wire.say(BANNER + UNLOCK)
        await recovering
        assert phase(robot) is RobotPhase.LOCKED
    wire.assert_done()


async def test_recover_ends_a_hold_left_over() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"?", report("Hold:0")).expect(RESET, BANNER)
        wire.expect(b"?", report("Idle")).expect(b"?", report("Idle")).expect(RESTORED, OK)
        await robot.recover()
        assert robot.state.homed
    wire.assert_done()


async def test_recover_that_does_not_come_to_rest_restores_nothing() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"?", report("Alarm")).expect(b"$X\n", OK).expect(b"?", report("Door:1"))
        await robot.recover()
        assert phase(robot) is RobotPhase.HELD
        assert "door" in robot.state.message
    wire.assert_done()


async def test_recover_is_refused_while_something_is_at_work() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        end = inside(robot.space, 0.9, 0.5, 0.5)
        running = asyncio.create_task(robot.run([path(here(robot), end)]))
        await until(lambda: apart(rig.position(), CORNER) > 1)
        with pytest.raises(BusyError):
            await robot.recover()
        await running


async def test_a_stop_that_nobody_confirms() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"!" + RESET).expect(RESET * 3)
        with pytest.raises(LinkError, match="no banner"):
            await robot.stop()
        assert not robot.state.homed
    wire.assert_done()


async def test_cancelling_twice_does_not_hurry_the_end() -> None:
    done = asyncio.Event()
    released = asyncio.Event()

    async def work() -> None:
        await released.wait()
        done.set()

    finishing = asyncio.create_task(finish(work()))
    for _ in range(3):
        await turns()
        finishing.cancel()
    await turns()
    assert not finishing.done()
    released.set()
    with pytest.raises(asyncio.CancelledError):
        await finishing
    assert done.is_set()


# --- pauses ----------------------------------------------------------------------------------------------


async def test_hold_ends_a_jog_and_forbids_another() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        await robot.jog((1.0, 1.0, -1.0), 20.0)
        await until(lambda: phase(robot) is RobotPhase.JOGGING)
        await robot.hold()
        assert phase(robot) is RobotPhase.HELD
        with pytest.raises(BusyError, match="paused"):
            await robot.jog((1.0, 0.0, 0.0), 20.0)
        await robot.cancel()
        assert phase(robot) is RobotPhase.IDLE
        assert apart(here(robot), rig.position()) <= 0.05


async def test_cancel_ends_a_jog() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        await robot.jog((1.0, 1.0, -1.0), 20.0)
        await until(lambda: phase(robot) is RobotPhase.JOGGING)
        await robot.cancel()
        assert phase(robot) is RobotPhase.IDLE
        assert robot.state.homed


async def test_resume_and_cancel_with_nothing_at_work_do_nothing() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        await robot.resume()
        await robot.cancel()
    wire.assert_done()


async def test_a_group_waiting_at_a_pause_is_cancelled_without_a_byte() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        await robot.hold()
        running = asyncio.create_task(robot.run(GO))
        await turns()
        await robot.cancel()
        with pytest.raises(StoppedError):
            await running
        assert phase(robot) is RobotPhase.IDLE
    wire.assert_done()


async def test_a_jog_that_loses_its_line() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"$J=G21G90X5Y0Z200F3000\n", OK).expect(b"$J=G21G90X10Y0Z200F3000\n", OK).expect(b"\x85")
        await robot.jog((1.0, 0.0, 0.0), 50.0)
        await turns(50)
        wire.expect(b"?")
        stopping = asyncio.create_task(robot.jog_stop())
        await wire.reached()
        wire.transport.lose()
        await stopping
        assert phase(robot) is RobotPhase.DISCONNECTED


async def test_a_jog_refused_by_the_controller() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"$J=G21G90X5Y0Z200F3000\n", b"error:15\r\n").expect(b"\x85").expect(b"?", report("Idle"))
        await robot.jog((1.0, 0.0, 0.0), 50.0)
        await turns(50)
        with pytest.raises(Exception, match="out of the machine's travel"):
            await robot.jog((1.0, 0.0, 0.0), 50.0)
    wire.assert_done()


async def test_stop_while_a_jog_awaits_its_acknowledgement() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"$J=G21G90X5Y0Z200F3000\n").expect(b"!" + RESET, b"ALARM:3\r\n" + BANNER + UNLOCK)
        await robot.jog((1.0, 0.0, 0.0), 50.0)
        await robot.stop()
        with pytest.raises(StoppedError):
            await robot.jog_stop()
    wire.assert_done()
