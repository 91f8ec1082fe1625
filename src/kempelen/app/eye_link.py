"""Where an eye is: a process of this machine, or one beside a camera at a node. The notes are the same."""

import asyncio
import io
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from typing import IO, Protocol

from kempelen.app.config import NODE_PORT, Config
from kempelen.app.eye_wire import LONGEST_LINE, Note
from kempelen.app.network import link_of, table_name
from kempelen.core.errors import KempelenError, LinkError
from kempelen.nodes.channel import Channel, ChannelWaits
from kempelen.nodes.link import Link

_TAIL = 2000
_END_S = 5.0


class EyeLink(Protocol):
    """A way to one eye, from its start to its end."""

    @property
    def pid(self) -> int | None:
        """Of its process; None when that is elsewhere."""
        ...

    async def open(self) -> None:
        """Start it.

        Raises:
            KempelenError: there is none.
        """
        ...

    def send(self, note: Note) -> None:
        """Say something; lost when it has ended."""
        ...

    async def receive(self) -> Note | None:
        """What it says next; None at its end."""
        ...

    def kill(self) -> None:
        """End it, whatever it is doing."""
        ...

    async def end(self) -> str:
        """End it politely; how it ended, in a sentence."""
        ...


class EyeProcess:
    """An eye in a process of its own on this machine. What it says to nobody in particular is kept."""

    def __init__(self) -> None:
        self._process: asyncio.subprocess.Process | None = None
        self._words: IO[bytes] | None = None

    @property
    def pid(self) -> int | None:
        """Of its process."""
        return self._process.pid if self._process else None

    async def open(self) -> None:
        """Start it."""
        self._words = tempfile.TemporaryFile()  # noqa: SIM115 - closed by `end`; a terminal may show a picture
        self._process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "kempelen.app.eye_process",
            stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=self._words,
            start_new_session=True, limit=LONGEST_LINE,
        )  # fmt: skip

    def send(self, note: Note) -> None:
        """Say something."""
        stdin = self._process.stdin if self._process else None
        if stdin is not None and not stdin.is_closing():
            stdin.write(note.encode())

    async def receive(self) -> Note | None:
        """What it says next."""
        stdout = self._process.stdout if self._process else None
        return None if stdout is None else await Note.receive(stdout)

    def kill(self) -> None:
        """End it."""
        if self._process is not None:
            with suppress(ProcessLookupError):
                self._process.kill()

    async def end(self) -> str:
        """It ends with its input."""
        process, code = self._process, 0
        if process is not None:
            if process.stdin is not None:
                process.stdin.close()
            try:
                async with asyncio.timeout(_END_S):
                    await process.wait()
            except TimeoutError:
                self.kill()
                await process.wait()
            code = process.returncode or 0
        last = self._last_words()
        how = f"was killed by signal {-code}" if code < 0 else f"ended with exit code {code}"
        return f"The eye's process {how}{f' ({last})' if last else ''}; it is started again."

    def _last_words(self) -> str:
        if self._words is None:
            return ""
        with self._words as words:
            words.seek(max(0, words.seek(0, os.SEEK_END) - _TAIL))
            self._words = None
            return words.read().decode(errors="replace").strip().rpartition("\n")[2]


class RemoteEye:
    """An eye beside a camera at a node; frames stay there, observations and orders travel.

    Args:
        link: Not yet entered; left at the end.
        table: At which the camera is.
        waits: How long for what.
    """

    pid = None

    def __init__(self, link: Link, table: str, *, waits: ChannelWaits | None = None) -> None:
        self._link = link
        self._table = table
        self._channel = Channel(link, table, "camera", who=f"another program at table {table}", waits=waits)
        self._entered = False
        self._why = ""

    async def open(self) -> None:
        """Find the node; it starts an eye for this program.

        Raises:
            KempelenError: there is no such node, or another program looks through its camera.
        """
        await self._link.__aenter__()
        self._entered = True
        await self._channel.open()

    def send(self, note: Note) -> None:
        """Say something."""
        with suppress(KempelenError):
            self._channel.send(note.encode())

    async def receive(self) -> Note | None:
        """What it says next."""
        try:
            return Note.read(io.BytesIO(await self._channel.receive()))
        except KempelenError as error:
            self._why = str(error)
            return None

    def kill(self) -> None:
        """A node that says nothing is left; it ends its eye by itself."""
        self._channel.give_up(LinkError(f"The camera at table {self._table} has said nothing for too long."))

    async def end(self) -> str:
        """Leave the camera to others."""
        if self._entered:
            self._entered = False
            await self._channel.close()
            await self._link.__aexit__(None, None, None)
        return f"{self._why or f'The camera at table {self._table} is lost.'} It is looked for again."


def starter(config: Config) -> Callable[[], EyeLink]:
    """Makes ways to an eye for the configured camera.

    Raises:
        ConfigError: the camera is at a node whose name is none.
    """
    if not config.camera_source.startswith(NODE_PORT):
        return EyeProcess
    table = table_name(config.camera_source.removeprefix(NODE_PORT))
    return lambda: RemoteEye(link_of(config), table)
