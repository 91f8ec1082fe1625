"""The device's end of a channel (`kempelen.nodes.channel`)."""

import asyncio
import time
from collections import deque
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Protocol, Self

from kempelen.core.errors import BusyError, KempelenError, LinkError
from kempelen.nodes.channel_packets import HELD, Inbox, Outbox, Packet, Parcel
from kempelen.nodes.link import Link
from kempelen.nodes.messages import Trouble, key_of

_LINGER_S = 0.25


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
    out: Outbox = field(default_factory=Outbox)
    inbox: Inbox = field(default_factory=Inbox)
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
        self._left: deque[str] = deque(maxlen=HELD)
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
                while len(visit.out) >= HELD:
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
