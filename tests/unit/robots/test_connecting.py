"""Meeting a controller: what it is, whether it remembers, whether it is set up."""

import asyncio
from dataclasses import replace

import pytest

from kempelen.core.errors import ConfigError, LinkError, SettingsError
from kempelen.core.protocols import GripperState, RobotPhase
from kempelen.core.table import Table
from kempelen.robots.grbl.gantry import GrblGantry, driver
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.testing.grbl import (
    BANNER,
    OK,
    QUICK,
    RESET,
    SPACE,
    UNLOCK,
    expect_boot,
    expect_inventory,
    expect_running,
    gantry,
    modal,
    offsets,
    report,
    settings,
)
from kempelen.testing.wires import ScriptedWire


def phase(robot: GrblGantry) -> RobotPhase:
    return robot.state.phase


# --- memory ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("word", "gripper"), [("M8", GripperState.OPEN), ("M9", GripperState.CLOSED)])
async def test_a_board_that_ran_on_has_kept_its_memory(word: str, gripper: GripperState) -> None:
    wire = ScriptedWire()
    expect_running(wire, gripper=word)
    async with gantry(wire) as robot:
        assert robot.state.memory_kept
        assert robot.state.gripper is gripper
        assert not robot.state.homed
        assert phase(robot) is RobotPhase.LOCKED
    wire.assert_done()


async def test_a_board_that_was_reset_unseen_has_not() -> None:
    """The banner may be missed; the missing mark tells."""
    wire = ScriptedWire()
    expect_running(wire, gripper="M9", feed="F0")
    async with gantry(wire) as robot:
        assert not robot.state.memory_kept
        assert robot.state.gripper is GripperState.CLOSED
    wire.assert_done()


async def test_a_motion_still_running_is_waited_for() -> None:
    wire = ScriptedWire()
    wire.expect(b"?", report("Run")).expect(b"?", report("Run")).expect(b"?", report("Run"))
    wire.expect(b"?", report("Idle"))
    expect_inventory(wire, state="Idle", refusal=b"error:1\r\n", modal_reply=modal("M9"))
    async with gantry(wire) as robot:
        assert robot.state.memory_kept  # a board that has been reset does not run
    wire.assert_done()


async def test_a_jog_still_running_is_cancelled() -> None:
    wire = ScriptedWire()
    wire.expect(b"?", report("Jog")).expect(b"?", report("Jog")).expect(b"\x85").expect(b"?", report("Idle"))
    expect_inventory(wire, state="Idle", refusal=b"error:1\r\n")
    async with gantry(wire) as robot:
        assert robot.state.memory_kept
    wire.assert_done()


@pytest.mark.parametrize("opened", [True, False])
async def test_a_hold_left_over_is_ended_and_the_gripper_put_back(opened: bool) -> None:
    """The reset closes the gripper; one that was open is opened again, one that holds a piece holds on."""
    wire = ScriptedWire()
    for _ in range(4):
        wire.expect(b"?", report("Hold:0"))
    wire.expect(b"?", report("Hold:0", extra="|Ov:100,100,100|A:F" if opened else "|Ov:100,100,100"))
    wire.expect(RESET, BANNER)
    expect_inventory(wire, state="Idle", refusal=b"error:1\r\n", modal_reply=modal("M9", "F0"))
    if opened:
        wire.expect(b"?", report("Idle")).expect(b"G21G54G90F77\n", OK).expect(b"M8\n", OK)
    async with gantry(wire) as robot:
        assert robot.state.memory_kept
        assert robot.state.gripper is (GripperState.OPEN if opened else GripperState.CLOSED)
    wire.assert_done()


async def test_a_hold_that_never_tells_its_outputs_counts_as_closed() -> None:
    wire = ScriptedWire()
    for _ in range(35):
        wire.expect(b"?", report("Hold:0"))
    wire.expect(RESET, BANNER)
    expect_inventory(wire, state="Idle", refusal=b"error:1\r\n")
    async with gantry(wire, timing=replace(QUICK, poll=0.0)) as robot:
        assert robot.state.gripper is GripperState.CLOSED
    wire.assert_done()


