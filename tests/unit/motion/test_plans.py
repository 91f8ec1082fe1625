"""Plans that may be driven: start and end exact, clear of everything, never slower than they need to be."""

import random

import chess
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.unit.motion.motion_tables import KING, WIDE, placed, random_board, random_transfer, tables

from kempelen.core.errors import MotionError
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.table import Table, WorkSpace, start_layout
from kempelen.motion.plan import Plan, plan_approach, plan_carry, plan_leave, plan_reach, propose_carry
from kempelen.motion.planners import PLANNERS
from kempelen.motion.scene import Clearances, Scene
from kempelen.motion.sweep import sweep

SEEDS = st.integers(0, 2**32 - 1)


def all_legs(
    table: Table, layout: Layout, transfer: Transfer, planner: str = "asynchronous"
) -> tuple[Plan, Plan, Plan]:
    """Approach, carry and leave of one transfer, each checked."""
    scene = Scene(table, layout)
    start = table.park_point(table.centre(transfer.source))
    approach = plan_approach(scene, start, transfer.source, planner=planner)
    carry = plan_carry(scene, transfer, planner=planner)
    after = Scene(table, layout.after(transfer))
    leave = plan_leave(after, carry.vertices[-1], planner=planner)
    return approach, carry, leave


@settings(max_examples=60)
@given(tables(), SEEDS)
def test_any_transfer_on_any_table(table: Table, seed: int) -> None:
    rng = random.Random(seed)
    layout = start_layout(table, random_board(rng))
    transfer = random_transfer(layout, table, rng)
    kind = transfer.piece.piece_type
    approach, carry, leave = all_legs(table, layout, transfer)
    grip, release = table.grip_point(transfer.source, kind), table.release_point(transfer.target, kind)
    ends = [
        (approach, table.park_point(grip), grip),
        (carry, grip, release),
        (leave, release, table.park_point(release)),
    ]
    for plan, start, end in ends:
        np.testing.assert_allclose(plan.vertices[[0, -1]], [start, end], rtol=0, atol=1e-9)
        assert max(table.space.excess(vertex) for vertex in plan.vertices) < 1e-3
        assert 0.95 * plan.bound <= plan.seconds <= 1.1 * plan.bound
        assert len(plan.vertices) < 110 * max(plan.seconds, 0.2)


@settings(max_examples=40)
@given(tables(), SEEDS)
def test_the_independent_sweep_finds_a_plan_15_mm_too_low(table: Table, seed: int) -> None:
    rng = random.Random(seed)
    layout = start_layout(table, random_board(rng))
    transfer = random_transfer(layout, table, rng)
    _, plan = propose_carry(Scene(table, layout), transfer)
    free = Scene(table, layout.without(transfer.source))
    shape = table.pieces[transfer.piece.piece_type]
    assert sweep(plan.vertices, free, shape) == []
    assert sweep(plan.vertices - [0, 0, 15.0], free, shape) != []


@settings(max_examples=25)
@given(tables(), SEEDS)
def test_nothing_is_slower_than_the_safe_height_nor_faster_than_the_bound(table: Table, seed: int) -> None:
    rng = random.Random(seed)
    layout = start_layout(table, random_board(rng))
    transfer = random_transfer(layout, table, rng)
    fast, *others = (propose_carry(Scene(table, layout), transfer, planner=name)[1] for name in PLANNERS)
    slow = propose_carry(Scene(table, layout), transfer, planner="safe-height")[1]
    assert fast.seconds <= slow.seconds
    assert {plan.bound for plan in (fast, slow, *others)} == {fast.bound}
    assert fast.bound <= slow.seconds
    assert fast.bound <= fast.seconds * 1.03  # the controller's corners may strain an axis for a moment


def test_random_games_of_chess_touch_nothing() -> None:
    table, rng = Table(), random.Random(20)
    for _ in range(60):
        board = random_board(rng)
        layout = start_layout(table, board)
        moves = [move for move in board.legal_moves if not board.is_capture(move)]
        if moves:
            move = rng.choice(moves)
            source, target = Place.at(move.from_square), Place.at(move.to_square)
            all_legs(table, layout, Transfer(layout[source], source, target))


@pytest.mark.parametrize("place", [str(place) for place in Table().places])
def test_every_place_is_served_among_the_tallest_neighbours(place: str) -> None:
    """All squares and slots taken but two; off centre by up to 3 mm is part of every check."""
    table, rng = Table(), random.Random(place)
    target = Place(place)
    source = rng.choice([p for p in table.places if p != target])
    full = Layout(dict.fromkeys(table.places, KING)).without(target)
    all_legs(table, full, Transfer(KING, source, target))


@pytest.mark.parametrize("name", PLANNERS)
def test_every_planner_serves_every_leg(name: str) -> None:
    table = Table()
    layout = start_layout(table, chess.Board())
    transfer = Transfer(layout[Place("e2")], Place("e2"), Place("e4"))
    for plan in all_legs(table, layout, transfer, name):
        assert plan.planner == name
        assert plan.seconds >= 0.97 * plan.bound


def test_regression_every_piece_gripped_at_one_height() -> None:
    """The original closed on kings and pawns at the same height; each has its own, and is let go there."""
    table = Table()
    heights = set()
    for symbol in "KQRBNP":
        piece = chess.Piece.from_symbol(symbol)
        transfer = Transfer(piece, Place("d4"), Place("left3"))
        approach, carry, _ = all_legs(table, placed(d4=symbol), transfer)
        grip = table.pieces[piece.piece_type].grip_height
        assert approach.vertices[-1, 2] == carry.vertices[0, 2] == grip
        assert carry.vertices[-1, 2] == pytest.approx(grip + table.gripper.release_height)
        heights.add(grip)
    assert len(heights) == 6


