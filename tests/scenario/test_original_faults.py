"""Faults of the original, each by its name; those of parsing, transfers, gripping and engines have theirs in
the tests of those parts (``grep -r test_regression_ tests``).
"""

import asyncio
import math
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import chess
import numpy as np
import pytest

from kempelen.core.calibration import calibrate
from kempelen.core.errors import AlarmError
from kempelen.core.geometry import Transform
from kempelen.core.places import Place
from kempelen.core.protocols import GripperState, RobotPhase, SetGripper
from kempelen.core.table import Table
from kempelen.game.arbiter import Arbiter
from kempelen.game.journal import Journal
from kempelen.game.modes import Mode, Pairing
from kempelen.game.opening import new_game
from kempelen.game.options import ArbiterOptions
from kempelen.game.players import PersonPlayer
from kempelen.robots.grbl.gantry import GrblGantry
from kempelen.robots.grbl.gcode import number
from kempelen.testing.contracts.robot import here, inside, path, phase, until
from kempelen.testing.hands import FakeHand, FakePerson, FakeTable
from kempelen.testing.players import ScriptedPlayer
from kempelen.testing.rigs import MemoryRig

TABLE = Table()
OPEN, CLOSE = SetGripper(closed=False, seconds=0.1), SetGripper(closed=True, seconds=0.1)


# --- numbers and calibration ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "text"), [(12.009, "12.009"), (-0.5, "-0.5"), (0.05, "0.05"), (-10.0, "-10")]
)
def test_regression_numbers_keep_leading_zeros_and_signs(value: float, text: str) -> None:
    """12.009 became "12.9" and -0.5 became "0.500"."""
    assert number(value) == text


def test_regression_calibration_keeps_rotation_and_offset() -> None:
    """It kept the width of a square alone, so that a board had to lie straight, in one place."""
    side = 8 * 50.0
    pose = Transform.about_z(math.radians(33.0), (120.0, -45.0, 7.0))
    corners = {"a1": (0.0, 0.0, 0.0), "h1": (side, 0.0, 0.0), "h8": (side, side, 0.0), "a8": (0.0, side, 0.0)}
    touched = {name: pose @ np.array(point) for name, point in corners.items()}
    found = calibrate(touched, date=datetime.now(UTC))
    assert found.square == pytest.approx(50.0)
    assert found.robot_from_board.matrix == pytest.approx(pose.matrix, abs=1e-9)


# --- the controller ---------------------------------------------------------------------------------------


async def under_way(robot: GrblGantry) -> asyncio.Task[None]:
    """There and back through the whole work space, with the gripper closed."""
    stops = [inside(robot.space, share, 0.5, 0.6) for share in (0.9, 0.1, 0.9)]
    before = robot.state.reported_position
    task = asyncio.create_task(robot.run([path(here(robot), *stops)]))
    await until(lambda: robot.state.reported_position != before)
    return task


async def test_regression_resume_does_not_wait_for_idle_in_a_hold() -> None:
    """It waited for Idle, which a held controller never shows: ``Hold:0`` is all it says."""
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        running = await under_way(robot)
        await robot.hold()
        assert phase(robot) is RobotPhase.HELD
        async with asyncio.timeout(10.0):
            await robot.resume()
            await running
        assert phase(robot) is RobotPhase.IDLE


async def test_regression_homing_lets_go_of_its_lock_once() -> None:
    """It released a lock twice: the second homing, or one after a failed one, met an error of its own."""
    async with MemoryRig() as rig, rig.robot() as robot:
        rig.controller.faults.dead_switches.add(0)
        for _ in range(2):
            with pytest.raises(AlarmError):
                await robot.home()
            await robot.recover()
        rig.controller.faults.dead_switches.clear()
        for _ in range(2):
            await robot.home()
            assert robot.state.homed
        await (await under_way(robot))


async def test_regression_negative_work_offsets_do_not_mean_unhomed() -> None:
    async with MemoryRig() as rig:
        async with rig.robot() as robot:
            await robot.home()
        async with rig.robot() as robot:  # meets the offsets that the first one has left
            await robot.home()
            assert max(robot._session.greeting.offsets["G54"]) < 0.0
            assert robot.state.homed
            await (await under_way(robot))


async def test_regression_a_soft_reset_drops_nothing() -> None:
    """Coolant outputs go off in a reset: without current the gripper holds."""
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        await robot.run([CLOSE])
        running = await under_way(robot)
        await robot.stop()
        await asyncio.gather(running, return_exceptions=True)
        assert rig.gripper_closed()


async def test_regression_a_soft_reset_does_not_grab_what_it_is_around() -> None:
    """A cancelled motion ends in a reset, in which an open gripper falls shut: it is opened again at once."""
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        await robot.run([OPEN])
        running = await under_way(robot)
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)
        assert not rig.gripper_closed()
        assert robot.state.gripper is GripperState.OPEN
        assert robot.state.homed


# --- the game ---------------------------------------------------------------------------------------------


@pytest.fixture
def journal(tmp_path: Path) -> Iterator[Journal]:
    with Journal(tmp_path) as journal:
        yield journal


async def test_regression_pieces_that_a_person_captures_have_a_slot(journal: Journal) -> None:
    """Only the robot's own captures had one."""
    options = ArbiterOptions(hands="person")
    person = PersonPlayer("Anna")
    pairing = Pairing.play(person, ScriptedPlayer(["exd5", "Kd7"], name="Engine"))
    log = new_game(journal, pairing, TABLE, start_fen="4k3/8/8/3p4/4P3/8/8/4K3 w - - 0 1", options=options)
    world = FakeTable(log.state.layout)
    arbiter = Arbiter(log, FakeHand(world), pairing, TABLE, person=FakePerson(world), options=options)
    before = set(log.state.layout)
    running = asyncio.ensure_future(arbiter.run())
    await person.wanted.wait()
    person.submit("exd5")
    await until(lambda: arbiter.state.plies == 2 and person.to_move)
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    (slot,) = set(arbiter.state.layout) - before - {Place("d5"), Place("d7")}
    assert arbiter.state.layout[slot] == chess.Piece.from_symbol("p")
    assert not slot.is_square
    assert world.layout == arbiter.state.layout


async def test_regression_the_loop_ends_with_the_game(journal: Journal) -> None:
    """It went on for ever after mate."""
    moves = ["f3", "e5", "g4", "Qh4#"]
    pairing = Pairing(Mode.WATCH, ScriptedPlayer(moves, name="A"), ScriptedPlayer(moves, name="B"))
    log = new_game(journal, pairing, TABLE)
    arbiter = Arbiter(log, FakeHand(FakeTable(log.state.layout)), pairing, TABLE)
    async with asyncio.timeout(30.0):
        over = await arbiter.run()
    assert (over.result, over.reason) == ("0-1", "checkmate")
