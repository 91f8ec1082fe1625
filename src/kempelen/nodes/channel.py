"""A device's own messages over a link: every one, once, in order, however the link behaves.

The arbiter's end asks; with each question go the messages that the node has not confirmed yet, with each
answer come those that the arbiter has not. A question that finds nothing to bring back waits a moment at the
node, so that news comes at once. One end of one device belongs to one arbiter.
"""

import asyncio
import base64
import binascii
import itertools
import time
import uuid
from collections import deque
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Annotated, Protocol, Self

from pydantic import Field

from kempelen.core.errors import BusyError, KempelenError, LinkError
from kempelen.nodes.link import Link
from kempelen.nodes.messages import Message, Trouble, key_of
from kempelen.nodes.presence import presence

_LINGER_S = 0.25
_HELD = 64
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


class _Outbox:
    """Messages until they are confirmed."""

    def __init__(self) -> None:
        self._numbers = itertools.count(1)
        self._waiting: deque[tuple[int, bytes]] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, message: bytes) -> None:
        self._waiting.append((next(self._numbers), message))

    def had(self, number: int) -> None:
        while self._waiting and self._waiting[0][0] <= number:
            self._waiting.popleft()

    def packed(self) -> tuple[Numbered, ...]:
        packed, size = list[Numbered](), 0
        for number, message in self._waiting:
            packed.append((number, base64.b64encode(message).decode()))
            size += len(message)
            if size > _MOST:
                break
        return tuple(packed)


class _Inbox:
    """Messages, each once and in order."""

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


class Far(Protocol):
    """The device itself, beside its node."""

    async def receive(self) -> bytes:
        """Its next message.

        Raises:
            KempelenError: there will be no more, for this reason.
        """
        ...

    def send(self, message: bytes) -> None:
        """One to it; never waits.

        Raises:
            KempelenError: it cannot be sent.
        """
        ...

    async def close(self) -> None:
        """Let go of it."""
        ...


@dataclass
class _Visit:
    """An arbiter's use of the device."""

    packet: Packet
    far: Far
    heard: float
    out: _Outbox = field(default_factory=_Outbox)
    inbox: _Inbox = field(default_factory=_Inbox)
    news: asyncio.Event = field(default_factory=asyncio.Event)
    room: asyncio.Event = field(default_factory=asyncio.Event)
    over: KempelenError | None = None
    pump: asyncio.Task[None] = field(init=False)


