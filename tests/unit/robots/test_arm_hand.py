"""The arm's hand over a real driver and the virtual controller: what it does and when it says so."""

import asyncio
from collections.abc import Callable

import chess
import numpy as np
import pytest

from kempelen.core.arm_table import arm_table
from kempelen.core.errors import MotionError, NotHomedError, StoppedError
from kempelen.core.geometry import Array
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Checkpoint, FollowJoints, GripperState, RobotPhase, SetGripper
from kempelen.core.table import start_layout
from kempelen.kinematics import forward
from kempelen.motion.arm.grasp import park_joints
from kempelen.robots.arm_hand import ArmHand
from kempelen.testing.arm_rigs import ARM, ArmRig
from kempelen.testing.contracts.robot import apart, phase, until

TABLE = arm_table()
START = start_layout(TABLE, chess.Board())
KNIGHT = Transfer(chess.Piece(chess.KNIGHT, chess.WHITE), Place("g1"), Place("f3"))
GRIP = tuple(TABLE.grip_point(Place("g1"), chess.KNIGHT))
RELEASE = tuple(TABLE.release_point(Place("f3"), chess.KNIGHT))
NEAR = 0.5
"""Whole steps, mm."""


class Notes:
    """Checkpoints, with what was physically true at each."""

    def __init__(self, rig: ArmRig) -> None:
        self._rig = rig
        self.seen: list[tuple[Checkpoint, bool, tuple[float, float, float]]] = []

    async def __call__(self, checkpoint: Checkpoint) -> None:
        await asyncio.sleep(0)
        self.seen.append((checkpoint, self._rig.gripper_closed(), self._rig.position()))


def parked(joints: Array) -> bool:
    x, y, _ = forward(ARM, joints)[:3, 3]
    u, v = TABLE.surfaces[0].local(float(x), float(y))
    return not (0 < u < 280 and 0 < v < 280)


async def test_a_transfer_is_two_groups_with_true_checkpoints() -> None:
    async with ArmRig() as rig, rig.robot() as robot:
        hand = ArmHand(robot, TABLE, ARM)
        await hand.prepare()
        assert hand.state.gripper is GripperState.OPEN
        assert parked(np.array(rig.controller.joints))
        notes = Notes(rig)
        report = await hand.carry(KNIGHT, START, notes)
        gripping, carrying, released = notes.seen
        assert gripping[:2] == (Checkpoint.GRIPPING, False)
        assert carrying[:2] == (Checkpoint.CARRYING, True)
        assert apart(carrying[2], GRIP) <= NEAR
        assert released[:2] == (Checkpoint.RELEASED, False)
        assert apart(released[2], RELEASE) <= NEAR
        assert report.transfer == KNIGHT
        assert 0 < report.bound < report.predicted
        assert 0 < report.carry < report.seconds
        await hand.park(START.after(KNIGHT))
        assert parked(np.array(rig.controller.joints))


async def test_the_next_transfer_begins_around_the_piece_just_released() -> None:
    async with ArmRig() as rig, rig.robot() as robot:
        hand = ArmHand(robot, TABLE, ARM)
        await hand.prepare()
        await hand.carry(KNIGHT, START, Notes(rig))
        pawn = Transfer(chess.Piece(chess.PAWN, chess.BLACK), Place("e7"), Place("e5"))
        await hand.carry(pawn, START.after(KNIGHT), Notes(rig))
        assert apart(rig.position(), tuple(TABLE.release_point(Place("e5"), chess.PAWN))) <= NEAR


async def test_only_joint_paths_and_the_gripper_are_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    async with ArmRig() as rig, rig.robot() as robot:
        hand = ArmHand(robot, TABLE, ARM)
        await hand.prepare()
        groups, grips = list[list[type]](), list[bool]()
        run: Callable[..., object] = robot.run

        async def noted(group: list[FollowJoints | SetGripper]) -> None:
            groups.append([type(action) for action in group])
            grips.extend(action.closed for action in group if isinstance(action, SetGripper))
            await run(group)  # type: ignore[misc]

        monkeypatch.setattr(robot, "run", noted)
        await hand.carry(KNIGHT, START, Notes(rig))
        await hand.park(START.after(KNIGHT))
        # What hangs is held still for a moment before it is let go.
        let_go = [FollowJoints, SetGripper, SetGripper]
        assert groups == [[FollowJoints, SetGripper], let_go, [FollowJoints]]
        assert grips == [True, True, False]


async def test_a_carry_that_cannot_be_planned_ends_at_rest() -> None:
    async with ArmRig() as rig, rig.robot() as robot:
        hand = ArmHand(robot, TABLE, ARM)
        await hand.prepare()
        notes = Notes(rig)
        onto = Transfer(KNIGHT.piece, KNIGHT.source, Place("e2"))
        with pytest.raises(MotionError, match="taken"):
            await hand.carry(onto, START, notes)
        assert [note[0] for note in notes.seen] == [Checkpoint.GRIPPING]
        assert phase(robot) is RobotPhase.IDLE
        assert hand.state.gripper is GripperState.OPEN
        await hand.prepare()
        await hand.carry(KNIGHT, START, notes)


async def test_a_stop_in_mid_carry_and_on_with_the_piece_held() -> None:
    async with ArmRig() as rig, rig.robot() as robot:
        hand = ArmHand(robot, TABLE, ARM)
        await hand.prepare()
        notes = Notes(rig)
        carrying = asyncio.ensure_future(hand.carry(KNIGHT, START, notes))
        await until(lambda: len(notes.seen) == 2 and phase(robot) is RobotPhase.MOVING)
        await hand.hold()
        assert phase(robot) is RobotPhase.HELD
        left = hand.seconds_left()
        assert left is not None
        await hand.resume()
        await hand.stop()
        with pytest.raises(StoppedError):
            await carrying
        assert rig.gripper_closed()
        await hand.finish_held(KNIGHT, START.without(KNIGHT.source), notes)
        assert notes.seen[-1][0] is Checkpoint.RELEASED
        assert apart(notes.seen[-1][2], RELEASE) <= NEAR


async def test_before_homing_the_hand_does_not_know_where_it_is() -> None:
    async with ArmRig() as rig, rig.robot() as robot:
        with pytest.raises(NotHomedError, match="joints"):
            await ArmHand(robot, TABLE, ARM).park(Layout({}))


def test_the_waiting_place_is_within_the_ranges() -> None:
    assert ARM.within(park_joints(ARM, TABLE, ARM.home))
