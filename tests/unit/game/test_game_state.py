"""Records and the state they give; outcomes; observers; PGN of a game."""

import asyncio
import logging
from pathlib import Path

import chess
import pytest

from kempelen.core import events
from kempelen.core.errors import FitError, JournalError, NotationError
from kempelen.core.places import Place, Transfer
from kempelen.core.protocols import Checkpoint, RobotState, Thinking
from kempelen.core.table import Table, Tray, start_layout
from kempelen.game.game_log import PgnKeeper, pgn_of, san_of, score_of
from kempelen.game.journal import Journal
from kempelen.game.modes import Pairing
from kempelen.game.observers import EventBus
from kempelen.game.opening import new_game
from kempelen.game.outcomes import as_result, by_score, end_of
from kempelen.game.pgn import parse_game
from kempelen.game.records import (
    Begun,
    Committed,
    Ended,
    HandEmpty,
    Helped,
    Intended,
    Interrupted,
    LayoutChanged,
    ModeSwapped,
    OperatorNeeded,
    PairingSpec,
    Paused,
    PlayerSpec,
    Purpose,
    Record,
    Resumed,
    Step,
    TableChanged,
    TakebackAsked,
    from_json,
    to_json,
)
from kempelen.game.state import GameState
from kempelen.game.transfers import Crowded, Missing
from kempelen.testing.players import ScriptedPlayer

PAWN = chess.Piece.from_symbol("P")
QUEEN = chess.Piece.from_symbol("Q")
E4 = Transfer(PAWN, Place("e2"), Place("e4"))
PAIRING = PairingSpec(
    mode="watch", white=PlayerSpec(kind="engine", name="A"), black=PlayerSpec(kind="engine", name="B")
)
BEGUN = Begun(
    headers={"White": "A", "Black": "B"}, pairing=PAIRING, layout=start_layout(Table(), chess.Board())
)
INTENT = Intended(purpose=Purpose.MOVE, ply=1, uci="e2e4", transfers=(E4,))
COMMIT = Committed(purpose=Purpose.MOVE, ply=1, uci="e2e4", san="e4")
ASKED = OperatorNeeded(
    purpose=Purpose.MOVE, ply=1, uci="e2e4", need="supply", piece=QUEEN, place=Place("left3")
)


def state_after(*records: Record) -> GameState:
    state = GameState.begin(BEGUN)
    for record in records:
        state = state.after(record)
    return state


def step(checkpoint: Checkpoint, index: int = 0) -> Step:
    return Step(index=index, checkpoint=checkpoint)


@pytest.mark.parametrize(
    "record",
    [
        BEGUN, INTENT, COMMIT, ASKED, step(Checkpoint.CARRYING), HandEmpty(), Interrupted(why="x"), Paused(),
        Resumed(), TakebackAsked(plies=3), ModeSwapped(pairing=PAIRING), TableChanged(table="d"),
        LayoutChanged(place=Place("left3"), piece=None), Ended(result="1-0", reason="checkmate"),
    ],
    ids=lambda record: record.kind,
)  # fmt: skip
def test_records_survive_as_text(record: Record) -> None:
    assert from_json(to_json(record)) == record


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "Invalid JSON"),
        ('{"kind": "paused", "colour": 1}', "colour"),
        ('{"kind": "ended", "result": "2-0", "reason": ""}', "result"),
        ('{"kind": "layout-changed", "place": "z9x"}', "no place"),
        ('{"kind": "layout-changed", "place": 7}', "place"),
        (
            '{"kind": "intended", "purpose": "move", "ply": 1, "uci": "e2e4", "transfers": ["P e2"]}',
            "transfers",
        ),
        ('{"kind": "intended", "purpose": "move", "ply": 1, "uci": "e2e4", "transfers": [7]}', "transfers"),
        ('{"kind": "begun", "headers": {}, "pairing": {}, "layout": {"e4": "x"}}', "layout"),
    ],
)
def test_text_that_is_no_record(text: str, why: str) -> None:
    with pytest.raises(JournalError, match=why):
        from_json(text)


def test_what_the_operator_is_asked() -> None:
    assert ASKED.request == Missing(QUEEN, Place("left3"))
    assert ASKED.model_copy(update={"need": "remove"}).request == Crowded(QUEEN, Place("left3"))


def test_the_life_of_a_move_in_records() -> None:
    state = state_after(INTENT, step(Checkpoint.GRIPPING), step(Checkpoint.CARRYING))
    assert state.pending is not None
    assert state.pending.carrying
    assert state.layout[Place("e2")] == PAWN  # a held piece counts where it came from
    state = state.after(step(Checkpoint.RELEASED))
    assert state.layout[Place("e4")] == PAWN
    assert state.around == E4
    state = state.after(COMMIT)
    assert (state.plies, state.pending, state.around) == (1, None, E4)
    assert state.after(HandEmpty()).around is None


