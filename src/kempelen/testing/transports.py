"""Byte streams in memory, for drivers under test."""

import asyncio
from collections.abc import Callable
from typing import Protocol, Self

from kempelen.core.errors import LinkError


class MemoryTransport:
    """One end of an in-memory line; a `kempelen.robots.transport.Transport`.

    Args:
        name: Shown in messages.
        deliver: Called with what this end writes.
        resets: What the port says about DTR.
    """

    def __init__(
        self, name: str, deliver: Callable[[bytes], None] = lambda _data: None, *, resets: bool = False
    ) -> None:
        self.name = name
        self.resets = resets
        self.deliver = deliver
        self._received = bytearray()
        self._news = asyncio.Event()
        self._lost = ""

    def feed(self, data: bytes) -> None:
        """Let bytes arrive at this end."""
        self._received += data
        self._news.set()

    def lose(self, reason: str = "the cable was pulled") -> None:
        """Pull the plug."""
        self._lost = reason
        self._news.set()

    async def read(self) -> bytes:
        """What has arrived, at least one byte.

        Raises:
            LinkError: the line is lost.
        """
        while not self._received:
            self._raise_if_lost()
            self._news.clear()
            await self._news.wait()
        data = bytes(self._received)
        self._received.clear()
        return data

    def write(self, data: bytes) -> None:
        """Send.

        Raises:
            LinkError: the line is lost.
        """
        self._raise_if_lost()
        self.deliver(data)

    async def close(self) -> None:
        """Let go."""
        self._lost = self._lost or "it was closed"
        self._news.set()

    def _raise_if_lost(self) -> None:
        if self._lost:
            raise LinkError(f"The connection to {self.name} is lost: {self._lost}.", hint="Connect again.")


def memory_pair(name: str = "memory") -> tuple[MemoryTransport, MemoryTransport]:
    """Two ends of one line: what one writes, the other reads."""
    near, far = MemoryTransport(name), MemoryTransport(name)
    near.deliver, far.deliver = far.feed, near.feed
    return near, far


class Controller(Protocol):
    """A simulated controller with its own time: bytes in, time on, bytes out."""

    def receive(self, data: bytes) -> None:
        """Bytes from the host."""
        ...

    def advance(self, dt: float) -> None:
        """Let ``dt`` s pass."""
        ...

    def take_output(self) -> bytes:
        """Bytes for the host since the last call."""
        ...

    def idle(self) -> bool:
        """Whether nothing would happen if only time passed."""
        ...


class Coupling:
    """Runs a simulated controller against a driver, in one event loop, as fast as the loop turns.

    The controller's time advances by ``step`` s for each turn of the loop, so that a test needs no sleeping
    and a motion of seconds takes milliseconds. Use as an async context manager.

    Args:
        controller: The machine.
        step: s of the controller's time for each turn.
        garble: Applied to what the controller says; for damaged lines.
    """

    def __init__(
        self, controller: Controller, *, step: float = 0.005, garble: Callable[[bytes], bytes] | None = None
    ) -> None:
        self.controller = controller
        self.sent = bytearray()
        self._step = step
        self.garble = garble
        self._host: MemoryTransport | None = None
        self._task: asyncio.Task[None] | None = None
        self._spoken_to = asyncio.Event()

    async def connect(self) -> MemoryTransport:
        """Open the line: a fresh host end; the one before it is lost."""
        if self._host is not None:
            self._host.lose("somebody else opened it")
        self._host = MemoryTransport("memory", self._receive)
        return self._host

    def unplug(self) -> None:
        """Pull the plug; the controller runs on."""
        if self._host is not None:
            self._host.lose()
            self._host = None

    def _receive(self, data: bytes) -> None:
        self.sent += data
        self.controller.receive(data)
        self._spoken_to.set()

    async def __aenter__(self) -> Self:
        """Start the clock."""
        self._task = asyncio.create_task(self._run(), name="controller's clock")
        return self

    async def __aexit__(self, *_exc: object) -> None:
        """Stop the clock."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _run(self) -> None:
        while True:
            self.controller.advance(self._step)
            output = self.controller.take_output()
            if self._host is not None and output:
                self._host.feed(self.garble(output) if self.garble else output)
            self._spoken_to.clear()
            if self.controller.idle():
                await self._spoken_to.wait()
            else:
                await asyncio.sleep(0)
