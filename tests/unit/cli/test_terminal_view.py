"""The live view: typing while the picture updates, completion, leaving; the terminal restored."""

import asyncio
import io
import json
import os
import pty
import select
import signal
import subprocess
import sys
import termios
from collections.abc import AsyncIterator, Iterator
from importlib.resources import files
from pathlib import Path

import chess
import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.completion import CompleteEvent
from prompt_toolkit.document import Document
from prompt_toolkit.input import PipeInput, create_pipe_input
from prompt_toolkit.output import DummyOutput
from rich.console import Console

from kempelen.cli.screen import GameScreen
from kempelen.cli.terminal import LEAVE, MoveCompleter, TerminalView, san_moves
from kempelen.core import events
from kempelen.core.protocols import RobotState
from kempelen.game.journal import JournalReader

BEGUN = "Game 1: Morphy, Paul against"
_PATIENCE_S = 60.0
FAMOUS = Path(str(files("kempelen") / "data" / "famous.pgn"))


class Game:
    """Nothing happens in it."""

    board = chess.Board()
    robot = RobotState()
    length = None
    seconds_left = None


@pytest.fixture
def keyboard() -> Iterator[PipeInput]:
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        yield pipe


def make_view() -> TerminalView:
    return TerminalView(
        GameScreen(Game()),
        prompt=lambda: "Your move, White: ",
        moves=lambda: san_moves(chess.Board()),
        commands=("pause", "mode play"),
        console=Console(file=io.StringIO(), force_terminal=True, color_system="256"),
    )


async def take(lines: AsyncIterator[str], count: int) -> list[str]:
    async with asyncio.timeout(20):
        return [await anext(lines) for _ in range(count)]


async def test_lines_are_handed_out_as_they_are_entered(keyboard: PipeInput) -> None:
    view = make_view()
    async with view.live():
        keyboard.send_text(" Nf3 \rpause\r")
        assert await take(view.typed(), 2) == ["Nf3", "pause"]


@pytest.mark.parametrize("key", ["\x03", "\x04"])
async def test_control_c_and_control_d_leave(keyboard: PipeInput, key: str) -> None:
    view = make_view()
    async with view.live():
        keyboard.send_text(f"half a mo{key}")
        assert await take(view.typed(), 1) == [LEAVE]


async def test_tab_completes_a_move(keyboard: PipeInput) -> None:
    view = make_view()
    async with view.live():
        offered = asyncio.Event()
        view._application.current_buffer.on_completions_changed += lambda _: offered.set()
        keyboard.send_text("nf")
        async with asyncio.timeout(20):
            await offered.wait()
        keyboard.send_text("\t\r")
        assert await take(view.typed(), 1) == ["Nf3"]


async def test_events_reach_the_picture_and_messages_too(keyboard: PipeInput) -> None:
    del keyboard
    view = make_view()

    async def stream() -> AsyncIterator[events.Event]:
        yield events.GameOver("1-0", "checkmate")

    async with view.live():
        await view.show(stream())
        view.say("well played")
    assert view.screen.messages == ["Game over: 1-0, checkmate.", "well played"]
    assert "well played" in view._picture()


def completions(typed: str) -> list[str]:
    completer = MoveCompleter(lambda: san_moves(chess.Board()), ("pause", "mode play"))
    return [c.text for c in completer.get_completions(Document(typed), CompleteEvent())]


def test_moves_and_commands_complete_whatever_the_case() -> None:
    assert completions("N") == ["Na3", "Nc3", "Nf3", "Nh3"]
    assert completions("nf") == ["Nf3"]
    assert completions("p") == ["pause"]
    assert completions("Nf3") == []
    assert completions("") == []


class OnTerminal:
    """`kempelen` on a pseudo-terminal of its own."""

    def __init__(self, *arguments: str) -> None:
        self.ours, theirs = pty.openpty()
        termios.tcsetwinsize(theirs, (24, 80))
        self.before = termios.tcgetattr(theirs)
        environment = os.environ | {"TERM": "xterm-256color", "PROMPT_TOOLKIT_NO_CPR": "1"}
        environment.pop("NO_COLOR", None)
        self.process = subprocess.Popen(
            [sys.executable, "-m", "kempelen", *arguments],
            stdin=theirs, stdout=theirs, stderr=theirs, env=environment, start_new_session=True,
        )  # fmt: skip
        self._theirs = theirs
        self.seen = ""

    def until(self, text: str) -> None:
        """Wait for a text; only what is drawn for the first time comes in one piece."""
        while text not in self.seen:
            ready, _, _ = select.select([self.ours], [], [], _PATIENCE_S)
            assert ready, self.seen
            self.seen += os.read(self.ours, 65536).decode(errors="replace")

    def end(self) -> int:
        """Read on until the program has ended; our own end of its terminal keeps it readable."""
        while (code := self.process.poll()) is None or select.select([self.ours], [], [], 0)[0]:
            if select.select([self.ours], [], [], 0.02)[0]:
                self.seen += os.read(self.ours, 65536).decode(errors="replace")
        return code

    def is_restored(self) -> bool:
        return termios.tcgetattr(self._theirs) == self.before

    def vanish(self) -> int:
        """The window is closed."""
        os.close(self.ours)
        os.close(self._theirs)
        self.ours = self._theirs = -1
        return self.process.wait(_PATIENCE_S)

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        for descriptor in (self.ours, self._theirs):
            if descriptor >= 0:
                os.close(descriptor)


@pytest.fixture
def replaying(tmp_path: Path) -> Iterator[OnTerminal]:
    options = ("--speed", "4", "--data-dir", str(tmp_path), "--report", str(tmp_path / "report.json"))
    terminal = OnTerminal("replay", str(FAMOUS), *options)
    yield terminal
    terminal.close()


@pytest.mark.physics
def test_control_c_on_a_terminal_restores_it_and_says_how_to_go_on(replaying: OnTerminal) -> None:
    replaying.until(BEGUN)
    assert not replaying.is_restored()  # raw, while the picture is on
    os.write(replaying.ours, b"\x03")
    assert replaying.end() == 130
    assert replaying.is_restored()
    assert "kempelen resume 1" in replaying.seen
    assert "Traceback" not in replaying.seen


@pytest.mark.physics
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_signals_end_a_game_as_control_c_does(replaying: OnTerminal, number: signal.Signals) -> None:
    replaying.until(BEGUN)
    replaying.process.send_signal(number)
    assert replaying.end() == 128 + number
    assert replaying.is_restored()
    assert "kempelen resume 1" in replaying.seen
    assert "Traceback" not in replaying.seen


@pytest.mark.physics
def test_a_window_that_is_closed_leaves_the_game_resumable(replaying: OnTerminal, tmp_path: Path) -> None:
    replaying.until(BEGUN)
    assert replaying.vanish() in {130, 128 + signal.SIGHUP}  # whichever is noticed first
    assert json.loads((tmp_path / "report.json").read_text())["reason"] == "interrupted"
    with JournalReader(tmp_path) as journal:
        assert journal.latest(unfinished=True) == 1
