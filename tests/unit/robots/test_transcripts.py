"""Every transcript seen on the real firmware, byte for byte, and what the driver makes of it."""

import asyncio

import numpy as np
import pytest

from kempelen.core.errors import AlarmError, LinkError, NotHomedError, StoppedError
from kempelen.core.protocols import Follow, GripperState, Robot, RobotPhase, SetGripper
from kempelen.robots.grbl.gantry import GrblGantry
from kempelen.robots.grbl.link import Link, RefusedError
from kempelen.robots.grbl.stream import Stream
from kempelen.testing.grbl import (
    BANNER,
    CORNER,
    OK,
    PULL_OFF,
    RESET,
    SPACE,
    UNLOCK,
    expect_boot,
    expect_homing,
    expect_inventory,
    expect_running,
    gantry,
    homed,
    offsets,
    report,
    turns,
)
from kempelen.testing.wires import ScriptedWire

GO = [Follow(np.array([CORNER, (100.0, 0.0, 200.0)]), 0.5)]
GO_LINES = b"G21G54G90G0\nX100\nG4P0\n"
THERE = (100.0, 0.0, 200.0)
HALFWAY = (50.0, 0.0, 200.0)
RESTORED = b"G21G54G90F77\n"


def phase(robot: GrblGantry) -> RobotPhase:
    return robot.state.phase


async def linked(wire: ScriptedWire) -> Link:
    link = Link(wire.transport, lambda _event: None, lambda _error: None)
    link.start()
    return link


# --- opening ---------------------------------------------------------------------------------------------


async def test_open_then_the_banner_after_a_reset_by_dtr() -> None:
    wire = ScriptedWire(resets=True)
    expect_boot(wire)
    async with gantry(wire) as robot:
        assert phase(robot) is RobotPhase.LOCKED
        assert not robot.state.homed
        assert not robot.state.memory_kept
        assert robot.state.gripper is GripperState.CLOSED
        assert robot.state.reported_position is None
        assert "Home" in robot.state.message
    wire.assert_done()


async def test_closed_and_reopened_during_a_move_means_position_lost() -> None:
    """The DTR reset puts MPos to 0 and locks: nothing of it may be taken for a position."""
    wire = ScriptedWire(resets=True)
    expect_boot(wire)
    async with gantry(wire) as robot:
        with pytest.raises(NotHomedError):
            await robot.run(GO)
    wire.assert_done()


# --- locked, and refusals --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("G0X-10", 9, "locked"),
        ("$J=G91X1F100", 8, "not idle"),
        ("$J=G90X50F1000", 15, "out of the machine's travel"),
        ("$J=X-20", 22, "no feed rate"),
        ("$J=X-20F100M3", 16, "forbidden word"),
        ("G0X" + "1" * 86, 11, "longer than 80"),
        ("M7", 20, "does not know"),
        ("X1Y2X3", 24, "axis words"),
    ],
)
async def test_a_refusal_is_told_in_plain_words(line: str, code: int, words: str) -> None:
    wire = ScriptedWire().expect(f"{line}\n".encode(), f"error:{code}\r\n".encode())
    link = await linked(wire)
    with pytest.raises(RefusedError, match=words) as refused:
        await link.request(line)
    assert refused.value.code == code
    await link.close()
    wire.assert_done()


async def test_a_motion_while_jogging_is_refused() -> None:
    """G0 during Jog is error:9; the driver does not even ask."""
    wire = ScriptedWire().expect(b"G0X1\n", b"error:9\r\n")
    link = await linked(wire)
    with pytest.raises(RefusedError, match="locked"):
        await link.request("G0X1")
    await link.close()


# --- homing ----------------------------------------------------------------------------------------------


async def test_home_is_believed_when_idle_at_the_pull_off() -> None:
    wire = ScriptedWire()
    expect_boot(wire)
    expect_homing(wire)
    async with gantry(wire) as robot:
        await robot.home()
        assert robot.state.homed
        assert phase(robot) is RobotPhase.IDLE
        assert robot.state.reported_position == CORNER
    wire.assert_done()


async def test_home_with_status_queries_in_between() -> None:
    """'?' twice while homing: silence, then a single <Home>, then ok."""
    wire = ScriptedWire()
    expect_boot(wire)
    wire.expect(b"$H\n")
    async with gantry(wire) as robot:
        homing = asyncio.create_task(robot.home())
        await wire.reached()
        expect_homing(wire)
        wire._steps.popleft()  # $H has been said
        wire.say(report("Home") + OK)
        await homing
        assert robot.state.homed
    wire.assert_done()


