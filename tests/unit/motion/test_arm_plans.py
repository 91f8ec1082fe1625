"""Plans of the arm: from where to where, at which tilt, clear of everything; and what cannot be planned."""

from dataclasses import replace

import chess
import numpy as np
import pytest
from tests.unit.motion.arm_cases import ARM, START, TABLE, rates, scene, transfer
from tests.unit.motion.motion_tables import placed

from kempelen.core.errors import MotionError, ReachError
from kempelen.core.geometry import Array
from kempelen.core.pieces import KINDS
from kempelen.core.places import Layout, Place, Transfer
from kempelen.kinematics import forward, least_tilt
from kempelen.kinematics.tilt import tilt_range
from kempelen.motion.arm.grasp import TILT_MARGIN, park_joints, transfer_rolls, transfer_tilts
from kempelen.motion.arm.guidance import bow_of, pose_of
from kempelen.motion.arm.plan import plan_arm_approach, plan_arm_carry, plan_arm_leave, plan_arm_reach
from kempelen.motion.arm.sweep import Held, sweep_arm

UPRIGHT = (0.0, 0.0)
PARK = park_joints(ARM, TABLE, ARM.home)
MOVES = [
    transfer("N", "g1", "f3"),
    transfer("p", "e7", "e5"),
    transfer("R", "a1", "left5"),
    transfer("q", "d8", "h4"),
]


def cleared(move: Transfer) -> Layout:
    """The start with room for the move."""
    layout = START
    for place in (move.target, Place("d7"), Place("e7") if move.source != Place("e7") else Place("d2")):
        layout = layout.without(place)
    return layout


@pytest.mark.parametrize("move", MOVES, ids=str)
def test_a_transfer_from_the_waiting_place_and_back(move: Transfer) -> None:
    layout = cleared(move)
    kind = move.piece.piece_type
    approach = plan_arm_approach(ARM, scene(layout), PARK, move)
    carry = plan_arm_carry(ARM, scene(layout), move, approach.joints[-1])
    leave = plan_arm_leave(ARM, scene(layout.after(move)), carry.joints[-1])
    assert (approach.joints[0] == PARK).all()
    assert approach.vertices[-1] == pytest.approx(TABLE.grip_point(move.source, kind), abs=1e-6)
    assert carry.vertices[-1] == pytest.approx(TABLE.release_point(move.target, kind), abs=1e-6)
    assert pose_of(ARM, approach.joints[-1]).tilt == pytest.approx(
        pose_of(ARM, carry.joints[-1]).tilt, abs=1e-9
    )
    for plan in (approach, carry, leave):
        assert plan.times[0] == 0
        assert plan.seconds == pytest.approx(plan.times[-1])
        assert plan.bound <= plan.seconds
        assert max(rates(plan.joints, plan.times)) <= 1 + 1e-6
        assert ARM.within(plan.joints).all()
        assert plan.vertices == pytest.approx(forward(ARM, plan.joints)[:, :3, 3])
    held = Held(TABLE.pieces[kind], carry.tilt)
    assert not sweep_arm(ARM, scene(layout.without(move.source)), carry.joints, held)


def test_the_piece_stays_upright_all_the_way() -> None:
    move = MOVES[2]
    assert min(transfer_tilts(ARM, TABLE, move)) > 0.09
    carry = plan_arm_carry(ARM, scene(cleared(move)), move, grip(move))
    tilts = [pose_of(ARM, joints).tilt for joints in carry.joints]
    assert tilts == pytest.approx([carry.tilt] * len(tilts), abs=1e-6)


def grip(move: Transfer) -> Array:
    joints: Array = plan_arm_approach(ARM, scene(cleared(move)), PARK, move).joints[-1]
    return joints


def test_the_way_down_to_a_piece_is_guided() -> None:
    move = MOVES[0]
    approach = plan_arm_approach(ARM, scene(), PARK, move)
    end = approach.vertices[-1]
    near = approach.vertices[:, 2] < end[2] + 20
    low = approach.joints[near]
    assert len(low) > 5
    straight = approach.vertices[near]
    assert bow_of(ARM, low, straight[0], straight[-1]) <= 2.0


def test_it_waits_aside_without_a_turn_of_the_base() -> None:
    for square in ("a1", "d4", "e8", "h5"):
        point = TABLE.grip_point(Place(square), chess.PAWN)
        there = least_tilt(ARM, point).joints
        waiting = park_joints(ARM, TABLE, there)
        assert waiting[0] == pytest.approx(there[0], abs=1e-9)
        assert forward(ARM, waiting)[2, 3] >= TABLE.park_height


def test_nothing_stops_between_the_ends() -> None:
    carry = plan_arm_carry(ARM, scene(), MOVES[0], grip(MOVES[0]))
    speed = np.abs(np.diff(carry.joints, axis=0)).max(axis=1) / np.diff(carry.times)
    assert speed[4:-4].min() > np.radians(3)


def test_the_tilt_is_the_least_that_serves_both_ends() -> None:
    near, far = transfer("P", "d7", "d5"), transfer("P", "d7", "a1")
    assert transfer_tilts(ARM, TABLE, near) == (0, 0)
    point = TABLE.release_point(Place("a1"), chess.PAWN)
    least = float(tilt_range(ARM, point[None])[0, 0])
    first, last = transfer_tilts(ARM, TABLE, far)
    assert first == last
    assert least < last <= least + np.radians(1.001)


