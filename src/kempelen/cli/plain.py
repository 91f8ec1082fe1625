"""The view without a picture: a line for each event, typed lines for moves and commands."""

import asyncio
import codecs
import os
import select
import sys
from collections.abc import AsyncIterator, Callable, Collection

import chess
from rich.console import Console

from kempelen.app.narrate import colour_name, sentence, thinking_text
from kempelen.core import events

END_OF_INPUT = "\x04"
_CHUNK = 4096


class PlainView:
    """Prints events as sentences.

    Args:
        console: Where to.
        people: The sides that persons play, now.
        length: Half-moves of the score that is being replayed, now; None in other modes.
    """

    def __init__(
        self,
        console: Console,
        people: Callable[[], Collection[chess.Color]] = tuple,
        length: Callable[[], int | None] = lambda: None,
    ) -> None:
        self._console = console
        self._people = people
        self._length = length
        self._position = chess.Board()
        self._thought = ""

    def say(self, text: str) -> None:
        """A line for the person."""
        self._console.print(text, markup=False, highlight=False, soft_wrap=True)

    async def show(self, stream: AsyncIterator[events.Event]) -> None:
        """Until the stream ends."""
        async for event in stream:
            if text := self._line(event):
                self.say(text)

    def _line(self, event: events.Event) -> str:
        match event:
            case events.TurnBegan():
                self._position, self._thought = chess.Board(event.fen), ""
                return f"Your move, {colour_name(event.colour)}." if event.colour in self._people() else ""
            case events.EngineThinking():
                self._thought = thinking_text(event.thinking, self._position)
                return ""
            case events.MoveProposed():
                return sentence(event) + self._remark(event)
            case events.CheckpointReached():
                return f"  {sentence(event)}"
            case _:
                return sentence(event)

    def _remark(self, event: events.MoveProposed) -> str:
        remark = f"half-move {event.ply} of {length}" if (length := self._length()) else self._thought
        return f"  ({remark})" if remark else ""


async def typed_lines(descriptor: int | None = None) -> AsyncIterator[str]:
    """Lines of standard input without blocking the loop; `END_OF_INPUT` at its end.

    Args:
        descriptor: Of another input.
    """
    decoder = codecs.getincrementaldecoder("utf-8")(errors="replace")
    waiting = ""
    async for data in _chunks(_standard_input() if descriptor is None else descriptor):
        *lines, waiting = (waiting + decoder.decode(data)).split("\n")
        for line in lines:
            yield line.strip()
    if waiting.strip():
        yield waiting.strip()
    yield END_OF_INPUT


def _standard_input() -> int:
    return sys.stdin.fileno() if sys.stdin is not None and not sys.stdin.closed else -1


async def _chunks(descriptor: int) -> AsyncIterator[bytes]:
    """Bytes as they arrive. What cannot be waited for, a file or ``/dev/null``, never keeps one waiting."""
    loop = asyncio.get_running_loop()
    ready = asyncio.Event()
    try:
        loop.add_reader(descriptor, ready.set)
    except (PermissionError, ValueError, OSError):
        ready.set()
        polled = False
    else:
        polled = True
    try:
        while True:
            await ready.wait()
            if polled:
                ready.clear()
                # The loop may have told of the same bytes twice: reading again would block everything.
                if not select.select([descriptor], [], [], 0.0)[0]:
                    continue
            try:
                data = os.read(descriptor, _CHUNK)
            except OSError:  # closed, or a terminal that has gone
                return
            if not data:
                return
            yield data
            await asyncio.sleep(0)
    finally:
        if polled:
            loop.remove_reader(descriptor)