async def test_homing_that_is_reset_is_not_believed_although_it_says_ok() -> None:
    wire = ScriptedWire()
    expect_boot(wire)
    wire.expect(b"$H\n").expect(RESET, b"ALARM:6\r\n" + OK + BANNER + UNLOCK)
    async with gantry(wire) as robot:
        homing = asyncio.create_task(robot.home())
        await turns()
        await robot.cancel()
        with pytest.raises(StoppedError):
            await homing
        assert not robot.state.homed
        assert phase(robot) is RobotPhase.ALARM
    wire.assert_done()


async def test_homing_without_a_switch_is_not_believed_although_it_says_ok() -> None:
    wire = ScriptedWire()
    expect_boot(wire)
    wire.expect(b"$H\n", b"ALARM:9\r\n" + OK + BANNER + UNLOCK)
    async with gantry(wire) as robot:
        with pytest.raises(AlarmError, match="switch was not found"):
            await robot.home()
        assert not robot.state.homed
        assert phase(robot) is RobotPhase.ALARM
        with pytest.raises(AlarmError):  # not before `recover`
            await robot.home()
        wire.expect(b"?", report("Alarm")).expect(b"$X\n", b"[MSG:Caution: Unlocked]\r\n" + OK)
        wire.expect(b"?", report("Idle")).expect(RESTORED, OK)
        expect_homing(wire)
        await robot.recover()
        assert phase(robot) is RobotPhase.LOCKED
        await robot.home()
        assert phase(robot) is RobotPhase.IDLE
    wire.assert_done()


# --- hold, resume, cancel, stop --------------------------------------------------------------------------


async def test_hold_then_lines_are_silent_until_resume() -> None:
    """Resume waits for the end of Hold:0, not for Idle; silence in a hold is no fault."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK + OK)
        running = asyncio.create_task(robot.run(GO))
        await wire.reached()
        wire.expect(b"!").expect(b"?", report("Hold:1", HALFWAY)).expect(b"?", report("Hold:0", HALFWAY))
        await robot.hold()
        assert phase(robot) is RobotPhase.HELD
        assert robot.state.reported_position == HALFWAY
        wire.expect(b"?", report("Hold:0", HALFWAY)).expect(b"~").expect(b"?", report("Run", HALFWAY))
        await robot.resume()
        assert phase(robot) is RobotPhase.MOVING
        assert not running.done()
        wire.expect(b"?", report("Idle", THERE))
        wire.say(OK)
        await running
        assert phase(robot) is RobotPhase.IDLE
    wire.assert_done()


async def test_resume_returns_as_soon_as_it_moves() -> None:
    """The first report after ~ may still be the hold's."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK + OK)
        running = asyncio.create_task(robot.run(GO))
        await wire.reached()
        wire.expect(b"!").expect(b"?", report("Hold:0", HALFWAY))
        await robot.hold()
        wire.expect(b"?", report("Hold:0", HALFWAY)).expect(b"~").expect(b"?", report("Hold:0", HALFWAY))
        wire.expect(b"?", report("Run", HALFWAY))
        await robot.resume()
        assert phase(robot) is RobotPhase.MOVING
        wire.expect(b"?", report("Idle", THERE))
        wire.say(OK)
        await running
    wire.assert_done()


async def test_a_program_pause_is_a_hold_like_any_other() -> None:
    """M0 shows Hold:0 and its ok comes only after ~."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK + OK + OK)
        wire.expect(b"?", report("Hold:0", THERE)).expect(b"?", report("Idle", THERE))
        await robot.run(GO)
    wire.assert_done()


async def test_reset_at_hold_keeps_the_position() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK + OK)
        running = asyncio.create_task(robot.run(GO))
        await wire.reached()
        wire.expect(b"!").expect(b"?", report("Hold:1")).expect(b"?", report("Hold:0", HALFWAY))
        wire.expect(RESET, BANNER).expect(b"?", report("Idle", HALFWAY)).expect(RESTORED, OK)
        await robot.cancel()
        with pytest.raises(StoppedError, match="cancelled"):
            await running
        assert robot.state.homed
        assert phase(robot) is RobotPhase.IDLE
        assert robot.state.reported_position == HALFWAY
    wire.assert_done()


async def test_reset_while_running_is_an_alarm_and_loses_the_position() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK + OK)
        running = asyncio.create_task(robot.run(GO))
        await wire.reached()
        wire.expect(b"!" + RESET, b"ALARM:3\r\n")
        stopping = asyncio.create_task(robot.stop())
        await turns()
        wire.assert_done()
        assert not running.done()  # not at rest yet, as far as anybody can tell
        wire.say(BANNER + UNLOCK)
        await stopping
        with pytest.raises(StoppedError, match="stopped"):
            await running
        assert not robot.state.homed
        assert robot.state.reported_position is None
        assert phase(robot) is RobotPhase.ALARM
        wire.expect(b"?", report("Alarm")).expect(b"$X\n", OK).expect(b"?", report("Idle")).expect(
            RESTORED, OK
        )
        await robot.recover()
        assert phase(robot) is RobotPhase.LOCKED
        with pytest.raises(NotHomedError):
            await robot.run(GO)
    wire.assert_done()


# --- alarms ----------------------------------------------------------------------------------------------


async def test_a_soft_limit_is_deaf_until_reset_and_keeps_the_position() -> None:
    """ALARM:2, 0.5 s, then '?' and $X are dead until ^X; a late ok comes before the banner."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK + b"ALARM:2\r\n[MSG:Reset to continue]\r\n")
        with pytest.raises(AlarmError, match="beyond the machine's travel"):
            await robot.run(GO)
        assert phase(robot) is RobotPhase.ALARM
        assert robot.state.homed  # it stopped under control
        wire.expect(RESET, OK + BANNER + UNLOCK).expect(b"?", report("Alarm"))
        wire.expect(b"$X\n", OK).expect(b"?", report("Idle")).expect(RESTORED, OK)
        await robot.recover()
        assert phase(robot) is RobotPhase.IDLE
        assert robot.damaged_lines == 0  # the late ok belonged to a dead line
    wire.assert_done()