def test_a_tall_piece_in_the_way_costs_time_a_low_one_less() -> None:
    table = Table()
    transfer = Transfer(KING, Place("a1"), Place("c1"))
    free, pawn, queen = (
        plan_carry(Scene(table, placed(a1="K", **over)), transfer) for over in ({}, {"b1": "P"}, {"b1": "Q"})
    )
    assert free.seconds < pawn.seconds < queen.seconds


def test_a_piece_beside_the_way_costs_nothing() -> None:
    table = Table()
    transfer = Transfer(KING, Place("a1"), Place("h1"))
    alone, beside = (
        plan_carry(Scene(table, placed(a1="K", **more)), transfer) for more in ({}, {"d2": "q", "e2": "q"})
    )
    assert beside.seconds == alone.seconds


def test_from_one_released_piece_straight_to_the_next() -> None:
    table = Table()
    scene = Scene(table, placed(d5="p", e4="P"))
    released = table.release_point(Place("d5"), chess.PAWN)
    plan = plan_approach(scene, released, Place("e4"))
    clear = table.pieces.pawn.height + table.gripper.below_tool
    for vertex in plan.vertices:
        away = min(np.hypot(*(vertex - end)[:2]) for end in (plan.vertices[0], plan.vertices[-1]))
        assert away < 0.2 or vertex[2] > clear


def test_a_held_piece_is_carried_on_from_anywhere() -> None:
    table = Table()
    scene = Scene(table, placed(e2="p"))
    start = (30.0, 40.0, 200.0)
    plan = plan_carry(scene, Transfer(KING, Place("e1"), Place("e4")), start=start)
    assert tuple(plan.vertices[0]) == start


def test_straight_up_and_down() -> None:
    table = Table()
    scene = Scene(table, placed(e4="K"))
    low, high = table.grip_point(Place("e4"), chess.KING), table.centre(Place("e4")) + np.array([0, 0, 180])
    for start, end in ((low, high), (high, low)):
        for name in PLANNERS:
            plan = plan_reach(scene, start, end, planner=name)
            assert len(plan.vertices) == 2
            assert plan.seconds == pytest.approx(plan.bound)


# --- what cannot be ------------------------------------------------------------------------------------


def test_too_tall_for_the_work_space_says_by_how_much() -> None:
    table = Table(space=WorkSpace(upper=(700.0, 450.0, 140.0)))
    transfer = Transfer(KING, Place("e1"), Place("e8"))
    with pytest.raises(
        MotionError, match=r"white queen on e4 needs.* z = 143.0 mm.*140.0 mm, 3.0 mm too low"
    ):
        plan_carry(Scene(table, placed(e1="K", e4="Q")), transfer)


def test_a_safe_height_beyond_the_work_space_says_by_how_much() -> None:
    table = Table(space=WorkSpace(upper=(700.0, 450.0, 150.0)))
    transfer = Transfer(KING, Place("e1"), Place("e8"))
    with pytest.raises(MotionError, match=r"safe height is z = 153.0 mm.*3.0 mm too low.*asynchronous"):
        plan_carry(Scene(table, placed(e1="K")), transfer, planner="safe-height")


def test_a_place_out_of_reach_says_by_how_much() -> None:
    table = Table(space=WorkSpace(upper=(480.0, 450.0, 200.0)))
    transfer = Transfer(KING, Place("a1"), Place("h1"))
    with pytest.raises(MotionError, match=r"white king from a1 to h1: the end .* lies 45.0 mm outside"):
        plan_carry(Scene(table, placed(a1="K")), transfer)


def test_an_empty_place_cannot_be_gripped() -> None:
    with pytest.raises(MotionError, match="Nothing stands on e5"):
        plan_approach(Scene(Table(), placed(e4="K")), (0, 0, 150), Place("e5"))


def test_a_taken_target_is_refused() -> None:
    with pytest.raises(MotionError, match="e4 is taken by the black pawn"):
        plan_carry(Scene(Table(), placed(e1="K", e4="p")), Transfer(KING, Place("e1"), Place("e4")))


def test_an_unknown_planner_is_named_with_the_choices() -> None:
    with pytest.raises(MotionError, match="no planner 'straight'.*asynchronous, safe-height, supercover"):
        plan_carry(
            Scene(Table(), placed(e1="K")), Transfer(KING, Place("e1"), Place("e4")), planner="straight"
        )


def test_neighbours_too_close_for_the_fingers_are_an_error_with_the_numbers() -> None:
    table = Table(square=40.0, space=WIDE)
    with pytest.raises(MotionError, match=r"Reaching for the white king on e1.*a finger would touch .*d1 by"):
        plan_approach(Scene(table, placed(d1="Q", e1="K")), (0, 0, 150), Place("e1"))


def test_the_heuristic_touches_and_is_refused() -> None:
    """It climbs where the line enters a square: the carried piece is wider than the line."""
    scene = Scene(Table(), placed(a5="K", b5="q"))
    transfer = Transfer(KING, Place("a5"), Place("c5"))
    plan_carry(scene, transfer)
    with pytest.raises(MotionError, match=r"supercover planner.*would touch.*Nothing was sent.*asynchronous"):
        plan_carry(scene, transfer, planner="supercover")


def test_wider_clearances_are_kept() -> None:
    table = Table()
    transfer = Transfer(KING, Place("a1"), Place("c1"))
    tight, wide = (
        plan_carry(Scene(table, placed(a1="K", b1="P"), Clearances(vertical=mm)), transfer) for mm in (5, 25)
    )
    assert wide.vertices[:, 2].max() >= 45 + 48 + 25 - 1e-3
    assert tight.vertices[:, 2].max() < wide.vertices[:, 2].max()
