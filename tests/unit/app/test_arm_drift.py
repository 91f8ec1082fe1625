"""An arm whose drift is kept account of, and the hand that has it homed in time."""

from collections.abc import AsyncIterator, Sequence
from typing import cast

import chess
import numpy as np
import pytest

from kempelen.app.careful_hand import CarefulHand, tolerance
from kempelen.app.kept_arm import KeptArm
from kempelen.app.other_hand import TableHand
from kempelen.core.arm_table import arm_table
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import (
    Action,
    Checkpoint,
    Follow,
    FollowJoints,
    OnCheckpoint,
    Robot,
    RobotState,
    SetGripper,
    TransferReport,
)
from kempelen.core.table import start_layout
from kempelen.kinematics import forward, least_tilt, load_arm

ARM = load_arm("labvolt-5150")
TABLE = arm_table()
START = start_layout(TABLE, chess.Board())
PAWN = Transfer(chess.Piece(chess.PAWN, chess.WHITE), Place("e2"), Place("e4"))
KING = Transfer(chess.Piece(chess.KING, chess.WHITE), Place("a1"), Place("b1"))


class Steps:
    """A robot that goes where it is told, as far as its steps show."""

    name, space = "steps", TABLE.space

    def __init__(self) -> None:
        self.joints = ARM.home
        self.ran: list[Action] = []

    @property
    def state(self) -> RobotState:
        x, y, z = forward(ARM, self.joints)[:3, 3].tolist()
        return RobotState(homed=True, joints=tuple(self.joints.tolist()), reported_position=(x, y, z))

    async def watch(self) -> AsyncIterator[RobotState]:
        yield self.state

    async def home(self) -> None:
        self.joints = ARM.home

    async def run(self, group: Sequence[Action]) -> None:
        self.ran += group
        for action in group:
            if isinstance(action, FollowJoints):
                self.joints = action.vertices[-1]