def test_interruptions_are_forgotten_with_the_next_step() -> None:
    state = state_after(INTENT, step(Checkpoint.GRIPPING), Interrupted())
    assert state.pending is not None
    assert state.pending.interrupted
    again = state.after(step(Checkpoint.GRIPPING)).pending
    assert again is not None
    assert not again.interrupted


def test_help_is_counted() -> None:
    state = state_after(Helped(how="brought a queen"), Helped())
    assert state.helps == 2
    assert from_json(to_json(Helped(how="x"))) == Helped(how="x")


def test_the_operators_changes() -> None:
    state = state_after(ASKED)
    assert state.needed == state.decided == ASKED
    state = state.after(LayoutChanged(place=Place("left3"), piece=None))
    assert Place("left3") not in state.layout
    state = state.after(LayoutChanged(place=Place("left3"), piece=QUEEN))
    assert state.layout[Place("left3")] == QUEEN
    assert (state.needed, state.decided) == (None, ASKED)
    assert state.after(INTENT).decided is None


@pytest.mark.parametrize(
    ("records", "why"),
    [
        ([BEGUN], "'begun' follows ply 0"),
        ([COMMIT], "no move in hand|where there is none"),
        ([step(Checkpoint.GRIPPING)], "where there is none"),
        ([INTENT, step(Checkpoint.GRIPPING, 1)], "names transfer 1, at hand is 0"),
        ([INTENT, step(Checkpoint.RELEASED), step(Checkpoint.GRIPPING, 1)], "names transfer 1"),
        ([INTENT, INTENT], "while another one is in hand"),
        ([INTENT, Committed(purpose=Purpose.MOVE, ply=1, uci="e2e5", san="e5")], "does not fit"),
        ([INTENT, Committed(purpose=Purpose.TAKEBACK, ply=1, uci="e2e4", san="e4")], "does not fit"),
        (
            [LayoutChanged(place=Place("a"), piece=None), Ended(result="*", reason="x"), Paused()],
            "follows the end",
        ),
    ],
)
def test_records_that_cannot_follow(records: list[Record], why: str) -> None:
    with pytest.raises(JournalError, match=why):
        state_after(*records)


def test_an_unreadable_start() -> None:
    with pytest.raises(JournalError, match="unreadable position"):
        GameState.begin(BEGUN.model_copy(update={"start_fen": "nonsense"}))


# --- outcomes -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fen", "result", "reason"),
    [
        ("rnb1kbnr/pppp1ppp/8/4p3/6Pq/5P2/PPPPP2P/RNBQKBNR w KQkq - 1 3", "0-1", "checkmate"),
        ("R5k1/5ppp/8/8/8/8/8/4K3 b - - 0 1", "1-0", "checkmate"),
        ("7k/5Q2/6K1/8/8/8/8/8 b - - 0 1", "1/2-1/2", "stalemate"),
        ("4k3/8/8/8/8/8/8/4KN2 w - - 0 1", "1/2-1/2", "insufficient material"),
        ("4k3/8/8/8/8/8/4R3/4K3 w - - 150 99", "1/2-1/2", "75 moves without capture or pawn move"),
        ("4k3/8/8/8/8/8/4R3/4K3 b - - 100 99", "1/2-1/2", "50 moves without capture or pawn move"),
    ],
)
def test_how_games_end(fen: str, result: str, reason: str) -> None:
    assert end_of(chess.Board(fen), claim_draws=True) == Ended.model_validate(
        {"result": result, "reason": reason}
    )


def test_claims_are_left_to_the_score_of_a_replay() -> None:
    assert end_of(chess.Board("4k3/8/8/8/8/8/4R3/4K3 b - - 100 99"), claim_draws=False) is None
    assert end_of(chess.Board(), claim_draws=True) is None


def test_a_strange_result_counts_as_none() -> None:
    assert as_result("1-0") == "1-0"
    assert by_score("1:0").result == "*"


# --- observers ----------------------------------------------------------------------------------------------


async def test_readers_and_listeners_hear_everything_in_order() -> None:
    bus = EventBus()
    heard: list[events.Event] = []
    end = bus.listen(heard.append)
    with bus.reader() as reader:
        bus.emit(events.Paused())
        bus.emit(events.Resumed())
        end()
        bus.emit(events.Paused())
        bus.close()
        assert [event async for event in reader] == [events.Paused(), events.Resumed(), events.Paused()]
    assert heard == [events.Paused(), events.Resumed()]