async def test_a_hard_limit_is_deaf_until_reset_and_loses_the_position() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK + b"ALARM:1\r\n[MSG:Reset to continue]\r\n")
        with pytest.raises(AlarmError, match="limit switch"):
            await robot.run(GO)
        assert not robot.state.homed
        wire.expect(RESET, BANNER + b"[MSG:Check Limits]\r\n" + UNLOCK)
        wire.expect(b"?", report("Alarm", extra="|Pn:Y")).expect(b"$X\n", OK)
        wire.expect(b"?", report("Idle", extra="|Pn:Y")).expect(RESTORED, OK)
        await robot.recover()
        assert phase(robot) is RobotPhase.LOCKED
    wire.assert_done()


# --- jogging ---------------------------------------------------------------------------------------------


async def test_the_jog_cancel_waits_for_the_acknowledgement() -> None:
    """In one write with a jog, the cancel byte is lost and the whole way is driven."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"$J=G21G90X5Y0Z200F3000\n")
        await robot.jog((1.0, 0.0, 0.0), 50.0)
        stopping = asyncio.create_task(robot.jog_stop())
        await turns()
        wire.assert_done()  # no 0x85 while the ok is outstanding
        # 0x85 is one raw byte: as UTF-8 it would be two, and the first would spoil the next line
        wire.expect(b"\x85").expect(b"?", report("Jog", (2.0, 0.0, 200.0)))
        wire.expect(b"\x85").expect(b"?", report("Idle", (2.5, 0.0, 200.0)))
        wire.say(OK)
        await stopping
        assert phase(robot) is RobotPhase.IDLE
        assert robot.state.reported_position == (2.5, 0.0, 200.0)
    wire.assert_done()


async def test_no_more_than_two_jogs_are_ahead_of_the_machine() -> None:
    """25 queued jogs drive on after a cancel: those in the receive buffer survive it."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"$J=G21G90X5Y0Z200F3000\n", OK).expect(b"$J=G21G90X10Y0Z200F3000\n", OK)
        await robot.jog((1.0, 0.0, 0.0), 50.0)
        await turns(100)
        wire.assert_done()
        wire.expect(b"\x85").expect(b"?", report("Idle", (3.0, 0.0, 200.0)))
        await robot.jog_stop()
    wire.assert_done()


# --- flow ------------------------------------------------------------------------------------------------


async def test_sixty_lines_never_overflow_the_receive_buffer() -> None:
    """Sent blind, 37 of 60 lines are taken and the rest is dropped."""
    lines = tuple(f"X{n}.123Y{n}.456\n".encode() for n in range(60))
    sent = bytearray()
    wire = ScriptedWire()
    wire.transport.deliver = sent.extend
    link = await linked(wire)
    stream = Stream(lines)
    running = asyncio.create_task(link.stream(stream))
    taken, longest = 0, max(map(len, lines))
    for line in lines:
        await turns(3)
        in_flight = len(sent) - taken
        assert in_flight <= 120
        assert in_flight > 120 - longest or stream.take() == b""  # full, or nothing is left
        taken += len(line)
        wire.say(OK)
    await running
    assert bytes(sent) == b"".join(lines)
    await link.close()


async def test_an_eeprom_write_goes_alone() -> None:
    """G10 stalls the receiver: 36 bytes of a burst behind it were dropped."""
    wire = ScriptedWire()
    wire.say(BANNER + UNLOCK)
    expect_inventory(wire, offsets_reply=offsets(g54="0.000,0.000,0.000"))
    wire.expect(b"$H\n", OK).expect(b"?", report("Idle", PULL_OFF)).expect(b"G10L2P1X-705Y-455Z-205\n")
    async with gantry(wire) as robot:
        homing = asyncio.create_task(robot.home())
        await wire.reached()
        await turns()
        wire.assert_done()  # nothing follows it before its ok
        wire.expect(b"$#\n", offsets())
        wire.expect(b"?", report("Idle", PULL_OFF)).expect(RESTORED, OK).expect(
            b"?", report("Idle", PULL_OFF)
        )
        wire.expect(b"G21G54G90G0X0Y0Z200\nG4P0\n", OK + OK).expect(b"?", report("Idle"))
        wire.say(OK)
        await homing
    wire.assert_done()


