"""The hand over a real driver and the virtual controller: what it does and when it says so."""

import asyncio

import chess
import numpy as np
import pytest

from kempelen.core.errors import MotionError, NotHomedError, StoppedError
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Checkpoint, GripperState, Hand, RobotPhase
from kempelen.core.table import Table, start_layout
from kempelen.robots.hand import CartesianHand
from kempelen.testing.contracts.robot import apart, phase, until
from kempelen.testing.rigs import MemoryRig

TABLE = Table()
START = start_layout(TABLE, chess.Board())
KNIGHT = Transfer(chess.Piece(chess.KNIGHT, chess.WHITE), Place("g1"), Place("f3"))
GRIP = tuple(TABLE.grip_point(Place("g1"), chess.KNIGHT))
RELEASE = tuple(TABLE.release_point(Place("f3"), chess.KNIGHT))
STEP = 0.02  # mm


class Notes:
    """Checkpoints, with what was physically true at each."""

    def __init__(self, rig: MemoryRig) -> None:
        self._rig = rig
        self.seen: list[tuple[Checkpoint, bool, tuple[float, float, float]]] = []

    async def __call__(self, checkpoint: Checkpoint) -> None:
        await asyncio.sleep(0)
        self.seen.append((checkpoint, self._rig.gripper_closed(), self._rig.position()))


async def prepared(rig: MemoryRig, robot_hand: Hand) -> Notes:
    await robot_hand.prepare()
    return Notes(rig)


async def test_prepare_homes_opens_and_parks() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE)
        await hand.prepare()
        assert hand.state.homed
        assert hand.state.gripper is GripperState.OPEN
        assert not rig.gripper_closed()
        assert rig.position()[2] == pytest.approx(TABLE.space.upper[2], abs=STEP)


async def test_prepare_again_from_the_middle_of_the_board() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE)
        await hand.prepare()
        await hand.carry(KNIGHT, START, Notes(rig))
        await hand.prepare()
        x, _, z = rig.position()
        assert z == pytest.approx(TABLE.park_height, abs=STEP)
        assert min(abs(x - park) for park in TABLE.park_xs) <= STEP


async def test_carry_is_two_groups_with_true_checkpoints() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE)
        notes = await prepared(rig, hand)
        report = await hand.carry(KNIGHT, START, notes)
        gripping, carrying, released = notes.seen
        assert gripping[:2] == (Checkpoint.GRIPPING, False)
        assert carrying[:2] == (Checkpoint.CARRYING, True)
        assert apart(carrying[2], GRIP) <= STEP
        assert released[:2] == (Checkpoint.RELEASED, False)
        assert apart(released[2], RELEASE) <= STEP
        assert report.transfer == KNIGHT
        assert 0 < report.carry < report.seconds
        assert 0 < report.bound < report.predicted
        standing = START.after(KNIGHT)
        await hand.park(standing)
        assert apart(rig.position(), TABLE.park_point(np.array(RELEASE)).tolist()) <= STEP


async def test_the_next_transfer_begins_around_the_piece_just_released() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE)
        notes = await prepared(rig, hand)
        await hand.carry(KNIGHT, START, notes)
        pawn = Transfer(chess.Piece(chess.PAWN, chess.WHITE), Place("e2"), Place("e4"))
        await hand.carry(pawn, START.after(KNIGHT), notes)
        assert apart(rig.position(), TABLE.release_point(Place("e4"), chess.PAWN).tolist()) <= STEP


async def test_the_predicted_time_is_the_machines() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE, clock=lambda: rig.controller.time_s)
        notes = await prepared(rig, hand)
        report = await hand.carry(KNIGHT, START, notes)
        assert report.seconds == pytest.approx(report.predicted, rel=0.15)


async def test_a_carry_that_cannot_be_planned_ends_at_rest() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE)
        notes = await prepared(rig, hand)
        onto = Transfer(KNIGHT.piece, KNIGHT.source, Place("e2"))
        with pytest.raises(MotionError, match="taken"):
            await hand.carry(onto, START, notes)
        assert [note[0] for note in notes.seen] == [Checkpoint.GRIPPING]
        assert phase(robot) is RobotPhase.IDLE
        assert hand.state.gripper is GripperState.OPEN
        await hand.prepare()
        await hand.carry(KNIGHT, START, notes)


async def test_an_approach_that_cannot_be_planned_sends_nothing() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE)
        notes = await prepared(rig, hand)
        before = bytes(rig.coupling.sent).rstrip(b"?")
        with pytest.raises(MotionError, match="Nothing stands"):
            await hand.carry(Transfer(KNIGHT.piece, Place("e4"), Place("e5")), START, notes)
        assert bytes(rig.coupling.sent).rstrip(b"?") == before
        assert not notes.seen


async def test_a_closed_gripper_is_opened_before_the_first_checkpoint() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        await robot.home()
        notes = Notes(rig)
        await CartesianHand(robot, TABLE).carry(KNIGHT, START, notes)
        assert notes.seen[0][:2] == (Checkpoint.GRIPPING, False)


