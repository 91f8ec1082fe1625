"""Lines on their way: as many bytes in flight as the controller's receive buffer safely holds."""

import asyncio
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from kempelen.core.errors import KempelenError
from kempelen.robots.grbl.codec import Event
from kempelen.robots.grbl.framing import Bare, Framing

WINDOW = 120  # bytes in flight; the firmware's buffer holds 127


@dataclass(slots=True, eq=False)
class Stream:
    """Lines on their way.

    Attributes:
        lines: Each with its newline.
        window: Bytes that may be in flight; one line always may.
        acknowledged: How many lines the controller has taken so far; goes on after a failure until it
            restarts.
        replies: What it said before its acknowledgements.
        framing: Of the link that it goes over, which sets it.
    """

    lines: Sequence[bytes]
    window: int = WINDOW
    acknowledged: int = 0
    replies: list[Event] = field(default_factory=list)
    framing: Framing = field(default_factory=Bare)
    _next: int = 0
    _sizes: deque[int] = field(default_factory=deque)
    _in_flight: int = 0
    _done: asyncio.Future[None] | None = None

    @property
    def outstanding(self) -> int:
        """Lines sent and not yet acknowledged."""
        return len(self._sizes)

    def take(self) -> bytes:
        """Everything that may go out now, in one piece."""
        first = self._next
        while self._next < len(self.lines):
            size = len(self.lines[self._next]) + self.framing.overhead
            if self._sizes and self._in_flight + size > self.window:
                break
            self._sizes.append(size)
            self._in_flight += size
            self._next += 1
        return b"".join(map(self.framing.encode, self.lines[first : self._next]))

    def acknowledge(self) -> None:
        """One line fewer in flight."""
        self._in_flight -= self._sizes.popleft()
        self.acknowledged += 1

    def finish(self, error: KempelenError | None = None) -> None:
        """Wake up whoever waits; what has not gone out never will."""
        self._next = len(self.lines)
        if self._done is not None and not self._done.done():
            if error is None:
                self._done.set_result(None)
            else:
                self._done.set_exception(error)

    @property
    def complete(self) -> bool:
        """All lines sent and acknowledged."""
        return not self._sizes and self._next == len(self.lines)

    async def wait(self) -> None:
        """Until all lines are acknowledged, or the stream has failed."""
        self._done = asyncio.get_running_loop().create_future()
        try:
            await self._done
        finally:
            self._next = len(self.lines)