def test_every_pair_of_places_has_a_common_tilt_for_every_kind() -> None:
    for kind in KINDS:
        points = np.array([f(p, kind) for p in TABLE.places for f in (TABLE.grip_point, TABLE.release_point)])
        ranges = tilt_range(ARM, points)
        assert ranges[:, 0].max() < ranges[:, 1].min()


@pytest.fixture
def narrow_tilts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few tilts are possible, and none on both d8 and a1; e4 is out of reach."""
    table_ranges = {"d8": (0.0, 0.1), "a1": (0.2, 0.4), "d4": (0.05, 0.3), "e4": (np.nan, np.nan)}

    def ranges(_arm: object, points: Array) -> Array:
        def of(point: Array) -> tuple[float, float]:
            name = min(table_ranges, key=lambda n: float(np.linalg.norm(TABLE.centre(Place(n)) - point)))
            return table_ranges[name]

        return np.array([of(point) for point in points])

    monkeypatch.setattr("kempelen.motion.arm.grasp.tilt_range", ranges)


@pytest.mark.usefixtures("narrow_tilts")
def test_without_a_common_tilt_rigid_pads_are_refused_with_both_ranges() -> None:
    rigid = replace(TABLE, gripper=TABLE.gripper.model_copy(update={"plumb": False}))
    move = transfer("q", "d8", "a1")
    with pytest.raises(ReachError, match=r"d8 to a1.*d8: 0° to 6°, a1: 11° to 23°") as caught:
        transfer_tilts(ARM, rigid, move)
    assert "plumb" in caught.value.hint
    assert transfer_tilts(ARM, rigid, transfer("q", "d8", "d4")) == pytest.approx((0.05 + TILT_MARGIN,) * 2)


@pytest.mark.usefixtures("narrow_tilts")
def test_hanging_pads_let_go_at_another_tilt_where_they_must() -> None:
    first, last = transfer_tilts(ARM, TABLE, transfer("q", "d8", "a1"))
    assert first == pytest.approx(TILT_MARGIN)
    assert last == pytest.approx(0.2 + TILT_MARGIN)
    assert transfer_tilts(ARM, TABLE, transfer("q", "d8", "d4")) == pytest.approx((0.05 + TILT_MARGIN,) * 2)
    move = transfer("q", "d8", "a1")
    approach = plan_arm_approach(ARM, scene(placed(d8="q")), PARK, move)
    carry = plan_arm_carry(ARM, scene(placed(d8="q")), move, approach.joints[-1])
    assert (approach.tilt, carry.tilt) == pytest.approx((first, last))
    with pytest.raises(ReachError, match="out of reach.*e4: out of reach"):
        transfer_tilts(ARM, TABLE, transfer("q", "d8", "e4"))


def test_the_fingers_turn_only_where_neighbours_ask_for_it() -> None:
    alone = placed(h8="R")
    assert transfer_rolls(ARM, scene(alone), transfer("R", "h8", "h5"), UPRIGHT) == (0.0, 0.0)
    first, _ = transfer_rolls(ARM, scene(placed(g8="K", f8="R", e8="K")), transfer("R", "f8", "f4"), UPRIGHT)
    assert plan_arm_approach(ARM, scene(placed(g8="K", f8="R", e8="K")), PARK, transfer("R", "f8", "f4"))
    assert abs(first) <= np.pi / 2
    assert transfer_rolls(ARM, scene(placed(g1="K", h1="R")), transfer("R", "h1", "f1"), (0.1, 0.1)) == (
        0.0,
        0.0,
    )


def test_the_arm_waits_beside_the_board_whatever_is_asked_of_it() -> None:
    for start in (ARM.home, grip(MOVES[0])):
        waiting = park_joints(ARM, TABLE, start)
        assert ARM.within(waiting)
        x, y, z = forward(ARM, waiting)[:3, 3]
        u, v = TABLE.surfaces[0].local(float(x), float(y))
        assert not (0 < u < 280 and 0 < v < 280)
        assert z >= TABLE.park_height


def test_nothing_to_grip_is_told() -> None:
    with pytest.raises(MotionError, match="Nothing stands on e4"):
        plan_arm_approach(ARM, scene(), PARK, transfer("N", "e4", "f6"))


def test_a_target_that_is_taken_is_told() -> None:
    with pytest.raises(MotionError, match="e2 is taken by the white pawn"):
        plan_arm_carry(ARM, scene(), transfer("N", "g1", "e2"), PARK)


def test_a_motion_that_would_touch_is_never_returned() -> None:
    """Its end is within the king."""
    king = TABLE.grip_point(Place("e1"), chess.KING)
    aside = plan_arm_approach(ARM, scene(placed(d1="Q")), PARK, transfer("Q", "d1", "d4")).joints[-1]
    into = aside + np.array([0.06, 0, 0, 0, 0])
    assert np.linalg.norm(forward(ARM, into)[:2, 3] - king[:2]) < 15
    with pytest.raises(MotionError, match=r"a finger would touch the white king on e1|no way keeps") as told:
        plan_arm_reach(ARM, scene(placed(e1="K")), PARK, into)
    assert "Nothing was sent" in str(told.value)


def test_a_start_beyond_a_joints_range_is_told() -> None:
    with pytest.raises(MotionError, match=r"shoulder .* beyond its range"):
        plan_arm_leave(ARM, scene(), ARM.home + np.radians([0, 70, 0, 0, 0]))
