"""What stands in the way of a leg, and the scene it is read from."""

import random
from math import cos, hypot, sin

import chess
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.unit.motion.motion_tables import placed, point, tables

from kempelen.core.geometry import Transform
from kempelen.core.places import Place
from kempelen.core.table import Table
from kempelen.motion.leg import Leg, columns
from kempelen.motion.scene import Clearances, Scene

TABLE = Table()
KING = TABLE.pieces.king


def leg(scene: Scene, start: str, end: str) -> Leg:
    """The king carried between two squares."""
    return Leg.between(
        scene,
        point(scene.table.grip_point(Place(start), chess.KING)),
        point(scene.table.release_point(Place(end), chess.KING)),
        scene.table.pieces.king,
        "test",
    )


def test_hurdles_by_hand() -> None:
    """The king's base over the rook's base and head; its fingers over the head alone."""
    hurdles = {h.height: h for h in leg(Scene(TABLE, placed(c1="r")), "a1", "e1").hurdles}
    board = hurdles[48 + 3]
    assert (board.what, board.enter, board.leave) == ("the board", 0.1, 199.9)
    fingers = hypot(KING.grip_diameter / 2 + TABLE.gripper.finger_thickness, TABLE.gripper.finger_width / 2)
    base, head, waist, top = 33 / 2, 24 / 2, 30, 55
    for radius, other, height in (
        (KING.base_diameter / 2, base, waist + 10 + 48),
        (KING.base_diameter / 2, head, top + 10 + 48),
        (fingers, head, top + 10 + TABLE.gripper.below_tool),
    ):
        hurdle = hurdles[height]
        reach = radius + other + 3 + 3
        assert (hurdle.enter, hurdle.leave) == pytest.approx((100 - reach, 100 + reach))
        assert hurdle.what == "the black rook on c1"
    assert len(hurdles) == 4


def test_the_piece_is_passed_over_by_its_own_length_below_the_tool() -> None:
    scene = Scene(TABLE, placed(c1="q"))
    assert leg(scene, "a1", "e1").rise == 85 + 10 + 48


@settings(max_examples=60)
@given(tables(), st.integers(0, 2**32 - 1))
def test_outside_of_its_hurdles_a_leg_keeps_its_lateral_clearance(table: Table, seed: int) -> None:
    rng = random.Random(seed)
    squares = rng.sample(chess.SQUARE_NAMES, 14)
    scene = Scene(table, placed(**dict.fromkeys(squares[2:], "k")))
    here = leg(scene, squares[0], squares[1])
    king, clear = table.pieces.king, scene.clearances
    reach = king.base_diameter + clear.lateral + clear.off_centre
    ends = [np.array(here.start[:2]), np.array(here.end[:2])]
    for distance in np.linspace(0, here.length, 80):
        z = max([h.height for h in here.hurdles if h.enter <= distance <= h.leave], default=-np.inf)
        x, y, _ = here.at(distance, 0.0)
        for place in scene.places:
            px, py, pz = table.centre(place)
            room = min(hypot(px - ex, py - ey) for ex, ey in ends)
            if hypot(px - x, py - y) < min(reach, room) - 1e-6:
                assert z >= pz + king.grip_height + clear.vertical + king.grip_height - 0.01


def test_on_a_leaning_board_its_highest_point_on_the_way_counts() -> None:
    lean = 0.01
    tilt = np.array([[cos(lean), 0, sin(lean)], [0, 1, 0], [-sin(lean), 0, cos(lean)]])
    table = Table(robot_from_board=Transform(tilt, np.array([150.0, 25, 10])))
    (board,) = leg(Scene(table, placed()), "g4", "b4").hurdles
    highest = float(table.centre(Place("b4"))[2])
    assert board.height == pytest.approx(highest + np.tan(lean) * KING.base_diameter / 2 + 3 + 48, abs=1e-3)


