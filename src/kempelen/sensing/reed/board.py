"""The driver of a reed board on a serial line: events, lamps and buzzer; connects again by itself."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

from kempelen.core.errors import ConfigError, LinkError, SensorError
from kempelen.core.reed import (
    NUMBERS,
    PRODUCT,
    PROTOCOL_VERSION,
    Ask,
    Buzz,
    Change,
    Finding,
    Hello,
    Lamps,
    Lines,
    Message,
    Refusal,
    Snapshot,
    Sound,
    Wiring,
    encode,
)

GREETING_S = 4.0
"""A board that was reset by the opening of its port boots for two of these."""
ASK_AGAIN_S = 0.5
SILENT_S = 3.0
"""Snapshots come ten times a second; after so long without any line the board has gone."""
_FIRST_WAIT_S, _LONGEST_WAIT_S = 0.2, 3.0
_SHOWN = 40


class ByteStream(Protocol):
    """An open line; `kempelen.robots.transport` has one for serial ports."""

    async def read(self) -> bytes:
        """At least one byte; raises LinkError when the line is lost."""
        ...

    def write(self, data: bytes) -> None:
        """Send at once; raises LinkError when the line is lost."""
        ...

    async def close(self) -> None:
        """Let go of the port."""
        ...


Opener = Callable[[], Awaitable[ByteStream]]
Told = Change | Snapshot | Finding


@dataclass(frozen=True, slots=True)
class Trouble:
    """The line to the board is down, and why; empty text: it is up again."""

    text: str


class ReedBoard:
    """Async context manager: a greeted board, whose lines go to ``take`` in their order.

    Args:
        name: The port, for messages.
        opener: Opens the port.
        take: Takes what the board tells.
        trouble: Told when the line is lost, and when it is back.

    Attributes:
        hello: The board's greeting.
        damaged: Lines that could not be read so far.
        refused: Lines of ours that the board could not read.
        connections: How often it was connected.
    """

    def __init__(
        self,
        name: str,
        opener: Opener,
        take: Callable[[Told], None],
        trouble: Callable[[Trouble], None] = lambda _: None,
    ) -> None:
        self._name = name
        self._open = opener
        self._take = take
        self._trouble = trouble
        self._stream: ByteStream | None = None
        self._lines = Lines()
        self._lamps = 0
        self._mark = 0
        self.hello = Hello(PROTOCOL_VERSION, "", Wiring.DIODES)
        self.damaged = self.refused = self.connections = 0

    async def __aenter__(self) -> Self:
        """Connect.

        Raises:
            LinkError: the port is absent, forbidden or in use.
            SensorError: nothing answers there, another device does, or a board of another protocol version.
            ConfigError: the port's name makes no sense.
        """
        await self._connect()
        self._task = asyncio.create_task(self._keep())
        return self

    async def __aexit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """Lamps off, buzzer silent, port free."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)
        self.light(0)
        await self._hang_up()

    # --- what may be asked of it ---

    def mark(self) -> int:
        """Ask for a snapshot; those that carry this mark, or a later one, were taken after now."""
        self._mark = (self._mark + 1) % NUMBERS
        self._send(Ask("S", self._mark))
        return self._mark

    def light(self, squares: int) -> None:
        """Light these squares and no others."""
        self._lamps = squares
        self._send(Lamps(squares))

    def sound(self, sound: Sound) -> None:
        """Make a sound."""
        self._send(Buzz(sound))

    def _send(self, message: Message) -> None:
        """Lost while the line is; lamps and mark are sent again when it is back."""
        if self._stream is not None:
            with suppress(LinkError):
                self._stream.write(encode(message))

    # --- the line ---

    async def _connect(self) -> None:
        self._lines = Lines()
        stream = await self._open()
        try:
            hello, early = await self._greeted(stream)
            self._check(hello)
        except BaseException:
            await stream.close()
            raise
        self._stream = stream
        self.hello = hello
        self.connections += 1
        self._send(Ask("S", self._mark))
        if self.connections > 1:
            self._send(Lamps(self._lamps))
        for message in early:
            self._heed(message)

    async def _greeted(self, stream: ByteStream) -> tuple[Hello, list[Message | ValueError]]:
        """The greeting, and what the board said after it in the same breath."""
        try:
            async with asyncio.timeout(GREETING_S):
                while True:
                    stream.write(encode(Ask("H")))
                    with suppress(TimeoutError):
                        async with asyncio.timeout(ASK_AGAIN_S):
                            return await self._until_hello(stream)
        except TimeoutError:
            raise self._unanswered() from None

    async def _until_hello(self, stream: ByteStream) -> tuple[Hello, list[Message | ValueError]]:
        while True:
            said = list(self._lines.feed(await stream.read()))
            for index, message in enumerate(said):
                if isinstance(message, Hello):
                    return message, said[index + 1 :]

    def _unanswered(self) -> SensorError:
        said = self._lines.stranger.strip()
        if said:
            shown = said[:_SHOWN].decode("ascii", "replace")
            shown = "".join(letter if letter.isprintable() else "." for letter in shown)
            return SensorError(
                f'Another device answers at {self._name}: it says "{shown}", which no reed board says.',
                hint="Name the board's port: --sensor reed:PORT. `kempelen doctor` lists ports.",
            )
        return SensorError(
            f"No reed board answers at {self._name} within {GREETING_S:.0f} s.",
            hint="Is it plugged in, and its firmware on it? See the reed board's page in the documentation.",
        )

    def _check(self, hello: Hello) -> None:
        if hello.product != PRODUCT:
            raise SensorError(
                f"The device at {self._name} calls itself '{hello.product}', not '{PRODUCT}'.",
                hint="Name the reed board's port.",
            )
        if hello.version != PROTOCOL_VERSION:
            older = "board's firmware" if hello.version < PROTOCOL_VERSION else "program"
            raise SensorError(
                f"The reed board at {self._name} speaks version {hello.version} of the protocol, this "
                f"program version {PROTOCOL_VERSION}.",
                hint=f"Bring the {older} up to date.",
            )
        if self.hello.identity and hello.identity != self.hello.identity:
            raise SensorError(
                f"Another reed board is at {self._name} now: {hello.identity} instead of "
                f"{self.hello.identity}.",
                hint="Plug the game's board in again, or leave the game and resume it with this one.",
            )

    async def _keep(self) -> None:
        """Listen; when the line is lost, tell, and connect again and again."""
        while True:
            try:
                await self._listen()
            except (LinkError, SensorError) as error:
                self._trouble(Trouble(str(error)))
            await self._hang_up()
            await self._connect_again()
            self._trouble(Trouble(""))

    async def _connect_again(self) -> None:
        wait = _FIRST_WAIT_S
        while True:
            await asyncio.sleep(wait)
            try:
                await self._connect()
            except (LinkError, SensorError, ConfigError) as error:
                self._trouble(Trouble(str(error)))
                wait = min(2 * wait, _LONGEST_WAIT_S)
            else:
                return

    async def _listen(self) -> None:
        stream = self._stream
        while stream is not None:
            try:
                async with asyncio.timeout(SILENT_S):
                    data = await stream.read()
            except TimeoutError:
                raise SensorError(
                    f"The reed board at {self._name} has said nothing for {SILENT_S:.0f} s.",
                    hint="Look at its cable; it is connected again as soon as it answers.",
                ) from None
            for message in self._lines.feed(data):
                self._heed(message)

    def _heed(self, message: Message | ValueError) -> None:
        match message:
            case Change() | Snapshot() | Finding():
                self._take(message)
            case Hello():
                self._check(message)
            case Refusal():
                self.refused += 1
                self._send(Lamps(self._lamps))
            case ValueError():
                self.damaged += 1
                self._send(Ask("S", self._mark))
            case _:
                pass

    async def _hang_up(self) -> None:
        stream, self._stream = self._stream, None
        if stream is not None:
            await stream.close()
