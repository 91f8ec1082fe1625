"""What is shown of a game, in values and in words."""

import asyncio
from pathlib import Path

import chess
import pytest
from tests.unit.server.server_bench import station_in

from kempelen.app.discreet import without_paths
from kempelen.app.station_types import Change, Prompt, StationFault
from kempelen.core import events
from kempelen.core.pieces import KINDS
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Checkpoint, RobotPhase, RobotState, Thinking
from kempelen.server.bridge import Bridge, told
from kempelen.server.feeds import kept_up
from kempelen.server.hub import Hub
from kempelen.server.moves import MoveBook
from kempelen.server.topics import ActivityView, RobotView, StationView
from kempelen.server.views import _fault, prompt_view, robot_view, thinking_view

KNIGHT = Transfer(chess.Piece.from_symbol("N"), Place("g1"), Place("f3"))


def test_moves_are_worked_out_once_and_taken_back() -> None:
    book, board = MoveBook(), chess.Board()
    for san in ("e4", "Nf6", "e5", "d5", "exd6", "Qxd6"):
        board.push_san(san)
    moves = book.moves(board)
    assert [move.san for move in moves] == ["e4", "Nf6", "e5", "d5", "exd6", "Qxd6"]
    assert moves[-1].fen == board.fen()
    assert book.captured(board) == {"white": "P", "black": "p"}  # en passant, and the pawn that did it
    board.pop()
    board.push_san("cxd6")
    again = book.moves(board)
    assert again[:5] == moves[:5]
    assert again[4] is moves[4]
    assert again[5].san == "cxd6"
    other = chess.Board("4k3/8/8/8/8/8/8/4K2R w K - 0 1")
    other.push_san("O-O")
    assert [move.san for move in book.moves(other)] == ["O-O"]


def test_thoughts_are_shown_from_whites_side() -> None:
    board = chess.Board("4k3/8/8/8/8/8/4q3/4K3 b - - 0 1")
    line = (chess.Move.from_uci("e8d7"), chess.Move.from_uci("a1a2"))
    view = thinking_view(chess.BLACK, Thinking(depth=9, centipawns=120, line=line), board)
    assert (view.colour, view.centipawns, view.line) == ("black", -120, ("Kd7+",))
    assert thinking_view(chess.BLACK, Thinking(mate=2), board).mate == -2


def test_prompts_and_faults() -> None:
    board = chess.Board()
    prompt = Prompt("1", "which_move", "Which?", Place("e4"), chess.Piece.from_symbol("p"), ("e2e4", "e7e5"))
    view = prompt_view(prompt, board)
    assert (view.square, view.piece) == ("e4", "p")
    assert [candidate.san for candidate in view.candidates] == ["e4", "e7e5"]
    assert prompt_view(Prompt("2", "do", "Put it back", Place("left3")), None).square is None
    assert "/home" not in _fault(StationFault("Broken", "See /home/anna/kempelen/journal.sqlite3.")).text


def test_positions_are_those_reported() -> None:
    state = RobotState(RobotPhase.IDLE, homed=True, reported_position=(1.23456, 2, 3))
    assert robot_view(state).position == (1.23, 2, 3)
    assert robot_view(RobotState()).position is None


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("The journal /home/anna/games/journal.sqlite3 is in use.", "The journal journal.sqlite3 is in use."),
        ("There is no port /dev/ttyUSB0.", "There is no port /dev/ttyUSB0."),
        ("Open http://127.0.0.1:8420/setup now.", "Open http://127.0.0.1:8420/setup now."),
        ("1/2-1/2 by agreement; speed 3 mm/s", "1/2-1/2 by agreement; speed 3 mm/s"),
    ],
)
def test_paths_are_nobodys_business(text: str, plain: str) -> None:
    assert without_paths(text) == plain


def test_an_event_in_plain_values() -> None:
    proposed = events.MoveProposed(1, chess.BLACK, "Nf6", "g8f6", (KNIGHT,), number=1)
    assert told(proposed) == {
        "ply": 1, "colour": "black", "san": "Nf6", "uci": "g8f6",
        "by_hand": False, "number": 1, "takeback": False,
    }  # fmt: skip
    asked = events.OperatorAsked("Put it on f3", chess.Piece(KINDS[0], chess.WHITE), Place("f3"))
    assert told(asked) == {"text": "Put it on f3", "piece": "K", "place": "f3"}


async def test_what_happens_becomes_topics_and_words(tmp_path: Path) -> None:
    station, hub = station_in(tmp_path), Hub("epoch")
    async with station:
        with Bridge(station, hub):
            assert hub.get("station") == StationView()
            assert hub.get("robot") == RobotView()
            station.events.emit(events.TransferStarted(KNIGHT, 1, 2))
            station.events.emit(events.CheckpointReached(KNIGHT, Checkpoint.CARRYING))
            assert hub.get("activity") == ActivityView(
                kind="carrying", piece="N", source="g1", target="f3", number=1, count=2
            )
            committed = events.MoveCommitted(1, chess.WHITE, "Nf3", "g1f3", chess.STARTING_FEN, Layout({}))
            station.events.emit(committed)
            station.events.emit(events.GameOver("1-0", "checkmate"))
            assert hub.get("activity") is None
            said = hub.said.after(0)
            assert "White has played Nf3." in said[0]
            assert "checkmate" in said[1]
            station.busy = "Connecting …"
            station._tell(Change.STATION)
            await asyncio.sleep(0)
            shown = hub.get("station")
            assert isinstance(shown, StationView)
            assert shown.busy == "Connecting …"
        station._tell(Change.STATION)  # nobody listens any more


async def test_a_look_that_fails_is_not_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kempelen.server.feeds._AGAIN_S", 0.0)
    looks, seen = 0, asyncio.Event()

    class Feed:
        async def run(self) -> None:
            nonlocal looks
            looks += 1
            if looks < 3:
                raise ValueError("a bad look")
            seen.set()
            await asyncio.Event().wait()

    task = asyncio.ensure_future(kept_up(Feed()))
    async with asyncio.timeout(5):
        await seen.wait()
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    assert looks == 3
