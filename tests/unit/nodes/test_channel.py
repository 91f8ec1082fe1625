"""A device's line over a link: every message once and in order, one arbiter at a time, loss told."""

import asyncio
import random
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager

import pytest

from kempelen.core.errors import BusyError, KempelenError, LinkError, SensorError
from kempelen.nodes.channel import Channel, ChannelWaits
from kempelen.nodes.channel_node import ChannelNode
from kempelen.nodes.channel_packets import Packet, Parcel
from kempelen.nodes.local_link import LocalLink, LocalNet, Weather
from kempelen.nodes.messages import key_of
from kempelen.nodes.remote_line import RemoteLine

QUICK = ChannelWaits(answer=0.4, again=0.01, found=0.3, lost=0.6)


class ToyDevice:
    """Says what it is told to say."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []
        self.says: asyncio.Queue[bytes | KempelenError] = asyncio.Queue()
        self.closed = False

    async def receive(self) -> bytes:
        said = await self.says.get()
        if isinstance(said, KempelenError):
            raise said
        return said

    def send(self, message: bytes) -> None:
        if message == b"impossible":
            raise LinkError("That cannot be sent.")
        self.heard.append(message)

    async def close(self) -> None:
        self.closed = True


class Room:
    """A net with a device's node."""

    def __init__(self, stack: AsyncExitStack, weather: Weather | None) -> None:
        self.net = LocalNet(weather)
        self.devices: list[ToyDevice] = []
        self.fault: KempelenError | None = None
        self._stack = stack
        self.node: ChannelNode

    async def opened(self) -> ToyDevice:
        if self.fault is not None:
            raise self.fault
        self.devices.append(ToyDevice())
        return self.devices[-1]

    async def offer(self) -> AsyncExitStack:
        own = await self._stack.enter_async_context(AsyncExitStack())
        link = await own.enter_async_context(self.net.join())
        self.node = await own.enter_async_context(ChannelNode(self.opened, link, "one", "board", forfeit=0.3))
        return own

    async def link(self) -> LocalLink:
        return await self._stack.enter_async_context(self.net.join())

    async def channel(self, who: str = "me", waits: ChannelWaits = QUICK) -> Channel:
        channel = Channel(await self.link(), "one", "board", who=who, waits=waits)
        await channel.open()
        self._stack.push_async_callback(channel.close)
        return channel

    @property
    def device(self) -> ToyDevice:
        return self.devices[-1]


@asynccontextmanager
async def room(weather: Weather | None = None) -> AsyncIterator[Room]:
    async with AsyncExitStack() as stack:
        made = Room(stack, weather)
        await made.offer()
        yield made


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(5):
        while not condition():  # noqa: ASYNC110 - what is waited for has no event of its own
            await asyncio.sleep(0.001)


@pytest.mark.parametrize("seed", range(4))
async def test_in_foul_weather_every_message_arrives_once_and_in_order(seed: int) -> None:
    weather = Weather(random.Random(seed), loss=0.2, twice=0.4, delay=(0.0, 0.02))
    async with room(weather) as made:
        channel = await made.channel(waits=ChannelWaits(answer=0.4, again=0.01, found=5, lost=5))
        there, back = [b"%d" % n for n in range(20)], [bytes([n, 0, 255]) for n in range(20)]
        for message, reply in zip(there, back, strict=True):
            channel.send(message)
            made.device.says.put_nowait(reply)
        async with asyncio.timeout(10):
            assert [await channel.receive() for _ in back] == back
        await until(lambda: len(made.device.heard) == 20)
        assert made.device.heard == there
        assert len(made.devices) == 1


async def test_a_cut_link_is_waited_out() -> None:
    async with room() as made:
        channel = await made.channel()
        made.net.weather.cut = True
        channel.send(b"lamp")
        made.device.says.put_nowait(b"lift")
        made.net.weather.cut = False
        assert await channel.receive() == b"lift"
        await until(lambda: made.device.heard == [b"lamp"])


async def test_a_link_that_stays_cut_is_told_and_the_device_set_free() -> None:
    async with room() as made:
        channel = await made.channel()
        made.net.weather.cut = True
        with pytest.raises(LinkError, match="board node at table one has not answered for"):
            await channel.receive()
        with pytest.raises(LinkError):
            channel.send(b"too late")
        await until(lambda: made.device.closed)
        assert made.node.arbiter == ""
        made.net.weather.cut = False


async def test_a_node_that_was_started_again_does_not_know_the_old_line() -> None:
    async with AsyncExitStack() as stack:
        made = Room(stack, None)
        own = await made.offer()
        channel = await made.channel()
        await own.aclose()
        assert made.device.closed
        await made.offer()
        with pytest.raises(LinkError, match="no longer knows this program"):
            await channel.receive()