async def test_a_deaf_board_is_reset() -> None:
    """Homing is silent, and after alarms 1 and 2 only a reset is heard."""
    wire = ScriptedWire().expect(b"?").expect(b"?").expect(b"?").expect(RESET, BANNER + UNLOCK)
    expect_inventory(wire)
    async with gantry(wire) as robot:
        assert not robot.state.memory_kept
        assert phase(robot) is RobotPhase.LOCKED
    wire.assert_done()


async def test_a_board_still_booting_when_asked() -> None:
    wire = ScriptedWire().expect(b"?")
    async with asyncio.TaskGroup() as tasks:
        connected = tasks.create_task(_enter_and_leave(wire))
        await wire.reached()
        expect_boot(wire)
    assert not connected.result()
    wire.assert_done()


async def _enter_and_leave(wire: ScriptedWire) -> bool:
    async with gantry(wire) as robot:
        return robot.state.memory_kept


# --- somebody else ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", [b"start\r\necho:Marlin 2.1\r\nok\r\n", b"\xfe\xfe\x00\xfe", b"login: "])
async def test_another_device_is_quoted(words: bytes) -> None:
    wire = ScriptedWire().expect(b"?", words).expect(b"?").expect(b"?")
    with pytest.raises(LinkError, match="is not GRBL") as refused:
        async with gantry(wire):
            pass
    assert repr(words[:5])[2:-1] in refused.value.message
    wire.assert_done()  # no reset byte for a stranger


async def test_nobody_answers() -> None:
    wire = ScriptedWire().expect(b"?").expect(b"?").expect(b"?").expect(RESET)
    with pytest.raises(LinkError, match="nothing answers"):
        async with gantry(wire):
            pass
    wire.assert_done()


async def test_a_device_that_babbles_at_a_reset() -> None:
    wire = ScriptedWire().expect(b"?").expect(b"?").expect(b"?").expect(RESET, b"Smoothie\r\n")
    with pytest.raises(LinkError, match="Smoothie"):
        async with gantry(wire):
            pass


@pytest.mark.parametrize("build", [b"[0.9j.20160303:]\r\n", b"[VER:0.9j.20160303:]\r\n", b""])
async def test_an_old_firmware_is_refused(build: bytes) -> None:
    wire = ScriptedWire()
    wire.say(BANNER + UNLOCK)
    wire.expect(b"=\n", b"error:9\r\n").expect(b"?", report("Alarm")).expect(b"$I\n", build + OK)
    with pytest.raises(LinkError, match=r"1\.1 is needed"):
        async with gantry(wire):
            pass
    wire.assert_done()


async def test_a_damaged_list_of_offsets_is_not_guessed() -> None:
    wire = ScriptedWire()
    wire.say(BANNER + UNLOCK)
    expect_inventory(wire, offsets_reply=offsets().replace(b"[G54", b"[G\xff4"))
    with pytest.raises(LinkError, match="damaged"):
        async with gantry(wire):
            pass


async def test_a_small_receive_buffer_narrows_the_window() -> None:
    wire = ScriptedWire()
    wire.say(BANNER + UNLOCK)
    expect_inventory(wire)
    wire._steps[2] = replace(wire._steps[2], reply=b"[VER:1.1f.20170801:]\r\n[OPT:V,15,64]\r\n" + OK)
    async with gantry(wire) as robot:
        assert robot._session.greeting.window == 56


