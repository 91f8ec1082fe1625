"""Ways between programs that fail on demand: foul weather, wires that are cut, network namespaces."""

import asyncio
import os
import subprocess
from typing import Any

from kempelen.core.errors import LinkError
from kempelen.nodes.link import Hear
from kempelen.nodes.local_link import Weather
from kempelen.nodes.zenoh_link import ZenohLink


class Foul:
    """A link through weather of its own: questions and news come late, in another order, twice or never.

    Args:
        link: Over which it really goes; entered.
        weather: May be changed at any time.
    """

    def __init__(self, link: ZenohLink, weather: Weather) -> None:
        self._link = link
        self._weather = weather

    def __getattr__(self, name: str) -> Any:
        return getattr(self._link, name)

    async def ask(self, key: str, question: bytes, *, seconds: float) -> bytes:
        """Each copy of a question goes its own way; the first answer counts."""
        asked = [
            asyncio.ensure_future(self._sent(delay, key, question, seconds))
            for delay in self._weather.arrivals()
        ]
        try:
            async with asyncio.timeout(seconds):
                for first in asyncio.as_completed(asked):
                    return await first
                await asyncio.sleep(seconds)
        except TimeoutError:
            pass
        finally:
            for task in asked:
                task.cancel()
            await asyncio.gather(*asked, return_exceptions=True)
        raise LinkError(f"No answer from {key}.")

    async def _sent(self, delay: float, key: str, question: bytes, seconds: float) -> bytes:
        await asyncio.sleep(delay)
        return await self._link.ask(key, question, seconds=seconds)

    async def listen(self, pattern: str, hear: Hear) -> None:
        """News go their own ways, too."""

        def late(key: str, news: bytes) -> None:
            for delay in self._weather.arrivals():
                asyncio.get_running_loop().call_later(delay, hear, key, news)

        await self._link.listen(pattern, late)


class Wire:
    """A way over the loopback interface that can be cut. Async context manager: gives its own endpoint.

    Args:
        target: Endpoint that it leads to.
    """

    def __init__(self, target: str) -> None:
        self._target = int(target.rpartition(":")[2])
        self._whole = asyncio.Event()
        self._whole.set()
        self._tasks: set[asyncio.Task[None]] = set()

    async def __aenter__(self) -> str:
        """Open."""
        self._server = await asyncio.start_server(self._join, "127.0.0.1", 0)
        return f"tcp/127.0.0.1:{self._server.sockets[0].getsockname()[1]}"

    async def __aexit__(self, *exc: object) -> None:
        """Gone."""
        self._server.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def cut(self) -> None:
        """Nothing comes through."""
        self._whole.clear()

    def heal(self) -> None:
        """It does again, and what was on its way."""
        self._whole.set()

    async def _join(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, back = await asyncio.open_connection("127.0.0.1", self._target)
        for one, other in ((reader, back), (there, writer)):
            task = asyncio.ensure_future(self._carry(one, other))
            self._tasks.add(task)

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while data := await reader.read(65536):
                await self._whole.wait()
                writer.write(data)
                await writer.drain()
        except OSError:
            pass
        finally:
            writer.close()


def _ip(*words: str, check: bool = True) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(("ip", *words), check=check, capture_output=True)  # noqa: S607 - tests only


class Yonder:
    """A network namespace at the end of a pair of virtual cables.

    Attributes:
        name: Of the namespace.
        address: There.
    """

    def __init__(self) -> None:
        number = os.getpid() % 16000
        self.name, self.cable = f"kempelen-{number}", f"kn{number}"
        self._net = f"198.18.{number >> 6}.{(number & 63) << 2}"
        first, _, last = self._net.rpartition(".")
        self._here, self.address = f"{first}.{int(last) + 1}", f"{first}.{int(last) + 2}"

    def make(self) -> None:
        """Both ends up.

        Raises:
            CalledProcessError: this user may not.
        """
        _ip("netns", "add", self.name)
        _ip("link", "add", self.cable, "type", "veth", "peer", "name", "kn0", "netns", self.name)
        _ip("addr", "add", f"{self._here}/30", "dev", self.cable)
        _ip("link", "set", self.cable, "up")
        for words in (("addr", "add", f"{self.address}/30", "dev", "kn0"), ("link", "set", "kn0", "up")):
            _ip("-n", self.name, *words)

    def cut(self) -> None:
        """The cable is pulled."""
        _ip("link", "set", self.cable, "down")

    def heal(self) -> None:
        """And put back."""
        _ip("link", "set", self.cable, "up")

    def weather(self, *words: str) -> None:
        """What the cable does to packets; none: nothing."""
        verb = (
            ("replace", "dev", self.cable, "root", "netem", *words)
            if words
            else ("del", "dev", self.cable, "root")
        )
        subprocess.run(("tc", "qdisc", *verb), check=True, capture_output=True)  # noqa: S607 - as above

    def remove(self) -> None:
        """Nothing of it is left."""
        _ip("link", "del", self.cable, check=False)
        _ip("netns", "del", self.name, check=False)