class ChannelNode:
    """Offers a device at a table. Async context manager, entered inside of the link.

    Args:
        opened: Opens the device, for each arbiter anew.
        link: Entered.
        table: Its name.
        what: Kind of the device, as in keys: ``board``, ``camera``.
        forfeit: An arbiter that has been silent for so long has left, s.
        clock: s.
    """

    def __init__(
        self,
        opened: Callable[[], Awaitable[Far]],
        link: Link,
        table: str,
        what: str,
        *,
        forfeit: float = 5.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._opened = opened
        self._link = link
        self._table = table
        self._what = what
        self._forfeit = forfeit
        self._clock = clock
        self._visit: _Visit | None = None
        self._left: deque[str] = deque(maxlen=_HELD)
        self._opening = asyncio.Lock()
        self._answers: set[asyncio.Task[bytes]] = set()
        self._chore: asyncio.Task[None]

    async def __aenter__(self) -> Self:
        """Be found."""
        await self._link.answer(key_of(self._table, self._what, "line"), self._line)
        await self._link.stand(key_of(self._table, self._what))
        self._chore = asyncio.create_task(self._tidy())
        return self

    async def __aexit__(self, *exc: object) -> None:
        """The device is let go of."""
        self._chore.cancel()
        await asyncio.gather(self._chore, *self._answers, return_exceptions=True)
        async with self._opening:
            await self._end()

    @property
    def arbiter(self) -> str:
        """Who uses the device, for people; empty for nobody."""
        return self._visit.packet.who if self._visit else ""

    async def _line(self, content: bytes) -> bytes:
        """A device that is being opened is never left half open, whatever becomes of who asked."""
        answering = asyncio.create_task(self._answer(content))
        self._answers.add(answering)
        answering.add_done_callback(self._answers.discard)
        return await asyncio.shield(answering)

    async def _answer(self, content: bytes) -> bytes:
        try:
            packet = Packet.unpack(content)
            visit = await self._visiting(packet)
            visit.heard = self._clock()
            for message in visit.inbox.take(packet.messages):
                visit.far.send(message)
            visit.out.had(packet.had)
            visit.room.set()
            if packet.leaves:
                async with self._opening:
                    await self._end()
            elif packet.waits:
                await self._news(visit)
        except KempelenError as error:
            return Parcel(trouble=Trouble.of(error)).pack()
        trouble = Trouble.of(visit.over) if visit.over is not None and not visit.out else None
        return Parcel(messages=visit.out.packed(), had=visit.inbox.had, trouble=trouble).pack()

    async def _news(self, visit: _Visit) -> None:
        if not visit.out and visit.over is None:
            visit.news.clear()
            with suppress(TimeoutError):
                async with asyncio.timeout(_LINGER_S):
                    await visit.news.wait()

    async def _visiting(self, packet: Packet) -> _Visit:
        """The visit that a packet belongs to.

        Raises:
            BusyError: another arbiter has the device.
            LinkError: the node does not know that one.
            KempelenError: the device cannot be opened.
        """
        async with self._opening:
            visit = self._visit
            if visit is not None and visit.packet.client == packet.client:
                return visit
            if not packet.opens or packet.client in self._left:
                raise LinkError(
                    f"The {self._what} at table {self._table} no longer knows this program.",
                    hint="It is connected again by itself.",
                )
            if visit is not None and (silent := self._clock() - visit.heard) < self._forfeit:
                raise BusyError(
                    f"The {self._what} at table {self._table} is used by {visit.packet.who}, heard of "
                    f"{silent:.1f} s ago.",
                    hint=f"End that program, or wait until it has been silent for {self._forfeit:.0f} s.",
                )
            await self._end()
            visit = self._visit = _Visit(packet, await self._opened(), self._clock())
            visit.pump = asyncio.create_task(self._pump(visit))
            return visit

    async def _end(self) -> None:
        visit, self._visit = self._visit, None
        if visit is not None:
            self._left.append(visit.packet.client)
            visit.pump.cancel()
            await asyncio.gather(visit.pump, return_exceptions=True)
            await visit.far.close()

    @staticmethod
    async def _pump(visit: _Visit) -> None:
        """From the device to the outbox; when that is full, the device waits, or drops what it likes."""
        try:
            while True:
                while len(visit.out) >= _HELD:
                    visit.room.clear()
                    await visit.room.wait()
                visit.out.put(await visit.far.receive())
                visit.news.set()
        except KempelenError as error:
            visit.over = error
            visit.news.set()

    async def _tidy(self) -> None:
        """An arbiter that has gone leaves the device free, and at rest."""
        while True:
            await asyncio.sleep(self._forfeit / 5)
            async with self._opening:
                if self._visit is not None and self._clock() - self._visit.heard > self._forfeit:
                    await self._end()


@dataclass(frozen=True)
class ChannelWaits:
    """How long the arbiter's end waits, s.

    Attributes:
        answer: For one answer.
        again: After none, before it asks again.
        found: For the node, at first.
        lost: Without any answer: then the device counts as gone.
    """

    answer: float = 1.0
    again: float = 0.05
    found: float = 5.0
    lost: float = 10.0


class Channel:
    """The arbiter's end.

    Args:
        link: Entered.
        table: At which the device is.
        what: Its kind.
        who: Uses it, for people.
        waits: How long for what.
        clock: s.
    """

    def __init__(
        self,
        link: Link,
        table: str,
        what: str,
        *,
        who: str = "",
        waits: ChannelWaits | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._link = link
        self._table = table
        self._what = what
        self._waits = waits or ChannelWaits()
        self._clock = clock
        self._packet = Packet(client=uuid.uuid4().hex, who=who)
        self._out = _Outbox()
        self._inbox = _Inbox()
        self._arrived: deque[bytes] = deque()
        self._news = asyncio.Event()
        self._more = asyncio.Event()
        self._why: KempelenError | None = None
        self._tasks: list[asyncio.Task[None]] = []

    async def open(self) -> None:
        """Find the node, and have the device opened there.

        Raises:
            LinkError: no node of this protocol offers such a device at the table.
            KempelenError: it cannot be opened, or another arbiter has it.
        """
        deadline = self._clock() + self._waits.found
        while True:
            try:
                parcel = await self._asked(opens=True)
                break
            except LinkError:
                if self._clock() > deadline:
                    seen = await presence(self._link, self._what, self._table)
                    raise seen.absence(self._waits.found) from None
                await asyncio.sleep(self._waits.again)
        if parcel.trouble is not None:
            raise parcel.trouble.error()
        self._take(parcel)
        self._tasks = [asyncio.create_task(self._listen()), asyncio.create_task(self._push())]

    async def _asked(self, *, opens: bool = False, leaves: bool = False, waits: bool = False) -> Parcel:
        packet = self._packet.model_copy(
            update={
                "opens": opens, "leaves": leaves, "waits": waits,
                "messages": self._out.packed(), "had": self._inbox.had,
            }
        )  # fmt: skip
        key = key_of(self._table, self._what, "line")
        return Parcel.unpack(await self._link.ask(key, packet.pack(), seconds=self._waits.answer))

    def _take(self, parcel: Parcel) -> None:
        self._arrived.extend(self._inbox.take(parcel.messages))
        self._out.had(parcel.had)
        self._news.set()
        if parcel.trouble is not None:
            self.give_up(parcel.trouble.error())

    def give_up(self, why: KempelenError) -> None:
        """Nothing more comes or goes, for this reason; `close` is still to be called."""
        self._why = self._why or why
        self._news.set()

    async def _listen(self) -> None:
        heard = self._clock()
        while self._why is None:
            try:
                self._take(await self._asked(waits=True))
                heard = self._clock()
            except LinkError:
                silent = self._clock() - heard
                if silent > self._waits.lost:
                    text = (
                        f"The {self._what} node at table {self._table} has not answered for {silent:.0f} s."
                    )
                    self.give_up(LinkError(text, hint="Look after its machine and the network."))
                await asyncio.sleep(self._waits.again)

    async def _push(self) -> None:
        """What is to be sent goes at once, beside the question that waits for news."""
        while self._why is None:
            await self._more.wait()
            self._more.clear()
            with suppress(LinkError):  # it goes again with the next question
                self._take(await self._asked())

    def send(self, message: bytes) -> None:
        """One message to the device; never waits.

        Raises:
            KempelenError: the device is gone.
        """
        if self._why is not None:
            raise self._why
        self._out.put(message)
        self._more.set()

    async def receive(self) -> bytes:
        """The device's next message.

        Raises:
            KempelenError: there will be no more, for this reason.
        """
        while not self._arrived:
            if self._why is not None:
                raise self._why
            self._news.clear()
            await self._news.wait()
        return self._arrived.popleft()

    async def close(self) -> None:
        """Leave the device to others; may be called twice."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._tasks and self._why is None:
            with suppress(LinkError):
                await self._asked(leaves=True)
        self._tasks = []
        self.give_up(LinkError("The line was closed."))