async def test_a_second_arbiter_is_told_who_has_the_device_until_that_one_leaves() -> None:
    async with room() as made:
        first = await made.channel("Anna")
        with pytest.raises(BusyError, match="used by Anna"):
            await made.channel("Ben")
        assert made.node.arbiter == "Anna"
        await first.close()
        await made.channel("Ben")
        assert [device.closed for device in made.devices] == [True, False]


async def test_what_the_device_said_last_comes_before_its_end() -> None:
    async with room() as made:
        channel = await made.channel()
        made.device.says.put_nowait(b"last words")
        made.device.says.put_nowait(SensorError("It was unplugged.", hint="Plug it in."))
        assert await channel.receive() == b"last words"
        with pytest.raises(SensorError, match="unplugged"):
            await channel.receive()


async def test_a_slow_arbiter_makes_the_device_wait_and_not_the_memory_full() -> None:
    async with room() as made:
        await made.channel()
        made.net.weather.cut = True
        for number in range(500):
            made.device.says.put_nowait(b"%d" % number)
        await until(lambda: made.device.says.qsize() <= 500 - 60)
        for _ in range(20):
            await asyncio.sleep(0)
        assert made.device.says.qsize() >= 500 - 70
        made.net.weather.cut = False


async def test_a_device_that_cannot_be_opened_says_why() -> None:
    async with room() as made:
        made.fault = LinkError("/dev/ttyUSB9 does not exist.", hint="Plug it in.")
        with pytest.raises(LinkError, match="ttyUSB9 does not exist"):
            await made.channel()


async def test_a_line_at_a_node_is_read_and_written_like_any_other() -> None:
    async with room() as made:
        line = await RemoteLine(made.net.join(), "one", "board", waits=QUICK).open()
        line.write(b"H")
        made.device.says.put_nowait(b"hello")
        assert await line.read() == b"hello"
        await until(lambda: made.device.heard == [b"H"])
        with pytest.raises(LinkError, match="used by another program"):
            await RemoteLine(made.net.join(), "one", "board", waits=QUICK).open()
        await line.close()
        await line.close()
        assert made.device.closed
        with pytest.raises(LinkError):
            await line.read()


async def test_other_nodes_and_protocols_are_named() -> None:
    async with room() as made:
        link = await made.link()
        with pytest.raises(LinkError, match="No board node at table two answers") as raised:
            await Channel(link, "two", "board", waits=QUICK).open()
        assert "Nodes with a board: one." in raised.value.hint
        await link.stand(key_of("two", "board", protocol=99))
        with pytest.raises(LinkError, match="speaks protocol 99, this program protocol 1"):
            await Channel(link, "two", "board", waits=QUICK).open()


@pytest.mark.parametrize(
    "content",
    [b"", b"\xff", b"{}", b'{"client":"0123456789","had":-1}', b'{"client":"0123456789","opens":1,"x":2}'],
)
async def test_damaged_packets_are_refused(content: bytes) -> None:
    async with room() as made:
        parcel = Parcel.unpack(
            await (await made.link()).ask(key_of("one", "board", "line"), content, seconds=1)
        )
        assert parcel.trouble is not None
        assert "is no Packet" in parcel.trouble.message
        assert made.devices == []


async def test_a_damaged_message_in_a_packet_goes_no_further() -> None:
    async with room() as made:
        link, client = await made.link(), "0123456789"

        async def ask(*messages: tuple[int, str], opens: bool = False) -> Parcel:
            packet = Packet(client=client, opens=opens, messages=messages)
            return Parcel.unpack(await link.ask(key_of("one", "board", "line"), packet.pack(), seconds=1))

        assert (await ask(opens=True)).trouble is None
        parcel = await ask((1, "@@@@"))
        assert parcel.trouble is not None
        assert "Message 1 is damaged" in parcel.trouble.message
        assert made.device.heard == []
        assert (await ask((1, "aGk="))).had == 1
        assert (await ask((1, "aGk="), (3, "aGk="))).had == 1  # one repeated, one before its time
        assert made.device.heard == [b"hi"]


async def test_a_late_first_word_of_a_program_that_has_left_opens_nothing() -> None:
    async with room() as made:
        link = await made.link()
        packet = Packet(client="0123456789", opens=True)
        for each in (packet, packet.model_copy(update={"leaves": True}), packet):
            content = await link.ask(key_of("one", "board", "line"), each.pack(), seconds=1)
        assert Parcel.unpack(content).trouble is not None
        assert [device.closed for device in made.devices] == [True]
