"""The arbiter: whole games, and what only a person can do."""

from collections.abc import Iterator
from pathlib import Path

import chess
import pytest
from tests.unit.game.arbiter_bench import FOOLS_MATE, TABLE, Bench, play, replay, watch

from kempelen.core import events
from kempelen.core.errors import ConfigError, EngineError, FitError, GameError, OperatorNeededError
from kempelen.core.places import Place
from kempelen.core.protocols import OnThinking
from kempelen.core.table import DEFAULT_TRAYS, Table, Tray
from kempelen.game.arbiter import Arbiter
from kempelen.game.journal import Journal
from kempelen.game.modes import Pairing
from kempelen.game.options import ArbiterOptions
from kempelen.game.players import Proposal, Propose
from kempelen.testing.hands import FakeHand
from kempelen.testing.players import ScriptedPlayer


@pytest.fixture
def journal(tmp_path: Path) -> Iterator[Journal]:
    with Journal(tmp_path) as journal:
        yield journal


# --- whole games --------------------------------------------------------------------------------------------


async def test_a_game_to_mate(journal: Journal) -> None:
    bench = Bench(journal, watch(FOOLS_MATE))
    assert await bench.arbiter.run() == events.GameOver("0-1", "checkmate")
    assert bench.sans == list(FOOLS_MATE)
    assert bench.world.layout == bench.log.state.layout
    assert journal.games()[0].reason == "checkmate"
    told = [type(event).__name__ for event in bench.seen if not isinstance(event, events.RobotChanged)]
    assert told[:9] == [
        "GameStarted", "TurnBegan", "EngineThinking", "MoveProposed", "TransferStarted",
        "CheckpointReached", "CheckpointReached", "CheckpointReached", "TransferDone",
    ]  # fmt: skip
    assert bench.seen[-1] == events.GameOver("0-1", "checkmate")


async def test_the_hand_is_parked_before_the_end_is_written(journal: Journal) -> None:
    """A reset after the end would let the gripper fall shut around the piece that mated."""
    bench = Bench(journal, watch(FOOLS_MATE))
    await bench.arbiter.run()
    kinds = [record.kind for _, record in journal.records(1)]
    assert kinds[-3:] == ["committed", "hand-empty", "ended"]
    assert bench.hand.parked == len(FOOLS_MATE)


async def test_parking_may_be_left_to_the_end(journal: Journal) -> None:
    bench = Bench(journal, watch(FOOLS_MATE), options=ArbiterOptions(park=False))
    await bench.arbiter.run()
    assert bench.hand.parked == 1


async def test_an_illegal_move_ends_the_run_and_not_the_game(journal: Journal) -> None:
    class Cheat(ScriptedPlayer):
        async def propose(self, board: chess.Board, on_thinking: OnThinking) -> Proposal:
            del board, on_thinking
            return Propose(chess.Move.from_uci("e1e8"))

    bench = Bench(journal, Pairing.watch(Cheat((), name="Cheat"), ScriptedPlayer(())))
    with pytest.raises(EngineError, match="Cheat proposed e1e8, which is illegal"):
        await bench.arbiter.run()
    assert not journal.games()[0].over


async def test_an_engine_that_fails_is_not_mated(journal: Journal) -> None:
    """Regression: the original took a missing move for mate."""

    class Broken(ScriptedPlayer):
        async def propose(self, board: chess.Board, on_thinking: OnThinking) -> Proposal:
            del board, on_thinking
            raise EngineError("no move")

    bench = Bench(journal, Pairing.watch(Broken(()), ScriptedPlayer(())))
    with pytest.raises(EngineError, match="no move"):
        await bench.arbiter.run()
    assert bench.log.state.ended is None


async def test_a_score_that_stops_ends_with_its_result(journal: Journal) -> None:
    bench = Bench(journal, replay("1. e4 e5 2. Nf3", "1-0"))
    assert await bench.arbiter.run() == events.GameOver("1-0", "score ends")


async def test_threefold_repetition_is_claimed_in_play_and_not_in_a_replay(journal: Journal) -> None:
    knights = "Nf3 Nf6 Ng1 Ng8 " * 3
    over = await Bench(journal, watch(knights.split())).arbiter.run()
    assert over == events.GameOver("1/2-1/2", "threefold repetition")
    bench = Bench(journal, replay(knights, "1/2-1/2"))
    assert await bench.arbiter.run() == events.GameOver("1/2-1/2", "score ends")
    assert len(bench.sans) == 12


async def test_fivefold_repetition_ends_a_replay_too(journal: Journal) -> None:
    bench = Bench(journal, replay("Nf3 Nf6 Ng1 Ng8 " * 6, "1-0"))
    assert await bench.arbiter.run() == events.GameOver("1/2-1/2", "fivefold repetition")