def test_less_room_than_the_clearance_is_kept_and_slows_nothing_that_moves_away() -> None:
    wide = Clearances(lateral=15.0)
    (board,) = leg(Scene(TABLE, placed(c4="q"), wide), "d4", "h4").hurdles
    (same,) = leg(Scene(TABLE, placed(h4="q"), wide), "d4", "g4").hurdles[:1]
    assert board.what == same.what == "the board"
    ahead = leg(Scene(TABLE, placed(h4="q"), wide), "d4", "g4").hurdles
    assert {h.what for h in ahead} == {"the board"}
    across = leg(Scene(TABLE, placed(e4="q"), wide), "d4", "g4").hurdles
    assert min(h.enter for h in across if h.what != "the board") == pytest.approx(0.0, abs=1e-9)


def test_off_the_own_piece_straight_up_until_its_head_is_clear() -> None:
    scene = Scene(TABLE, placed(e4="K", a4="p"))
    grips = [point(TABLE.grip_point(Place(*at), kind)) for at, kind in ((("e4",), 6), (("a4",), 1))]
    grips[0] = (grips[0][0] + 0.05, grips[0][1], grips[0][2])  # a step or two off
    here = Leg.between(scene, grips[0], grips[1], None, "test")
    own = {h.what: h for h in here.hurdles if "on" in h.what}
    assert len(own) == len([h for h in here.hurdles if "on" in h.what]) == 2
    fingers = columns(TABLE.gripper, None)[0].radius
    king, pawn = own["the white king on e4"], own["the black pawn on a4"]
    assert king.height == KING.height + 3 + TABLE.gripper.below_tool
    assert (king.enter, king.leave) == pytest.approx((0.1, fingers + KING.head_diameter / 2 + 3 + 3))
    reach = fingers + TABLE.pieces.pawn.head_diameter / 2 + 3 + 3
    assert (pawn.enter, pawn.leave) == pytest.approx((200.05 - reach, 199.95))


def test_the_hand_is_a_stack_of_columns() -> None:
    fingers, palm = columns(TABLE.gripper, None)
    assert fingers.radius == pytest.approx(
        hypot(TABLE.gripper.half_length_open, TABLE.gripper.finger_width / 2)
    )
    assert (fingers.bottom, palm.bottom) == (-TABLE.gripper.below_tool, TABLE.gripper.finger_length)
    closed, base, _ = columns(TABLE.gripper, KING)
    assert closed.radius < fingers.radius
    assert (base.radius, base.bottom) == (KING.base_diameter / 2, -KING.grip_height)


def test_open_fingers_know_the_piece_they_stand_around() -> None:
    scene = Scene(TABLE, placed(e4="K", d4="p"))
    grip = point(TABLE.grip_point(Place("e4"), chess.KING))
    index = scene.gripped_at(grip)
    assert index is not None
    assert scene.name(index) == "the white king on e4"
    assert scene.gripped_at((grip[0] + 1.0, grip[1], grip[2])) is None
    assert scene.gripped_at((grip[0], grip[1], KING.height + TABLE.gripper.below_tool + 0.1)) is None
    assert Scene(TABLE, placed()).gripped_at(grip) is None


def test_a_scene_without_a_piece() -> None:
    scene = Scene(TABLE, placed(e4="K", d4="p"), Clearances(off_centre=1.0))
    less = scene.without(Place("e4"))
    assert less.places == (Place("d4"),)
    assert less.clearances is scene.clearances
    assert less.radius.tolist() == [29 / 2 + 1, 18 / 2 + 1]
    assert (less.bottom.tolist(), less.top.tolist()) == ([0.0, 24.0], [24.0, 45.0])


@pytest.mark.parametrize("bad", [{"vertical": 0.0}, {"lateral": -1.0}, {"align": 2.0}, {"typo": 1.0}])
def test_clearances_are_bounded(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(bad))):
        Clearances(**bad)
