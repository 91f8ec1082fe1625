"""What a report says of a game: taken between moves, nothing of it seen by the players."""

from types import SimpleNamespace
from typing import Any, cast

import chess
import pytest

from kempelen.app.measure import MeasuredPlayer, Measurements
from kempelen.core import events
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import TransferReport
from kempelen.core.table import Table, start_layout
from kempelen.game.arbiter import Arbiter
from kempelen.game.players import PersonPlayer, Propose
from kempelen.twin.client import TwinControl

TABLE = Table()
BOARD = chess.Board()
START = start_layout(TABLE, BOARD)
E4 = Transfer(chess.Piece.from_symbol("P"), Place("e2"), Place("e4"))
OPENING_S = TABLE.gripper.open_seconds


class Twin:
    """Ground truth of a layout; every look takes half a second of the wall's time."""

    def __init__(self) -> None:
        self.layout: Layout = START
        self.busy = self.wall = 0.0

    async def ask(self, op: str) -> dict[str, Any]:
        assert op == "settle"
        self.wall += 0.5
        pieces = []
        for place, piece in self.layout.items():
            x, y, z = TABLE.centre(place)
            pieces.append(
                {
                    "id": f"{place}", "kind": piece.symbol().upper(), "white": piece.color, "x": x + 0.2,
                    "y": y, "z": z, "tilt": 0.0,
                }
            )  # fmt: skip
        return {"pieces": pieces, "busy_s": self.busy, "wall_s": self.wall}


def proposed(*, by_hand: bool = False) -> events.MoveProposed:
    return events.MoveProposed(1, chess.WHITE, "e4", "e2e4", (E4,), by_hand=by_hand)


def carried(
    layout: Layout, seconds: float = 3.0, carry: float = 2.0, bound: float = 1.5
) -> events.TransferDone:
    return events.TransferDone(E4, layout, TransferReport(E4, seconds, seconds, bound, carry))


def arbiter_of(layout: Layout, helps: int = 0) -> Arbiter:
    begun = SimpleNamespace(layout=START)
    state = SimpleNamespace(board=BOARD, layout=layout, plies=1, helps=helps, begun=begun)
    return cast("Arbiter", SimpleNamespace(state=state, game=5))


async def one_move(*, by_hand: bool = False) -> tuple[Measurements, Twin]:
    twin = Twin()
    measured = Measurements(TABLE, cast("TwinControl", twin))
    await measured.sample()
    measured.listen(proposed(by_hand=by_hand))
    twin.layout, twin.busy = START.after(E4), 4.0
    measured.listen(carried(twin.layout))
    await measured.sample()
    return measured, twin


async def test_a_move_on_the_twin() -> None:
    measured, twin = await one_move()
    assert measured.errors == [pytest.approx(0.2)]
    assert [(move.san, move.transfers, move.seconds) for move in measured.moves] == [("e4", 1, 4.0)]
    assert measured.twin_seconds == (4.0, 0.5)
    report = measured.report(arbiter_of(twin.layout, helps=2), events.GameOver("1-0", "mate"), wall=9.0)
    assert (report.result, report.reason, report.game, report.interventions) == ("1-0", "mate", 5, 2)
    assert (report.transfers, report.collisions, report.disagreements) == (1, 0, [])
    assert report.placement is not None
    assert (report.placement.n, report.placement.max_mm) == (1, 0.2)
    assert report.standing_max_mm == pytest.approx(0.2)
    assert (report.robot_time_s, report.wall_time_s) == (4.0, 9.0)
    assert report.robot_time_over_bound == pytest.approx((2.0 - OPENING_S) / 1.5, abs=1e-4)


async def test_a_move_by_hand_is_not_the_robots() -> None:
    measured, _ = await one_move(by_hand=True)
    assert (measured.transfers, measured.errors, measured.moves) == (0, [], [])


async def test_an_interrupted_game_is_not_compared_with_a_table_in_between() -> None:
    measured, _ = await one_move()
    report = measured.report(arbiter_of(START), None, wall=1.0)
    assert (report.result, report.reason) == ("*", "interrupted")
    assert report.placement is not None
    assert report.disagreements == []
    assert report.standing_max_mm is None


async def test_a_machine_has_no_ground_truth_but_its_own_clock() -> None:
    measured = Measurements(TABLE, None)
    await measured.sample()
    measured.listen(proposed())
    measured.listen(carried(START))
    measured.listen(carried(START, seconds=5.0, carry=4.0, bound=2.5))
    report = measured.report(arbiter_of(START), events.GameOver("1-0", "mate"), wall=20.0)
    assert report.placement is None
    assert report.standing_max_mm is None
    assert report.robot_time_s == 8.0
    assert report.robot_time_over_bound == pytest.approx((6.0 - 2 * OPENING_S) / 4.0, abs=1e-4)


async def test_nothing_measured_has_no_ratio() -> None:
    report = Measurements(TABLE, None).report(arbiter_of(START), None, wall=0.0)
    assert (report.robot_time_over_bound, report.robot_time_s) == (0.0, 0.0)


async def test_the_table_is_looked_at_before_each_turn_and_the_player_sees_nothing_of_it() -> None:
    twin = Twin()
    measured = Measurements(TABLE, cast("TwinControl", twin))
    person = PersonPlayer("Ada")
    player = MeasuredPlayer(person, measured)
    assert player.spec == person.spec

    class Typing(PersonPlayer):
        async def propose(self, board: chess.Board, on_thinking: Any) -> Propose:
            del on_thinking
            return Propose(next(iter(board.legal_moves)))

        async def answer_draw(self, board: chess.Board) -> bool:
            return board.turn

    player = MeasuredPlayer(Typing("Ada"), measured)
    proposal = await player.propose(BOARD.copy(), lambda _: None)
    assert isinstance(proposal, Propose)
    assert twin.wall == 0.5
    assert await player.answer_draw(BOARD)
