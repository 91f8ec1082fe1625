"""Telling observers what happens, without ever waiting for one."""

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator

from kempelen.core.events import EngineThinking, Event, RobotChanged

_log = logging.getLogger(__name__)

KEPT = 4096  # events that wait for a slow reader before the oldest are dropped


class EventReader:
    """One observer's queue: an asynchronous iterator that ends with the game.

    Of events that only replace each other (thoughts, robot states) the newest waits; when more than ``kept``
    others wait, the oldest are dropped and counted.

    Attributes:
        missed: Events dropped so far.
    """

    def __init__(self, kept: int = KEPT) -> None:
        self.missed = 0
        self._waiting: deque[Event] = deque()
        self._kept = kept
        self._news = asyncio.Event()
        self._closed = False

    def offer(self, event: Event) -> None:
        """Queue an event."""
        replaces = isinstance(event, EngineThinking | RobotChanged)
        if replaces and self._waiting and type(self._waiting[-1]) is type(event):
            self._waiting.pop()
        if len(self._waiting) >= self._kept:
            self._waiting.popleft()
            self.missed += 1
        self._waiting.append(event)
        self._news.set()

    def close(self) -> None:
        """Nothing more will come."""
        self._closed = True
        self._news.set()

    def __aiter__(self) -> AsyncIterator[Event]:
        return self

    async def __anext__(self) -> Event:
        while not self._waiting:
            if self._closed:
                raise StopAsyncIteration
            self._news.clear()
            await self._news.wait()
        return self._waiting.popleft()


class EventBus:
    """Hands each event to every observer, in order."""

    def __init__(self) -> None:
        self._readers: set[EventReader] = set()
        self._listeners: list[Callable[[Event], None]] = []

    def emit(self, event: Event) -> None:
        """Tell everyone; a listener that fails is logged and changes nothing."""
        for listener in tuple(self._listeners):
            try:
                listener(event)
            except Exception:  # noqa: BLE001 - a fault of an observer is never one of the game
                _log.exception("An observer failed on %s", type(event).__name__)
        for reader in self._readers:
            reader.offer(event)

    def listen(self, listener: Callable[[Event], None]) -> Callable[[], None]:
        """Call ``listener`` at once for each event, in the loop; it must be quick. Returns how to end it."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    @contextlib.contextmanager
    def reader(self, kept: int = KEPT) -> Iterator[EventReader]:
        """A queue of the events from now on, for an observer that may be slow."""
        reader = EventReader(kept)
        self._readers.add(reader)
        try:
            yield reader
        finally:
            self._readers.discard(reader)

    def close(self) -> None:
        """End all readers; listeners stay."""
        for reader in self._readers:
            reader.close()