async def test_an_arbiter_runs_once(journal: Journal) -> None:
    bench = Bench(journal, watch(()))
    await bench.arbiter.run()
    with pytest.raises(GameError, match="once"):
        await bench.arbiter.run()
    with pytest.raises(GameError, match="not running"):
        await bench.arbiter.pause()


async def test_a_table_that_lacks_a_place_is_refused(journal: Journal) -> None:
    bench = Bench(journal, watch(()))
    narrow = Arbiter(bench.log, bench.hand, watch(()), Table(trays=DEFAULT_TRAYS[:1]))
    with pytest.raises(FitError, match="right"):
        await narrow.run()


# --- a person -----------------------------------------------------------------------------------------------


async def test_a_typed_move_is_carried_by_the_robot(journal: Journal) -> None:
    person, pairing = play(["", "e5"])
    bench = Bench(journal, pairing)
    async with bench.playing() as game:
        await person.wanted.wait()
        person.submit("e4")
        await bench.see(events.MoveCommitted, 2)
        assert [str(transfer) for transfer in bench.hand.carried] == ["P e2-e4", "p e7-e5"]
        await bench.arbiter.resign(chess.WHITE)
        assert await game == events.GameOver("0-1", "White resigns")


async def test_moves_by_the_persons_own_hand(journal: Journal) -> None:
    """Regression: the original had no tray slot for pieces that the human captured."""
    person, pairing = play(["", "d5"])
    bench = Bench(journal, pairing, options=ArbiterOptions(hands="person"), eyes=True)
    async with bench.playing() as game:
        for text in ("e4", "exd5"):
            await person.wanted.wait()
            person.submit(text)
            await bench.see(events.MoveCommitted, 1 if text == "e4" else 3)
        assert bench.person.requests == ["carry P e2-e4", "carry p d5-right5, P e4-d5"]
        assert bench.log.state.layout[Place("right5")] == chess.Piece.from_symbol("p")
        assert bench.world.layout == bench.log.state.layout
        assert bench.eyes is not None
        assert ("p d5-right5", "P e4-d5") in bench.eyes.looked
        await bench.arbiter.resign(chess.BLACK)
        assert await game == events.GameOver("1-0", "Black resigns")
    assert [str(transfer) for transfer in bench.hand.carried] == ["p d7-d5"]


async def test_own_hands_need_a_person(journal: Journal) -> None:
    with pytest.raises(ConfigError, match="need a person"):
        Bench(journal, watch(()), person=False, options=ArbiterOptions(hands="person"))


QUEENS = "4k3/P7/8/8/8/8/8/QQ2K3 w - - 0 1"


async def test_regression_a_promotion_waits_for_the_operator_and_goes_on(journal: Journal) -> None:
    bench = Bench(journal, watch(["a8=Q+"]), fen=QUEENS)
    await bench.arbiter.run()
    asked = bench.of(events.OperatorAsked)[0]
    assert isinstance(asked, events.OperatorAsked)
    assert asked.place is not None
    assert bench.person.requests == [f"supply Q {asked.place}: The trays hold no white queen."]
    assert bench.sans == ["a8=Q+"]
    assert bench.world.layout == bench.log.state.layout


async def test_without_an_operator_the_game_stops_and_can_be_resumed(journal: Journal) -> None:
    bench = Bench(journal, watch(["a8=Q+"]), fen=QUEENS, person=False)
    with pytest.raises(OperatorNeededError, match="Stand one on"):
        await bench.arbiter.run()
    assert bench.log.state.decided is not None
    again = Arbiter(journal.reopen(1), FakeHand(bench.world), watch(["a8=Q+"]), TABLE, person=bench.person)
    await again.run()
    assert again.state.layout == bench.world.layout
    assert len(again.state.board.move_stack) == 1


async def test_full_trays_are_cleared_by_the_operator(journal: Journal) -> None:
    """More pieces than slots: 30 beside the board fill the 30 slots, and one more is captured."""
    full = Table(trays=(Tray(name="left", origin=(-350.0, 25.0), rows=5, columns=6),))
    pawns = "4k3/8/8/3p4/4P3/8/8/4K3 w - - 0 1"
    bench = Bench(journal, watch(["exd5", "Kd7"]), fen=pawns, table=full)
    await bench.arbiter.run()
    assert bench.sans == ["exd5", "Kd7"]
    assert [request.split(":")[0][:8] for request in bench.person.requests] == ["remove P"]
    assert bench.world.layout == bench.log.state.layout
    assert len(bench.log.state.layout) == 33
