"""A serial line at another machine's node, as an open byte stream like any other."""

from typing import Self

from kempelen.core.errors import ConfigError, KempelenError, LinkError, SensorError
from kempelen.nodes.channel import Channel, ChannelWaits
from kempelen.nodes.link import Link

_KNOWN = (LinkError, SensorError, ConfigError)


class RemoteLine:
    """What `kempelen.robots.transport.Transport` is for a port of this machine.

    Args:
        link: Not yet entered; left when this is closed.
        table: At which the device is.
        what: Its kind, as in keys.
        waits: How long for what.
    """

    resets = False

    def __init__(self, link: Link, table: str, what: str, *, waits: ChannelWaits | None = None) -> None:
        self.name = f"node:{table}"
        self._link = link
        self._channel = Channel(link, table, what, who=f"another program at table {table}", waits=waits)

    async def open(self) -> Self:
        """Find the node and have the port opened there.

        Raises:
            LinkError: there is no such node, or another program has the device.
        """
        await self._link.__aenter__()
        try:
            await self._channel.open()
        except KempelenError as error:
            await self._link.__aexit__(None, None, None)
            raise _told(error) from None
        except BaseException:
            await self._link.__aexit__(None, None, None)
            raise
        return self

    async def read(self) -> bytes:
        """At least one byte.

        Raises:
            LinkError: the line is lost or closed.
        """
        try:
            return await self._channel.receive()
        except KempelenError as error:
            raise _told(error) from None

    def write(self, data: bytes) -> None:
        """Send at once; never waits; raises as `read`."""
        try:
            self._channel.send(data)
        except KempelenError as error:
            raise _told(error) from None

    async def close(self) -> None:
        """Let go of it; may be called twice."""
        await self._channel.close()
        await self._link.__aexit__(None, None, None)


def _told(error: KempelenError) -> KempelenError:
    """As whoever reads a line expects it."""
    return error if isinstance(error, _KNOWN) else LinkError(error.message, hint=error.hint)
