"""The view where there is no terminal: a line for each event, typed lines for moves and commands."""

import asyncio
import sys
import threading
from collections.abc import AsyncIterator

from rich.console import Console

from kempelen.cli.narrate import sentence
from kempelen.core.events import Event

END_OF_INPUT = "\x04"


class PlainView:
    """Prints events as sentences.

    Args:
        console: Where to.
    """

    def __init__(self, console: Console) -> None:
        self._console = console

    async def show(self, stream: AsyncIterator[Event]) -> None:
        """Until the stream ends."""
        async for event in stream:
            if text := sentence(event):
                self._console.print(text, markup=False, highlight=False, soft_wrap=True)


async def typed_lines() -> AsyncIterator[str]:
    """Lines of standard input without blocking the loop; `END_OF_INPUT` at its end.

    A daemon thread reads, since a regular file or a closed terminal cannot be polled.
    """
    loop = asyncio.get_running_loop()
    queue: asyncio.Queue[str] = asyncio.Queue()

    def read() -> None:
        for line in sys.stdin:
            loop.call_soon_threadsafe(queue.put_nowait, line.strip())
        loop.call_soon_threadsafe(queue.put_nowait, END_OF_INPUT)

    threading.Thread(target=read, name="typed-lines", daemon=True).start()
    while (line := await queue.get()) != END_OF_INPUT:
        yield line
    yield END_OF_INPUT