# --- settings --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"_1": 25}, "$1 is 25: the motors must stay energised at rest"),
        ({"_1": 25}, "send $1=255"),
        ({"_10": 19}, "$10 is 19: status reports must carry a position; send $10=1"),
        ({"_11": 0.01}, "send $11=0.02"),
        ({"_13": 1}, "$13 is 1: reports must be in millimetres; send $13=0"),
        ({"_20": 0}, "send $20=1"),
        ({"_21": 0}, "send $21=1"),
        ({"_22": 0}, "send $22=1"),
        ({"_23": 7}, "$23 is 7: z must home upwards, away from the pieces; send $23=3"),
        ({"_32": 1}, "send $32=0"),
        ({"_110": 12000}, "$110 is 12000: highest rate of x is 18000 mm/min here; send $110=18000"),
        ({"_121": 300}, "$121 is 300: acceleration of y is 1500 mm/s² here; send $121=1500"),
        ({"_132": 200}, "$132 is 200: travel of z is 210 mm here; send $132=210"),
        ({"_100": None}, "$100 is missing: a step of x must be 0.05 mm or finer"),
        ({"_101": 10}, "$101 is 10: a step of y must be 0.05 mm or finer"),
        ({"_102": 400}, "z at 300 mm/s would need 120000 steps/s, the controller makes 30000"),
        ({"_11": None, "_23": None, "_110": None}, "3 of the controller's settings"),
    ],
)
async def test_settings_that_do_not_fit_are_refused_with_the_fix(
    changes: dict[str, float | None], words: str
) -> None:
    wire = ScriptedWire()
    wire.say(BANNER + UNLOCK)
    expect_inventory(wire, settings_reply=settings(**changes))
    with pytest.raises(SettingsError) as refused:
        async with gantry(wire):
            pass
    assert words in refused.value.message
    assert "apply_settings" in refused.value.hint


async def test_every_misfit_is_told_at_once() -> None:
    wire = ScriptedWire()
    wire.say(BANNER + UNLOCK)
    expect_inventory(wire, settings_reply=settings(_20=0, _22=0, _130=600))
    with pytest.raises(SettingsError, match=r"3 of the controller's settings") as refused:
        async with gantry(wire):
            pass
    assert all(line in refused.value.message for line in ("$20=1", "$22=1", "$130=710"))


async def test_settings_are_written_on_request_one_by_one_homing_first() -> None:
    wire = ScriptedWire()
    wire.say(BANNER + UNLOCK)
    expect_inventory(wire, settings_reply=settings(_20=0, _22=0, _130=600))
    rest = [wire._steps.pop() for _ in range(2)]
    for line in (b"$22=1\n", b"$20=1\n", b"$130=710\n"):
        wire.expect(line, OK)
    wire.expect(b"$$\n", settings())
    wire._steps.extend(reversed(rest))
    async with gantry(wire, apply_settings=True) as robot:
        assert phase(robot) is RobotPhase.LOCKED
    wire.assert_done()


async def test_nothing_is_written_when_everything_fits() -> None:
    wire = ScriptedWire()
    expect_boot(wire)
    async with gantry(wire, apply_settings=True):
        wire.assert_done()


async def test_what_no_line_can_mend_is_still_refused() -> None:
    wire = ScriptedWire()
    wire.say(BANNER + UNLOCK)
    expect_inventory(wire, settings_reply=settings(_101=10))
    with pytest.raises(SettingsError, match=r"\$101"):
        async with gantry(wire, apply_settings=True):
            pass


# --- options and the entry point -------------------------------------------------------------------------


def test_the_driver_does_no_io() -> None:
    robot = driver("/dev/ttyNOWHERE7", Table(), {})
    assert robot.name == "gantry"
    assert robot.space == SPACE
    assert robot.state.phase is RobotPhase.DISCONNECTED


async def test_the_driver_opens_its_port_on_entering() -> None:
    with pytest.raises(LinkError, match="does not exist"):
        async with driver("/dev/ttyNOWHERE7", Table(), {"baud": 250000, "gripper": "servo"}):
            pass


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"bauds": 9600}, "bauds = 9600"),
        ({"baud": 10}, "baud = 10"),
        ({"gripper": "magnet"}, "gripper = 'magnet'"),
        ({"gripper": "servo", "servo_open": 500, "servo_closed": 500}, "S500"),
    ],
)
def test_options_that_are_wrong(options: dict[str, str | int], words: str) -> None:
    with pytest.raises(ConfigError) as refused:
        driver("/dev/ttyUSB0", Table(), options)
    assert words in str(refused.value)


async def test_a_servo_gripper_is_unknown_after_a_reset() -> None:
    wire = ScriptedWire()
    expect_boot(wire)
    async with gantry(wire, wiring=GripperWiring.servo(200, 800)) as robot:
        assert robot.state.gripper is GripperState.UNKNOWN