async def test_pause_and_resume_with_the_piece_in_the_gripper() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE)
        notes = await prepared(rig, hand)
        carrying = asyncio.create_task(hand.carry(KNIGHT, START, notes))
        await until(lambda: len(notes.seen) == 2 and rig.position()[2] > GRIP[2] + 20)
        await hand.hold()
        held_at = rig.position()
        await asyncio.sleep(0.02)
        assert rig.position() == held_at
        assert rig.gripper_closed()
        assert phase(robot) is RobotPhase.HELD
        await hand.resume()
        await carrying
        assert apart(rig.position(), RELEASE) <= STEP


async def test_the_time_left_runs_down() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE, clock=lambda: rig.controller.time_s)
        notes = await prepared(rig, hand)
        assert hand.seconds_left() is None
        carrying = asyncio.create_task(hand.carry(KNIGHT, START, notes))
        await until(lambda: hand.seconds_left() is not None)
        first = hand.seconds_left()
        await hand.hold()
        second = hand.seconds_left()
        assert first is not None
        assert second is not None
        assert 0.0 <= second < first
        assert hand.seconds_left(pace=1000.0) == 0.0
        await hand.resume()
        await carrying
        assert hand.seconds_left() is None


async def test_stop_drops_nothing() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE)
        notes = await prepared(rig, hand)
        carrying = asyncio.create_task(hand.carry(KNIGHT, START, notes))
        await until(lambda: len(notes.seen) == 2 and rig.position()[2] > GRIP[2] + 20)
        await hand.stop()
        with pytest.raises(StoppedError):
            await carrying
        assert rig.gripper_closed()
        assert not hand.state.homed
        await hand.finish_held(KNIGHT, START.without(KNIGHT.source), notes)
        assert [note[0] for note in notes.seen[2:]] == [Checkpoint.RELEASED]
        assert apart(rig.position(), RELEASE) <= STEP
        assert not rig.gripper_closed()


async def test_finish_held_after_a_restart_of_the_program() -> None:
    """The piece stays in the gripper: it closes without current, and homing lifts first."""
    async with MemoryRig() as rig:
        notes = Notes(rig)
        async with rig.robot() as robot:
            hand = CartesianHand(robot, TABLE)
            await hand.prepare()
            carrying = asyncio.create_task(hand.carry(KNIGHT, START, notes))
            await until(lambda: len(notes.seen) == 2 and rig.position()[2] > GRIP[2] + 20)
            rig.unplug()
            with pytest.raises(Exception, match="cable"):
                await carrying
        async with rig.robot() as robot:
            assert robot.state.memory_kept
            assert robot.state.gripper is GripperState.CLOSED
            hand = CartesianHand(robot, TABLE)
            closed_until_lowered = asyncio.create_task(_lowest_while_closed(rig))
            await hand.finish_held(KNIGHT, START.without(KNIGHT.source), notes)
            await closed_until_lowered
        assert [note[0] for note in notes.seen[2:]] == [Checkpoint.RELEASED]
        assert apart(notes.seen[-1][2], RELEASE) <= STEP


async def _lowest_while_closed(rig: MemoryRig) -> None:
    await until(lambda: not rig.gripper_closed())
    assert apart(rig.position(), RELEASE) <= STEP


async def test_finish_held_without_a_restart_goes_up_first() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE)
        notes = await prepared(rig, hand)
        carrying = asyncio.create_task(hand.carry(KNIGHT, START, notes))
        await until(lambda: len(notes.seen) == 2 and rig.position()[2] > GRIP[2] + 20)
        carrying.cancel()
        with pytest.raises(asyncio.CancelledError):
            await carrying
        assert hand.state.homed
        assert rig.gripper_closed()
        await hand.finish_held(KNIGHT, START.without(KNIGHT.source), notes)
        assert apart(rig.position(), RELEASE) <= STEP


async def test_cancelled_while_planning_and_driving_nothing_runs_on() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        hand = CartesianHand(robot, TABLE)
        notes = await prepared(rig, hand)
        start = rig.position()
        carrying = asyncio.create_task(hand.carry(KNIGHT, START, notes))
        await until(lambda: apart(rig.position(), start) > 20)
        carrying.cancel()
        with pytest.raises(asyncio.CancelledError):
            await carrying
        stopped_at = rig.position()
        await asyncio.sleep(0.02)
        assert rig.position() == stopped_at
        assert hand.state.gripper is GripperState.OPEN
        assert not rig.gripper_closed()


async def test_an_unhomed_hand_does_not_plan() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        with pytest.raises(NotHomedError):
            await CartesianHand(robot, TABLE).park(Layout({}))


async def test_every_planner_can_carry() -> None:
    async with MemoryRig() as rig, rig.robot() as robot:
        for planner in ("safe-height", "asynchronous"):
            hand = CartesianHand(robot, TABLE, planner=planner)
            await hand.prepare()
            await hand.carry(KNIGHT, START, Notes(rig))
            assert apart(rig.position(), RELEASE) <= STEP