async def test_a_slow_reader_keeps_the_newest_and_counts_what_it_missed() -> None:
    bus = EventBus()
    with bus.reader(kept=3) as reader:
        for ply in range(10):
            bus.emit(events.MoveProposed(ply, chess.WHITE, "", "", ()))
        bus.close()
        left = [event.ply async for event in reader if isinstance(event, events.MoveProposed)]
    assert left == [7, 8, 9]
    assert reader.missed == 7


async def test_thoughts_replace_each_other() -> None:
    bus = EventBus()
    with bus.reader() as reader:
        for depth in range(5):
            bus.emit(events.EngineThinking(chess.WHITE, Thinking(depth=depth)))
        bus.emit(events.RobotChanged(RobotState()))
        bus.emit(events.EngineThinking(chess.WHITE, Thinking(depth=9)))
        bus.close()
        depths = [event.thinking.depth async for event in reader if isinstance(event, events.EngineThinking)]
    assert depths == [4, 9]
    assert reader.missed == 0


async def test_a_reader_waits() -> None:
    bus = EventBus()
    with bus.reader() as reader:
        coming = asyncio.ensure_future(anext(reader))
        await asyncio.sleep(0)
        bus.emit(events.Paused())
        assert await coming == events.Paused()
        bus.close()
        with pytest.raises(StopAsyncIteration):
            await anext(reader)


def test_a_listener_that_fails_is_logged_and_harms_nobody(caplog: pytest.LogCaptureFixture) -> None:
    bus = EventBus()
    heard: list[events.Event] = []

    def fail(event: events.Event) -> None:
        raise ValueError(event)

    bus.listen(fail)
    bus.listen(heard.append)
    with caplog.at_level(logging.ERROR):
        bus.emit(events.Paused())
    assert heard == [events.Paused()]
    assert "An observer failed on Paused" in caplog.text


# --- a game as people keep it -------------------------------------------------------------------------------


def test_pgn_has_full_headers_and_the_reason(tmp_path: Path) -> None:
    pairing = Pairing.watch(ScriptedPlayer((), name="A"), ScriptedPlayer((), name="B"))
    with Journal(tmp_path) as journal:
        log = new_game(journal, pairing, Table(), headers={"Event": "Test match"})
        for record in (INTENT, step(Checkpoint.RELEASED), COMMIT):
            log.write(record)
        running = parse_game(pgn_of(log.state))
        assert (running.result, running.headers["Termination"]) == ("*", "unterminated")
        log.write(Ended(result="1-0", reason="Black resigns"))
        text = pgn_of(log.state)
    score = parse_game(text)
    assert score.moves == (chess.Move.from_uci("e2e4"),)
    assert score.result == "1-0"
    assert {"Event", "Site", "Date", "Round", "White", "Black", "Result", "UTCDate", "UTCTime"} <= set(
        score.headers
    )
    assert score.headers["Event"] == "Test match"
    assert score.headers["Termination"] == "normal"
    assert "{ Black resigns } 1-0" in text
    assert san_of(log.state) == "1. e4"


def test_players_who_took_over_stand_behind_those_before_them() -> None:
    swapped = PAIRING.model_copy(update={"white": PlayerSpec(kind="person", name="Anna")})
    state = state_after(ModeSwapped(pairing=swapped), ModeSwapped(pairing=swapped))
    assert score_of(state).headers["White"] == "A / Anna"
    assert score_of(state).headers["Black"] == "B"


def test_the_pgn_file_follows_the_game(tmp_path: Path) -> None:
    states = [state_after(), state_after(INTENT, step(Checkpoint.RELEASED), COMMIT)]
    keeper = PgnKeeper(tmp_path / "game.pgn", lambda: states[0])
    keeper(events.Paused())
    assert not keeper.path.exists()
    keeper(events.GameOver("*", "x"))
    assert "e4" not in keeper.path.read_text()
    states.pop(0)
    keeper(events.MoveCommitted(1, chess.WHITE, "e4", "e2e4", "", BEGUN.layout))
    assert "1. e4 *" in keeper.path.read_text()


@pytest.mark.parametrize(
    ("fen", "trays", "error"),
    [("8/8/8/8/8/8/8/8 w - - 0 1", None, NotationError), (chess.STARTING_FEN[:20], None, NotationError),
     ("4k3/8/8/8/8/8/8/4K3 w - - 0 1", (Tray(name="left", origin=(-90, 25), rows=4),), FitError)],
)  # fmt: skip
def test_games_that_cannot_begin(
    tmp_path: Path, fen: str, trays: tuple[Tray, ...] | None, error: type[Exception]
) -> None:
    pairing = Pairing.watch(ScriptedPlayer(()), ScriptedPlayer(()))
    table = Table(trays=trays) if trays else Table()
    with Journal(tmp_path) as journal:
        with pytest.raises(error):
            new_game(journal, pairing, table, start_fen=fen)
        assert journal.games() == []
