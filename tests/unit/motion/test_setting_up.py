"""Setting up a position: the formula against a search, plans that can be carried out, and what is refused."""

import heapq
import random
from collections.abc import Iterator
from itertools import count

import chess
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import OperatorNeededError
from kempelen.core.places import Layout, Place
from kempelen.core.table import Table, start_layout
from kempelen.motion.setting_up import Differences, SettingUp, plan_setting_up

TABLE = Table()
START = start_layout(TABLE, chess.Board())
FEW = [Place(name) for name in ("a1", "b1", "c1", "a2", "b2", "c2")]
SLOTS = [Place.slot("left", number) for number in (1, 2, 3)]
PIECES = [chess.Piece.from_symbol(symbol) for symbol in "KQNn"]

State = tuple[str, ...]


def search(standing: Layout, wanted: dict[chess.Square, chess.Piece]) -> int:
    """Fewest transfers by A*, each piece that stands wrong counted as one: never too many."""
    places = [*FEW, *SLOTS]
    start = tuple(standing[p].symbol() if p in standing else "" for p in places)
    goal = [wanted[p.square].symbol() if p.square in wanted else "" for p in FEW if p.square is not None]
    order, best, front = count(), {start: 0}, [(0, 0, start)]

    def wrong(state: State) -> int:
        return sum(1 for held, meant in zip(state, goal, strict=False) if held and held != meant)

    while front:
        _, _, state = heapq.heappop(front)
        if list(state[: len(FEW)]) == goal:
            return best[state]
        for after in following(state):
            steps = best[state] + 1
            if steps < best.get(after, 99):
                best[after] = steps
                heapq.heappush(front, (steps + wrong(after), next(order), after))
    raise AssertionError("no way found")


def following(state: State) -> Iterator[State]:
    for source, held in enumerate(state):
        for target, other in enumerate(state):
            if held and not other:
                after = list(state)
                after[source], after[target] = "", held
                yield tuple(after)


def carried_out(standing: Layout, plan: SettingUp) -> Layout:
    for transfer in plan.transfers:
        standing = standing.after(transfer)  # refuses a target that is taken
    return standing


@st.composite
def small_cases(draw: st.DrawFn) -> tuple[Layout, dict[chess.Square, chess.Piece]]:
    pieces = draw(st.lists(st.sampled_from(PIECES), min_size=1, max_size=6))
    where = draw(st.permutations([*FEW, *SLOTS]))
    standing = Layout(dict(zip(where, pieces, strict=False)))
    on_board = draw(st.integers(max(0, len(pieces) - len(SLOTS)), len(pieces)))
    squares = draw(st.permutations(FEW))[:on_board]
    chosen = draw(st.permutations(pieces))
    return standing, {
        p.square: piece for p, piece in zip(squares, chosen, strict=False) if p.square is not None
    }


@given(small_cases())
def test_the_formula_is_what_a_search_finds(case: tuple[Layout, dict[chess.Square, chess.Piece]]) -> None:
    standing, wanted = case
    assert Differences.between(standing, wanted).fewest == search(standing, wanted)


@given(small_cases())
def test_a_plan_needs_no_more_than_the_fewest(case: tuple[Layout, dict[chess.Square, chess.Piece]]) -> None:
    standing, wanted = case
    plan = plan_setting_up(TABLE, standing, wanted)
    assert carried_out(standing, plan).board_part() == wanted
    assert len(plan.transfers) == plan.fewest == Differences.between(standing, wanted).fewest


def played(rng: random.Random) -> chess.Board:
    """A position that a game without under-promotion has led to."""
    board = chess.Board()
    for _ in range(rng.randrange(100)):
        moves = [move for move in board.legal_moves if move.promotion is None]
        if not moves:
            break
        board.push(rng.choice(moves))
    return board


@given(st.integers(0, 10_000))
def test_from_any_game_to_any_other(seed: int) -> None:
    rng = random.Random(seed)
    standing, wanted = start_layout(TABLE, played(rng)), played(rng).piece_map()
    plan = plan_setting_up(TABLE, standing, wanted, TABLE.centre(Place("h1")))
    after = carried_out(standing, plan)
    assert after.board_part() == wanted
    assert sorted(map(str, after.values())) == sorted(map(str, standing.values()))
    assert len(plan.transfers) == plan.fewest


def test_nothing_to_do() -> None:
    plan = plan_setting_up(TABLE, START, chess.Board().piece_map())
    assert plan.transfers == ()
    assert plan.travel == plan.fewest == 0


def test_two_that_stand_for_each_other_need_three() -> None:
    board = chess.Board()
    a, b = board.remove_piece_at(chess.D1), board.remove_piece_at(chess.E1)
    assert a is not None
    assert b is not None
    board.set_piece_at(chess.E1, a)
    board.set_piece_at(chess.D1, b)
    plan = plan_setting_up(TABLE, START, board.piece_map())
    assert sorted(transfer.piece.symbol() for transfer in plan.transfers) in (
        ["K", "K", "Q"],
        ["K", "Q", "Q"],
    )


def test_of_pieces_that_are_alike_the_nearer_goes() -> None:
    knight = chess.Piece.from_symbol("N")
    standing = Layout({Place("b1"): knight, Place("g1"): knight})
    plan = plan_setting_up(TABLE, standing, {chess.C3: knight, chess.F3: knight})
    assert {str(transfer) for transfer in plan.transfers} == {"N b1-c3", "N g1-f3"}


def test_a_piece_that_is_nowhere_is_named() -> None:
    board = chess.Board("4k3/8/8/8/8/8/8/QQQQK3 w - - 0 1")
    with pytest.raises(OperatorNeededError, match="2 x white queen"):
        plan_setting_up(TABLE, START, board.piece_map())


def test_trays_without_room_are_told() -> None:
    pawn = chess.Piece.from_symbol("p")
    crowded = Layout(dict.fromkeys(TABLE.slots, pawn)).having(Place("e4"), pawn)
    with pytest.raises(OperatorNeededError, match="1 free slots too few"):
        plan_setting_up(TABLE, crowded, {})