async def test_an_acknowledgement_too_many_is_noted_and_not_believed() -> None:
    r"""``G4P0.01\r\n`` gets two oks; the driver sends ``\n`` alone and would notice."""
    wire = ScriptedWire().expect(b"G4P0.01\n", OK + OK).expect(b"X1\n")
    link = await linked(wire)
    await link.request("G4P0.01")
    assert link.damaged == 1
    late = asyncio.create_task(link.request("X1"))
    await turns()
    assert not late.done()
    wire.say(OK)
    await late
    await link.close()
    wire.assert_done()


async def test_a_garbled_line_ends_the_group_at_rest() -> None:
    """error:24 in the middle of a path would be a short cut through the pieces."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK + b"error:24\r\n")
        wire.expect(b"!").expect(b"?", report("Hold:0", HALFWAY)).expect(RESET, OK + BANNER)
        wire.expect(b"?", report("Idle", HALFWAY)).expect(RESTORED, OK)
        with pytest.raises(LinkError, match="damaged on its way"):
            await robot.run(GO)
        assert robot.state.homed
        assert robot.state.reported_position == HALFWAY
    wire.assert_done()


async def test_check_mode_is_left_by_a_reset() -> None:
    """$C off is a reset with a banner."""
    wire = ScriptedWire()
    for _ in range(3):
        wire.expect(b"?", report("Check"))
    wire.expect(RESET, BANNER)
    expect_inventory(wire, state="Idle", refusal=b"error:1\r\n")
    async with gantry(wire) as robot:
        assert phase(robot) is RobotPhase.LOCKED
    wire.assert_done()


async def test_unplugged_in_motion_nothing_is_sent_twice() -> None:
    """The machine finishes its 300 mm by itself; the driver reports and forgets."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK)
        running = asyncio.create_task(robot.run(GO))
        await wire.reached()
        wire.transport.lose()
        with pytest.raises(LinkError, match="cable was pulled"):
            await running
        assert phase(robot) is RobotPhase.DISCONNECTED
        assert not robot.state.homed
        with pytest.raises(LinkError):
            await robot.run(GO)
        again = ScriptedWire()
        wire.transport = again.transport
        expect_running(again)
        await robot.recover()
        assert robot.state.memory_kept
        assert phase(robot) is RobotPhase.LOCKED
        again.assert_done()
    wire.assert_done()


# --- the barrier -----------------------------------------------------------------------------------------


async def test_ok_then_idle_can_lie() -> None:
    """Idle at the old position right after the ok is not the end."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(GO_LINES, OK + OK + OK).expect(b"?", report("Idle", CORNER))
        running = asyncio.create_task(robot.run(GO))
        await wire.reached()
        await turns()
        assert not running.done()
        wire.expect(b"?", report("Idle", THERE))
        await running
    wire.assert_done()


async def test_a_group_with_the_gripper_settles_before_it_is_done() -> None:
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"G21G54G90G0\nX100\nM8\nG4P0.2\n", OK * 4).expect(b"?", report("Idle", THERE))
        await robot.run([*GO, SetGripper(closed=False, seconds=0.2)])
        assert robot.state.gripper is GripperState.OPEN
    wire.assert_done()


async def test_a_reset_closes_the_gripper_and_the_driver_opens_it_again() -> None:
    """0x18 switches M8 off: de-energised is closed, so a held piece stays; an open hand is opened again."""
    wire = ScriptedWire()
    async with homed(wire) as robot:
        wire.expect(b"G21G54G90G0\nM8\nG4P0.2\n", OK * 3).expect(b"?", report("Idle", CORNER))
        await robot.run([SetGripper(closed=False, seconds=0.2)])
        wire.expect(GO_LINES, OK)
        running = asyncio.create_task(robot.run(GO))
        await wire.reached()
        wire.expect(b"!").expect(b"?", report("Hold:0", HALFWAY)).expect(RESET, BANNER)
        wire.expect(b"?", report("Idle", HALFWAY)).expect(RESTORED, OK).expect(b"M8\n", OK)
        await robot.cancel()
        with pytest.raises(StoppedError):
            await running
        assert robot.state.gripper is GripperState.OPEN
    wire.assert_done()


def test_the_driver_is_a_robot() -> None:
    robot: Robot = GrblGantry(ScriptedWire().connect, SPACE)
    assert robot.name == "gantry"
