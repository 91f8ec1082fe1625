"""A device's own messages over a link: every one, once, in order, however the link behaves.

The arbiter's end asks; with each question go the messages that the node has not confirmed yet, with each
answer come those that the arbiter has not. A question that finds nothing to bring back waits a moment at the
node, so that news comes at once. One end of one device belongs to one arbiter.
"""

import asyncio
import time
import uuid
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from kempelen.core.errors import KempelenError, LinkError
from kempelen.nodes.channel_packets import Inbox, Outbox, Packet, Parcel
from kempelen.nodes.link import Link
from kempelen.nodes.messages import key_of
from kempelen.nodes.presence import presence


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
        self._out = Outbox()
        self._inbox = Inbox()
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
