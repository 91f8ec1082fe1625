"""Scripted wires: what a driver must say, byte for byte, and what it hears."""

import asyncio
from collections import deque
from dataclasses import dataclass

from kempelen.testing.transports import MemoryTransport


@dataclass(frozen=True, slots=True)
class _Step:
    expected: bytes
    reply: bytes


class ScriptedWire:
    r"""The far end of a line that follows a script.

    ::

        wire = ScriptedWire()
        wire.expect(b"?", b"<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\n")
        ...                       # let the driver talk over wire.transport
        wire.assert_done()

    Everything that the driver writes must be exactly the concatenation of what is expected, in order; how it
    is cut into writes does not matter. A reply is given as soon as its bytes are complete.

    Args:
        resets: What the port says about DTR.
    """

    def __init__(self, *, resets: bool = False) -> None:
        self.transport = MemoryTransport("script", self._receive, resets=resets)
        self._steps: deque[_Step] = deque()
        self._pending = b""
        self._wrong = ""
        self._progress = asyncio.Event()

    def expect(self, expected: bytes, reply: bytes = b"") -> "ScriptedWire":
        """The driver must say ``expected`` next and then hears ``reply``."""
        self._steps.append(_Step(expected, reply))
        return self

    def say(self, data: bytes) -> None:
        """Let the driver hear something unasked, now."""
        self.transport.feed(data)

    async def connect(self) -> MemoryTransport:
        """For drivers that open their port themselves."""
        return self.transport

    async def reached(self) -> None:
        """Until the driver has said everything that is expected so far (or something else)."""
        while self._steps and not self._wrong:
            self._progress.clear()
            await self._progress.wait()

    def assert_done(self) -> None:
        """Everything expected was said, and nothing else."""
        assert not self._wrong, self._wrong
        assert not self._pending, f"the driver said {self._pending!r}, which is not all of {self._head()!r}"
        assert not self._steps, f"the driver never said {self._head()!r}"

    def _head(self) -> bytes:
        return self._steps[0].expected if self._steps else b""

    def _receive(self, data: bytes) -> None:
        self._pending += data
        while self._pending and not self._wrong:
            head = self._head()
            if head and self._pending.startswith(head):
                step = self._steps.popleft()
                self._pending = self._pending[len(head) :]
                self.transport.feed(step.reply)
            elif head.startswith(self._pending):
                break
            else:
                self._wrong = f"expected {head!r}, the driver said {self._pending!r}"
        self._progress.set()
