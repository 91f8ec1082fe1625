"""Tables without physics: pieces go along with the gripper, and what must not happen is told."""

import asyncio

import chess
import numpy as np
import pytest

from kempelen.core.errors import BusyError, MotionError, NotHomedError, StoppedError
from kempelen.core.places import Place
from kempelen.core.protocols import Follow, RobotPhase, SetGripper
from kempelen.core.table import Table, start_layout
from kempelen.twin.light import LightRobot, LightTable


def laid() -> tuple[Table, LightTable]:
    table = Table()
    return table, LightTable(table, start_layout(table, chess.Board()))


def point(table: Table, square: str) -> tuple[float, float, float]:
    x, y, z = table.centre(Place.parse(square))
    return float(x), float(y), float(z)


def carry(table: Table, world: LightTable, source: str, target: str) -> None:
    world.close(point(table, source))
    world.open(point(table, target))


def test_a_piece_goes_along_with_the_gripper() -> None:
    table, world = laid()
    carry(table, world, "e2", "e4")
    assert world.layout[Place.parse("e4")] == chess.Piece.from_symbol("P")
    assert Place.parse("e2") not in world.layout
    assert (world.carried, world.faults) == (1, [])


def test_a_piece_that_is_set_back_was_not_carried() -> None:
    table, world = laid()
    carry(table, world, "e2", "e2")
    assert (world.carried, world.faults) == (0, [])


def test_an_empty_square_gives_nothing() -> None:
    table, world = laid()
    carry(table, world, "e4", "e5")
    assert (world.carried, world.held) == (0, None)


def test_one_piece_on_another_and_beside_all_places_are_faults() -> None:
    table, world = laid()
    carry(table, world, "e2", "d2")
    world.close(point(table, "a2"))
    world.open((-500.0, -500.0, 0.0))
    assert world.faults == ["P was let go on d2", "P was let go beside all places"]


def test_the_piece_in_the_gripper_stands_nowhere() -> None:
    table, world = laid()
    before = len(world.layout)
    world.close(point(table, "g1"))
    assert world.held == chess.Piece.from_symbol("N")
    assert len(world.layout) == before - 1


async def test_a_group_is_refused_before_homing_and_outside_of_the_work_space() -> None:
    table, world = laid()
    far = [Follow(np.array([[0.0, 0.0, 0.0], [9e9, 0.0, 0.0]]), 1.0)]
    async with LightRobot(table, world, pace=1000) as robot:
        with pytest.raises(NotHomedError):
            await robot.run([SetGripper(closed=True, seconds=0.1)])
        await robot.home()
        with pytest.raises(MotionError):
            await robot.run(far)


async def test_held_it_waits_and_stopped_it_forgets_where_it_is() -> None:
    table, world = laid()
    async with LightRobot(table, world, pace=1000) as robot:
        await robot.home()
        await robot.hold()
        running = asyncio.create_task(robot.run([SetGripper(closed=True, seconds=0.1)]))
        await asyncio.sleep(0.01)
        assert not running.done()
        with pytest.raises(BusyError):
            await robot.home()
        await robot.stop()
        with pytest.raises(StoppedError):
            await running
        assert (robot.state.phase, robot.state.homed) == (RobotPhase.LOCKED, False)
