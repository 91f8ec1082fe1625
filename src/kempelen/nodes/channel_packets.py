"""What travels between both ends of a channel: numbered messages, kept until they are confirmed."""

import base64
import binascii
import itertools
from collections import deque
from typing import Annotated

from pydantic import Field

from kempelen.core.errors import LinkError
from kempelen.nodes.messages import Message, Trouble

HELD = 64
"""Messages that wait for the other end before the device has to."""
_MOST = 8 << 20
"""Bytes in one packet, about."""

Numbered = tuple[Annotated[int, Field(ge=1)], str]


class Packet(Message):
    """From the arbiter's end.

    Attributes:
        client: Of that end's making.
        who: For people.
        opens: It is its first word.
        leaves: It is its last one.
        messages: With their numbers, in base64.
        had: Number of the last message from the node that has arrived.
        waits: Whether to wait for news.
    """

    client: Annotated[str, Field(min_length=8, max_length=64)]
    who: Annotated[str, Field(max_length=120)] = ""
    opens: bool = False
    leaves: bool = False
    messages: tuple[Numbered, ...] = ()
    had: Annotated[int, Field(ge=0)] = 0
    waits: bool = False


class Parcel(Message):
    """From the node's end; see `Packet`.

    Attributes:
        trouble: Why there is no device, or no more.
    """

    messages: tuple[Numbered, ...] = ()
    had: int = 0
    trouble: Trouble | None = None


class Outbox:
    """Messages until they are confirmed."""

    def __init__(self) -> None:
        self._numbers = itertools.count(1)
        self._waiting: deque[tuple[int, bytes]] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, message: bytes) -> None:
        """One more."""
        self._waiting.append((next(self._numbers), message))

    def had(self, number: int) -> None:
        """The other end has all up to this number."""
        while self._waiting and self._waiting[0][0] <= number:
            self._waiting.popleft()

    def packed(self) -> tuple[Numbered, ...]:
        """The oldest, as many as one packet takes."""
        packed, size = list[Numbered](), 0
        for number, message in self._waiting:
            packed.append((number, base64.b64encode(message).decode()))
            size += len(message)
            if size > _MOST:
                break
        return tuple(packed)


class Inbox:
    """Messages, each once and in order.

    Attributes:
        had: Number of the last one.
    """

    def __init__(self) -> None:
        self.had = 0

    def take(self, messages: tuple[Numbered, ...]) -> list[bytes]:
        """Those that are new.

        Raises:
            LinkError: one is damaged.
        """
        taken = []
        for number, text in messages:
            if number == self.had + 1:
                try:
                    taken.append(base64.b64decode(text, validate=True))
                except binascii.Error:
                    raise LinkError(f"Message {number} is damaged.") from None
                self.had = number
        return taken