class Errand:
    """A hand that drives there and back, and says what is to be reached."""

    table = TABLE

    def __init__(self, arm: KeptArm) -> None:
        self.arm = arm
        self.parked = 0

    async def carry(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> TransferReport:
        del standing
        for place, reached in (
            (transfer.source, Checkpoint.GRIPPING),
            (transfer.target, Checkpoint.RELEASED),
        ):
            await self.arm.run([way(self.arm, place)])
            await checkpoint(reached)
        return TransferReport(transfer, 1.0, 1.0, 1.0, 1.0)

    async def park(self, standing: Layout) -> None:
        del standing
        self.parked += 1


def way(arm: KeptArm, place: Place) -> FollowJoints:
    assert arm.joints is not None
    end = least_tilt(ARM, TABLE.grip_point(place, chess.PAWN)).joints
    return FollowJoints(np.array([arm.joints, end]), np.array([0.0, 1.0]), 1.0)


async def nothing(_at: Checkpoint) -> None:
    return None


@pytest.fixture
def steps() -> Steps:
    return Steps()


@pytest.fixture
def kept(steps: Steps) -> KeptArm:
    return KeptArm(cast("Robot", steps), ARM)


@pytest.fixture
def errand(kept: KeptArm) -> Errand:
    return Errand(kept)


@pytest.fixture
def hand(errand: Errand, kept: KeptArm) -> CarefulHand:
    return CarefulHand(cast("TableHand", errand), kept)


async def test_what_is_lost_by_the_way_is_taken_away_from_commands(kept: KeptArm, steps: Steps) -> None:
    for place in (Place("a1"), Place("h8"), Place("a1")):
        before = steps.joints
        await kept.run([way(kept, place), SetGripper(closed=True, seconds=0.1)])
    wanted = least_tilt(ARM, TABLE.grip_point(Place("a1"), chess.PAWN)).joints
    lost = 2 * ARM.drift.stop_bias  # at the two stops before the last one
    ahead = np.sign(steps.joints - before) * ARM.drift.play / 2  # the gear pushes from where it comes
    np.testing.assert_allclose(steps.joints, wanted - lost + ahead, atol=1e-9)
    assert kept.joints is not None
    np.testing.assert_allclose(kept.joints - wanted, ARM.drift.stop_bias, atol=1e-9)


async def test_where_a_joint_rests_is_not_known_after_a_line_of_the_tool_point(kept: KeptArm) -> None:
    await kept.run([way(kept, Place("a1"))])
    np.testing.assert_allclose(kept.slack.low[:4], kept.slack.high[:4])  # the roll has not turned
    assert kept.state.reported_position is not None
    here = np.array(kept.state.reported_position)
    await kept.run([Follow(np.array([here, here + np.array([0.0, 0.0, 5.0])]), 1.0)])
    np.testing.assert_allclose(kept.slack.high - kept.slack.low, ARM.drift.play)


async def test_a_path_begins_where_the_steps_are(kept: KeptArm, steps: Steps) -> None:
    await kept.run([way(kept, Place("a1"))])
    before, planned = steps.joints, way(kept, Place("h8"))
    await kept.run([planned])
    sent = steps.ran[-1]
    assert isinstance(sent, FollowJoints)
    np.testing.assert_allclose(sent.vertices[0], before)


async def test_a_line_of_the_tool_point_is_shifted(kept: KeptArm, steps: Steps) -> None:
    await kept.run([way(kept, Place("a1"))])
    assert kept.state.reported_position is not None
    here = np.array(kept.state.reported_position)
    await kept.run([Follow(np.array([here, here + np.array([0.0, 0.0, 5.0])]), 1.0)])
    sent = steps.ran[-1]
    assert isinstance(sent, Follow)
    np.testing.assert_allclose(sent.vertices[0], forward(ARM, steps.joints)[:3, 3], atol=1e-6)


async def test_homing_clears_the_account(kept: KeptArm) -> None:
    await kept.run([way(kept, Place("a1"))])
    assert kept.errors.mean.any()
    await kept.home()
    assert not kept.errors.mean.any()
    assert kept.homings == 1


async def test_the_arm_is_homed_before_a_grasp_can_fail_and_not_for_each_one(
    hand: CarefulHand, errand: Errand
) -> None:
    for _ in range(30):
        await hand.carry(PAWN, START, nothing)
    near = hand.rehomings
    for _ in range(30):
        await hand.carry(KING, START, nothing)  # far from the base: the same angles are more millimetres
    assert 0 < near < 6
    assert near < hand.rehomings - near <= 10
    assert errand.parked == hand.rehomings  # never homed between the pieces


async def test_a_piece_that_the_arm_has_set_down_stands_where_the_arm_is_off_to(
    hand: CarefulHand, errand: Errand, kept: KeptArm
) -> None:
    for _ in range(10):
        await errand.carry(PAWN, START, nothing)
    drifted = hand.unsure(KING.target, KING.piece)
    await hand.carry(KING, START, nothing)
    stands = START.without(KING.source).without(KING.target).having(KING.target, KING.piece)
    just = hand.unsure(KING.target, KING.piece)
    assert just < drifted / 2
    await kept.home()
    assert hand.unsure(KING.target, KING.piece) > just  # the arm knows its place better, not the piece's
    await hand.park(stands)
    by_the_arm = hand.unsure(KING.target, KING.piece)
    await hand.park(stands.without(KING.target))
    assert hand.unsure(KING.target, KING.piece) != by_the_arm  # somebody took it away


async def test_parked_it_is_homed_when_the_next_grasp_is_at_risk(hand: CarefulHand, errand: Errand) -> None:
    await hand.park(START)
    assert hand.rehomings == 0
    for _ in range(3):
        await hand.carry(PAWN, START, nothing)
    await hand.park(START)
    assert hand.rehomings == 0
    for _ in range(12):
        await errand.carry(PAWN, START, nothing)  # without a care
    await hand.park(START)
    assert hand.rehomings == 1
    assert errand.parked == 4  # once more, since homing ends over the board


async def test_what_the_camera_sees_makes_it_surer(hand: CarefulHand, kept: KeptArm) -> None:
    await hand.carry(PAWN, START, nothing)
    joints = least_tilt(ARM, TABLE.grip_point(Place("e4"), chess.PAWN)).joints
    before = kept.errors.tool(ARM, joints)
    hand.seen(lambda place: np.array([0.0, 1.5, np.nan]) if place == Place("e4") else None)
    after = kept.errors.tool(ARM, joints)
    assert kept.looks == 1
    assert after.aside_known < before.aside_known
    assert after.shift[1] > before.shift[1]


def test_a_wide_head_forgives_less() -> None:
    assert tolerance(TABLE, chess.PAWN) > tolerance(TABLE, chess.KING) > 0
