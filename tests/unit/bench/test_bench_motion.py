"""The motion bench on a short game, through the virtual controller."""

import random

import chess
import pytest

from kempelen.bench.motion import Driven, _Comparison, driven, move_steps, random_position
from kempelen.core.places import Place, Transfer
from kempelen.core.table import Table, start_layout
from kempelen.game.pgn import GameScore, parse_game
from kempelen.motion.plan import Plan, plan_carry
from kempelen.motion.planners import PLANNERS
from kempelen.motion.scene import Scene

SHORT = "1. e4 d5 2. exd5 Nf6 3. Bb5+ c6 4. dxc6 Bg4 5. cxb7+ Nbd7 6. Nf3 Rb8 7. O-O Bxf3 *"
TABLE = Table()


@pytest.fixture(scope="module")
def comparison() -> _Comparison:
    out = _Comparison(TABLE)
    out.replay(parse_game(SHORT))
    rng = random.Random(5)
    for _ in range(8):
        out.try_position(random_position(rng), rng)
    return out


def test_the_figures_of_a_short_game_are_in_their_ranges(comparison: _Comparison) -> None:
    figures = comparison.figures()
    assert figures["executed_over_bound"] <= 1.05
    assert 1.3 < figures["supercover_over_bound"] < figures["safe_height_over_bound"] < 3.5
    assert figures["collisions"] == 0
    assert figures["plan_ms_median"] > 0
    assert 1.0 < figures["quiet_move_s_median"] < 3.5


def test_there_is_a_row_for_each_planner_and_one_for_the_positions(comparison: _Comparison) -> None:
    rows = comparison.rows()
    assert [row["planner"] for row in rows] == [*PLANNERS, *PLANNERS, "asynchronous"]
    assert {row["n"] for row in rows[:6]} == {19}
    assert len({tuple(row) for row in rows}) == 1


def test_what_the_controller_drives_is_what_was_planned() -> None:
    layout = start_layout(TABLE, chess.Board())
    transfer = Transfer(layout[Place("g1")], Place("g1"), Place("f3"))
    plan = plan_carry(Scene(TABLE, layout), transfer)
    scene, shape = Scene(TABLE, layout.without(Place("g1"))), TABLE.pieces.knight
    seconds, touching = driven(Driven(plan, scene, shape))
    assert seconds == pytest.approx(plan.seconds, rel=0.03)
    assert not touching
    low = Plan(plan.vertices - [0, 0, 15.0], plan.seconds, plan.bound, plan.planner)
    assert driven(Driven(low, scene, shape))[1]


def test_the_operator_brings_what_is_missing() -> None:
    """Three promotions to knights: the set has but two, on the board."""
    score = GameScore({}, "8/PPP5/8/8/8/8/7k/1NN1K3 w - - 0 1", (), "*")
    board = score.start_board()
    steps = move_steps(board, chess.Move.from_uci("a7a8n"), start_layout(TABLE, board), TABLE)
    assert [str(transfer.target) for _, transfer in steps][-1] == "a8"
    assert steps[-1][1].piece == chess.Piece(chess.KNIGHT, chess.WHITE)


def test_random_positions_are_seeded_and_go_on() -> None:
    first, again = (random_position(random.Random(3)).fen() for _ in range(2))
    assert first == again
    assert not random_position(random.Random(4)).is_game_over()
