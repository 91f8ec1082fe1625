"""The live view of a terminal: board, log, robot and engine above; one input line below."""

import asyncio
import io
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager

import chess
from prompt_toolkit.application import Application
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.formatted_text import ANSI
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import HSplit, Layout, Window
from prompt_toolkit.layout.controls import FormattedTextControl
from prompt_toolkit.widgets import TextArea
from rich.console import Console
from rich.text import Text

from kempelen.cli.board import game_picture
from kempelen.cli.narrate import sentence, thinking_text
from kempelen.cli.plain import END_OF_INPUT
from kempelen.core import events
from kempelen.core.protocols import RobotState

_MESSAGES = 3
_ROWS = 11


class MoveCompleter(Completer):
    """Legal moves in SAN, then the commands."""

    def __init__(self, board: Callable[[], chess.Board], commands: Iterable[str]) -> None:
        self._board = board
        self._commands = tuple(commands)

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
        """What may follow what has been typed."""
        del complete_event
        typed = document.text_before_cursor
        board = self._board()
        moves = sorted(board.san(move) for move in board.legal_moves)
        for word in [*moves, *self._commands]:
            if typed and word.startswith(typed):
                yield Completion(word, start_position=-len(typed))


class TerminalView:
    """A live picture of the game, and the lines typed under it.

    Args:
        board: Gives the game's board.
        robot: Gives the robot's latest state.
        commands: Words offered for completion.
        flipped: Whether Black sits at the bottom.
    """

    def __init__(
        self,
        board: Callable[[], chess.Board],
        robot: Callable[[], RobotState],
        commands: Iterable[str],
        *,
        flipped: bool = False,
    ) -> None:
        self._board = board
        self._robot = robot
        self._flipped = flipped
        self._doing = ""
        self._thinking = ""
        self._messages: list[str] = []
        self._lines: asyncio.Queue[str] = asyncio.Queue()
        self._application = self._make_application(MoveCompleter(board, commands))

    def _make_application(self, completer: Completer) -> Application[None]:
        keys = KeyBindings()

        @keys.add("c-c")
        @keys.add("c-d")
        def _quit(event: KeyPressEvent) -> None:
            self._lines.put_nowait(END_OF_INPUT)
            event.app.exit()

        picture = Window(
            FormattedTextControl(lambda: ANSI(self._picture())), height=_ROWS, dont_extend_height=True
        )
        field = TextArea(
            height=1, prompt="> ", multiline=False, completer=completer, complete_while_typing=False,
            accept_handler=self._accept,
        )  # fmt: skip
        return Application(
            Layout(HSplit([picture, field]), focused_element=field), key_bindings=keys, refresh_interval=0.25
        )

    def _accept(self, buffer: Buffer) -> bool:
        self._lines.put_nowait(buffer.text.strip())
        return False

    def _picture(self) -> str:
        console = Console(file=io.StringIO(), force_terminal=True, color_system="256", width=100)
        console.print(game_picture(self._board(), self._status(), flipped=self._flipped), end="")
        text: str = console.file.getvalue()  # type: ignore[attr-defined]
        return text

    def _status(self) -> Text:
        state = self._robot()
        where = " ".join(
            f"{axis}{value:.1f}" for axis, value in zip("XYZ", state.reported_position or (), strict=False)
        )
        text = Text(f"robot    {state.phase} {where}\n")
        text.append(f"now      {self._doing}\n")
        text.append(f"engine   {self._thinking}\n", style="dim")
        text.append("\n".join(self._messages), style="yellow")
        return text

    def say(self, text: str) -> None:
        """A line for the person."""
        self._messages = [*self._messages, text][-_MESSAGES:]
        self._application.invalidate()

    async def show(self, stream: AsyncIterator[events.Event]) -> None:
        """Until the stream ends."""
        async for event in stream:
            self._note(event)
            self._application.invalidate()

    def _note(self, event: events.Event) -> None:
        match event:
            case events.EngineThinking():
                self._thinking = thinking_text(event.thinking)
            case events.TurnBegan():
                self._doing = f"{'White' if event.colour else 'Black'} to move ({event.player})"
            case events.CheckpointReached() | events.MoveProposed():
                self._doing = sentence(event).strip()
            case events.RobotChanged() if not event.state.message:
                pass
            case _:
                if text := sentence(event).strip():
                    self.say(text)

    async def typed(self) -> AsyncIterator[str]:
        """Lines as they are entered; `END_OF_INPUT` when the person leaves."""
        while (line := await self._lines.get()) != END_OF_INPUT:
            yield line
        yield END_OF_INPUT

    @asynccontextmanager
    async def live(self) -> AsyncIterator[None]:
        """The picture is on the screen inside of this."""
        task = asyncio.create_task(self._application.run_async(handle_sigint=False))
        try:
            yield
        finally:
            if self._application.is_running:
                self._application.exit()
            await task
