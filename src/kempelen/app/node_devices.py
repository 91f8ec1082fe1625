"""What stands at a table beside the robot, offered to the network: a reed board's line, a camera's eye."""

import asyncio
import io
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from typing import Self

import chess

from kempelen.app.cameras import open_view
from kempelen.app.config import NODE_PORT, Config
from kempelen.app.eye import Frames
from kempelen.app.eye_link import EyeProcess
from kempelen.app.eye_wire import Note
from kempelen.app.network import link_of, table_name
from kempelen.app.reed import reed_port
from kempelen.core.errors import ConfigError, LinkError, SensorError
from kempelen.nodes.channel_node import ChannelNode, Far
from kempelen.nodes.link import Link
from kempelen.nodes.messages import key_of
from kempelen.robots.transport import Transport, open_port

_LOOK_S = 0.2
_ORDERS = frozenset({"begin", "expect", "mark", "look again", "ask"})


class Line:
    """An open port as the far end of a channel."""

    def __init__(self, transport: Transport) -> None:
        self.receive = transport.read
        self.send = transport.write
        self.close = transport.close


async def open_line(port: str) -> Far:
    """The line to a device at a port of this machine; raises as `open_port`."""
    return Line(await open_port(port))


class EyeBeside:
    """An eye that looks through this machine's camera, as the far end of a channel: its notes, both ways.

    Where the frames are, it is told here: they never leave this machine.

    Args:
        frames: Of the camera.
    """

    def __init__(self, frames: Frames) -> None:
        self._frames = frames
        self._eye = EyeProcess()
        self._telling: asyncio.Task[None]

    async def open(self) -> Self:
        """Start its process."""
        await self._eye.open()
        self._telling = asyncio.create_task(self._tell_ring())
        return self

    async def _tell_ring(self) -> None:
        told: tuple[str, str] | None = None
        while True:
            await asyncio.sleep(_LOOK_S)
            now = self._frames.ring, self._frames.status.message
            if now != told:
                told = now
                self._eye.send(Note("ring", {"name": now[0], "message": now[1]}))

    async def receive(self) -> bytes:
        """What it says.

        Raises:
            SensorError: its process has ended.
        """
        note = await self._eye.receive()
        if note is None:
            raise SensorError("The eye beside the camera has ended.", hint="It is started again by itself.")
        return note.encode()

    def send(self, message: bytes) -> None:
        """An order to it.

        Raises:
            LinkError: it is none.
        """
        try:
            note = Note.read(io.BytesIO(message))
        except (ValueError, KeyError, TypeError, AttributeError):
            note = None
        if note is None or note.op not in _ORDERS | {"ring"}:
            raise LinkError(f"{len(message)} bytes came that are no order to an eye.")
        if note.op != "ring":
            self._eye.send(note)

    async def close(self) -> None:
        """End it."""
        self._telling.cancel()
        await asyncio.gather(self._telling, return_exceptions=True)
        await self._eye.end()


async def offer(link: Link, table: str, what: str, opened: Callable[[], Awaitable[Far]]) -> ChannelNode:
    """A device's node, to be entered.

    Raises:
        LinkError: another node offers one at that table.
    """
    await require_alone(link, table, what)
    return ChannelNode(opened, link, table, what)


async def require_alone(link: Link, name: str, what: str) -> None:
    """Two nodes of one name would answer each for the other.

    Raises:
        LinkError: another one is there.
    """
    if await link.standing(key_of(name, what)):
        raise LinkError(
            f"There is a node for the {what} of {name} already.",
            hint="Give this one another name, or end that.",
        )


class DeviceStand:
    """A reed board or a camera of this machine, offered to the network. Async context manager.

    Args:
        config: Which one, and how others find it.
        table: Its name.
        what: ``board`` or ``camera``.

    Attributes:
        node: Offers the device.
        port: Where it is on this machine.
    """

    def __init__(self, config: Config, table: str, what: str) -> None:
        self.port = config.camera_source if what == "camera" else config.sensor.port
        if self.port.startswith(NODE_PORT):
            raise ConfigError(
                f"{self.port} is itself at another node.", hint="Name the device as it is on this machine."
            )
        self._config = config
        self._table = table_name(table)
        self._what = what
        self._stack = AsyncExitStack()
        self.node: ChannelNode

    async def __aenter__(self) -> Self:
        """Find the device, join the network, be found.

        Raises:
            KempelenError: there is no such device, or the network cannot be joined.
        """
        try:
            opened = await (self._camera() if self._what == "camera" else self._board())
            link = await self._stack.enter_async_context(link_of(self._config))
            self.node = await offer(link, self._table, self._what, opened)
            await self._stack.enter_async_context(self.node)
        except BaseException:
            await self._stack.aclose()
            raise
        return self

    async def _camera(self) -> Callable[[], Awaitable[Far]]:
        frames = await self._stack.enter_async_context(open_view(self._config, chess.Board(), patient=True))
        return lambda: EyeBeside(frames).open()

    async def _board(self) -> Callable[[], Awaitable[Far]]:
        port = self.port = await reed_port(self._config, None)
        return lambda: open_line(port)

    async def __aexit__(self, *exc: object) -> None:
        """The device is free."""
        await self._stack.aclose()
