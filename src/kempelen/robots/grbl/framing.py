"""How lines travel: bare, as GRBL has them; other controllers put a frame around them."""

from typing import Protocol

from kempelen.robots.grbl import codec
from kempelen.robots.grbl.codec import Decoder, Event
from kempelen.robots.grbl.explain import error_text


class Framing(Protocol):
    """Lines to bytes, bytes to events, for one connection.

    Attributes:
        device: What should be at the other end, for messages.
        resume: What ends a hold, sent past every line.
        overhead: Bytes that a frame adds to a line, at most.
    """

    device: str
    resume: bytes
    overhead: int

    def encode(self, line: bytes) -> bytes:
        """A line with its newline as it goes out; each one exactly once, in this order."""
        ...

    def feed(self, data: bytes) -> list[Event]:
        """Events of the lines that ``data`` completes."""
        ...

    def restarted(self) -> None:
        """The controller has forgotten what came before."""
        ...

    def expect_axes(self, count: int) -> None:
        """From now on a report of another number of axes is damaged."""
        ...

    def explain(self, code: int) -> tuple[str, str]:
        """What ``error:code`` means, and what to do next."""
        ...


class Bare:
    """GRBL's lines."""

    device = "GRBL"
    resume = codec.RESUME
    overhead = 0

    def __init__(self) -> None:
        self._decoder = Decoder()
        self.feed = self._decoder.feed
        self.explain = error_text

    def encode(self, line: bytes) -> bytes:
        """As it is."""
        return line

    def restarted(self) -> None:
        """Nothing to forget."""

    def expect_axes(self, count: int) -> None:
        """From now on a report of another number of axes is damaged."""
        self._decoder.axes = count
