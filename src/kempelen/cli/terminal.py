"""The live view of a terminal: the picture above, one input line with completion below."""

import asyncio
import io
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from contextlib import asynccontextmanager

import chess
from prompt_toolkit.application import Application
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.filters import has_completions
from prompt_toolkit.formatted_text import ANSI
from prompt_toolkit.history import InMemoryHistory
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import ConditionalContainer, HSplit, Layout, Window
from prompt_toolkit.layout.controls import FormattedTextControl
from prompt_toolkit.styles import Style
from prompt_toolkit.widgets import CompletionsToolbar, TextArea
from rich.console import Console

from kempelen.cli.board import HEIGHT
from kempelen.cli.screen import GameScreen, rows
from kempelen.core import events

LEAVE = "quit"
MIN_COLUMNS, MIN_ROWS = 40, HEIGHT + 7
_REFRESH_S = 0.2
_STYLE = Style.from_dict({"prompt": "bold", "completion-toolbar.completion.current": "reverse"})


class MoveCompleter(Completer):
    """Legal moves in SAN where a person is to move, then the commands."""

    def __init__(self, moves: Callable[[], Iterable[str]], commands: Iterable[str]) -> None:
        self._moves = moves
        self._commands = tuple(commands)

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
        """What may follow what has been typed."""
        del complete_event
        typed = document.text_before_cursor
        for word in [*self._moves(), *self._commands]:
            if typed and word.lower().startswith(typed.lower()) and word != typed:
                yield Completion(word, start_position=-len(typed))


def san_moves(board: chess.Board) -> Sequence[str]:
    """All legal moves, sorted."""
    return sorted(board.san(move) for move in board.legal_moves)


class TerminalView:
    """The live picture of a game, and the lines typed under it.

    Args:
        screen: What is shown.
        prompt: What stands before the input.
        moves: Moves offered for completion.
        commands: Words offered for completion.
        console: For what the terminal can show.
    """

    def __init__(
        self,
        screen: GameScreen,
        *,
        prompt: Callable[[], str],
        moves: Callable[[], Iterable[str]],
        commands: Iterable[str],
        console: Console,
    ) -> None:
        self.screen = screen
        self._prompt = prompt
        self._colours = console.color_system if not console.no_color else None
        self._lines: asyncio.Queue[str] = asyncio.Queue()
        self._application = self._make_application(MoveCompleter(moves, commands))

    def _make_application(self, completer: Completer) -> Application[None]:
        picture = Window(FormattedTextControl(lambda: ANSI(self._picture())), height=self._height)
        field = TextArea(
            height=1, prompt=lambda: [("class:prompt", self._prompt())], multiline=False,
            completer=completer, complete_while_typing=True, accept_handler=self._accept,
            history=InMemoryHistory(),
        )  # fmt: skip
        blank = ConditionalContainer(Window(height=1), ~has_completions)
        return Application(
            Layout(HSplit([picture, field, CompletionsToolbar(), blank]), focused_element=field),
            key_bindings=self._keys(),
            refresh_interval=_REFRESH_S,
            style=_STYLE,
        )

    def _keys(self) -> KeyBindings:
        keys = KeyBindings()

        @keys.add("c-c")
        @keys.add("c-d")
        @keys.add("<sigint>")
        def _leave(_event: KeyPressEvent) -> None:
            self._lines.put_nowait(LEAVE)

        @keys.add("tab")
        def _complete(event: KeyPressEvent) -> None:
            buffer = event.current_buffer
            if buffer.complete_state:
                buffer.complete_next()
            else:
                buffer.start_completion(select_first=True)

        return keys

    def _accept(self, buffer: Buffer) -> bool:
        self.screen.hush()
        self._lines.put_nowait(buffer.text.strip())
        return False

    @property
    def _width(self) -> int:
        return int(self._application.output.get_size().columns)

    def _height(self) -> int:
        return min(rows(self._width - 1), int(self._application.output.get_size().rows) - 3)

    def _picture(self) -> str:
        """One column less than there are: a full line would wrap in some terminals."""
        width = self._width - 1
        text = io.StringIO()
        console = Console(
            file=text,
            force_terminal=True,
            color_system="truecolor" if self._colours else None,
            width=width,
            legacy_windows=False,
        )
        console.print(self.screen.picture(width), end="")
        return text.getvalue()

    def say(self, text: str) -> None:
        """A line for the person."""
        self.screen.say(text)
        self._application.invalidate()

    async def show(self, stream: AsyncIterator[events.Event]) -> None:
        """Until the stream ends."""
        async for event in stream:
            self.screen.note(event)
            self._application.invalidate()

    async def typed(self) -> AsyncIterator[str]:
        """Lines as they are entered; the last one is `LEAVE`, when the person leaves."""
        while True:
            yield await self._lines.get()

    @asynccontextmanager
    async def live(self) -> AsyncIterator[None]:
        """The picture is on the screen inside of this, and the terminal as before after it."""
        started = asyncio.Event()
        task = asyncio.create_task(self._application.run_async(pre_run=started.set, handle_sigint=False))
        task.add_done_callback(lambda _: self._ended(started))
        try:
            await started.wait()
            yield
        finally:
            if self._application.is_running:
                self._application.exit()
            else:
                task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    def _ended(self, started: asyncio.Event) -> None:
        """The picture has ended; where nobody ended it, the terminal has gone, and the person with it."""
        started.set()
        self._lines.put_nowait(LEAVE)
