"""Byte streams to a machine: serial ports, pseudo-terminals and ``socket://host:port``.

A driver sees a `Transport` and nothing else, so that tests put an in-memory pair or a script in its place.

Linux raises DTR when a port is opened and, as long as ``HUPCL`` is set, lowers it when the last user closes
it (termios(3)). A rising DTR resets an Arduino. `open_port` therefore clears ``HUPCL``: when this process
ends, even by SIGKILL, DTR stays up, the board runs on, and the next opening makes no edge. Whether an edge is
to be expected is read off the port before it is changed (`Transport.resets`).

Whoever wants to see the traffic listens to the logger `WIRE` at level DEBUG: each record's arguments are
``out`` or ``in`` and the bytes.
"""

import asyncio
import errno
import logging
import os
import termios
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import serialx

from kempelen.core.errors import ConfigError, LinkError

_SCHEMES = ("socket://", "tcp://")
_CONNECT_SECONDS = 5.0
_PSEUDO_TERMINALS = range(136, 144)  # major device numbers (Linux, devices.txt)
WIRE = "kempelen.wire"
_wire = logging.getLogger(WIRE)


class Transport(Protocol):
    """An open byte stream.

    Attributes:
        name: The port, as the user wrote it.
        resets: Whether opening it may have reset a board, whose boot loader must then be left in peace.
    """

    name: str
    resets: bool

    async def read(self) -> bytes:
        """At least one byte.

        Raises:
            LinkError: the line is lost or closed.
        """
        ...

    def write(self, data: bytes) -> None:
        """Send at once; never waits.

        Raises:
            LinkError: the line is lost or closed.
        """
        ...

    async def close(self) -> None:
        """Let go of the port; may be called twice."""
        ...


class PortTransport(asyncio.Protocol):
    """A serialx port as a `Transport`.

    Args:
        name: The port, as the user wrote it.
        resets: Whether opening it may have reset the device.
    """

    def __init__(self, name: str, *, resets: bool) -> None:
        self.name = name
        self.resets = resets
        self._port: serialx.BaseSerialTransport | None = None
        self._received = bytearray()
        self._news = asyncio.Event()
        self._heard = False
        self._lost = ""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The port is open."""
        if isinstance(transport, serialx.BaseSerialTransport):
            self._port = transport

    def data_received(self, data: bytes) -> None:
        """Bytes from the device."""
        _wire.debug("%s %r", "in", data)
        self._received += data
        self._heard = True
        self._news.set()

    def connection_lost(self, exc: Exception | None) -> None:
        """The port is gone."""
        closed = "it was closed at the other end"
        if not self._heard:
            closed += " before a word was said; perhaps another program is connected"
        self._lost = self._lost or str(exc or closed)
        self._news.set()

    async def read(self) -> bytes:
        """What has arrived, at least one byte.

        Raises:
            LinkError: the line is lost or closed, and everything received before has been read.
        """
        while not self._received:
            self._raise_if_lost()
            self._news.clear()
            await self._news.wait()
        data = bytes(self._received)
        self._received.clear()
        return data

    def write(self, data: bytes) -> None:
        """Send at once.

        Raises:
            LinkError: the line is lost or closed.
        """
        self._raise_if_lost()
        if self._port is None:
            raise LinkError(f"{self.name} is not open.", hint="Connect first.")
        try:
            self._port.write(data)
        except OSError as error:
            self._lost = str(error)
            self._raise_if_lost()
        _wire.debug("%s %r", "out", data)

    async def close(self) -> None:
        """Let go of the port."""
        self._lost = self._lost or "it was closed"
        self._news.set()
        if self._port is not None:
            port, self._port = self._port, None
            port.abort()
            await port.wait_closed()

    def _raise_if_lost(self) -> None:
        if self._lost:
            raise LinkError(
                f"The connection to {self.name} is lost: {self._lost}.",
                hint="Check cable and power, then connect again; nothing is sent twice.",
            )


async def open_port(port: str, *, baud: int = 115200) -> PortTransport:
    """Open a serial device or a ``socket://host:port`` for this process alone.

    Args:
        port: ``/dev/tty...``, the path of a pseudo-terminal, or ``socket://host:port``.
        baud: Bits per second; without meaning for sockets.

    Raises:
        ConfigError: the text names no port.
        LinkError: absent, no permission, in use, not a serial device, or nobody listens.
    """
    if port.startswith(_SCHEMES):
        return await _open(port, port.replace("tcp://", "socket://", 1), baud, resets=False)
    if "://" in port or not port:
        raise ConfigError(f"'{port}' is no port.", hint="Use /dev/tty... or socket://host:port.")
    descriptor = _probe(port)
    try:  # kept open until serialx has it too, so that DTR makes one edge at most
        return await _open(port, port, baud, resets=_hangs_up(port, descriptor))
    finally:
        os.close(descriptor)


def _probe(port: str) -> int:
    try:
        return os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as error:
        raise _explained(port, error) from None


def _hangs_up(port: str, descriptor: int) -> bool:
    """Whether DTR was lowered when the port was last closed (a pseudo-terminal has no boot loader)."""
    try:
        cflag: int = termios.tcgetattr(descriptor)[2]
    except termios.error:
        raise LinkError(
            f"{port} is not a serial device.", hint="`kempelen doctor` lists the ports of this machine."
        ) from None
    boots = os.major(os.fstat(descriptor).st_rdev) not in _PSEUDO_TERMINALS
    return boots and bool(cflag & termios.HUPCL)


async def _open(port: str, url: str, baud: int, *, resets: bool) -> PortTransport:
    options: dict[str, Any] = (
        {"connect_timeout": _CONNECT_SECONDS}
        if url.startswith(_SCHEMES)
        else {"dtr_on_close": serialx.PinState.UNDEFINED, "rts_on_close": serialx.PinState.UNDEFINED}
    )
    transport = PortTransport(port, resets=resets)
    loop = asyncio.get_running_loop()
    try:
        await serialx.create_serial_connection(loop, lambda: transport, url, baud, **options)
    except TimeoutError:
        raise LinkError(
            f"{port} did not answer within {_CONNECT_SECONDS:.0f} s.", hint="Check host, port and network."
        ) from None
    except ValueError as error:
        raise ConfigError(f"{port}: {error}.", hint="Use /dev/tty... or socket://host:port.") from None
    except OSError as error:
        raise _explained(port, error) from None
    return transport


_REASONS = {
    errno.ENOENT: ("does not exist", "Is the machine plugged in? `kempelen doctor` lists the ports."),
    errno.ENXIO: ("has no device behind it", "Is the machine plugged in?"),
    errno.ENODEV: ("has no device behind it", "Is the machine plugged in?"),
    errno.EIO: ("has nobody at its other end", "Is the machine (or the twin) running?"),
    errno.EACCES: (
        "may not be opened by this user",
        "Add the user to the port's group (`sudo usermod -aG dialout $USER`) and log in again.",
    ),
    errno.EBUSY: (
        "is already in use by another program",
        "End the other program (a G-code sender, a second Kempelen).",
    ),
    errno.ECONNREFUSED: ("refused: nobody listens there", "Start the network bridge, or check the number."),
    errno.EISDIR: ("is a directory", "Name the device itself, for example /dev/ttyUSB0."),
}  # fmt: skip


def _explained(port: str, error: OSError) -> LinkError:
    code = error.errno if error.errno is not None else 0
    what, hint = _REASONS.get(
        code,
        (
            f"cannot be opened: {error.strerror or error}",
            "`kempelen doctor` lists the ports of this machine.",
        ),
    )
    return LinkError(f"{port} {what}.", hint=hint)


@dataclass(frozen=True, slots=True)
class PortInfo:
    """A serial port of this machine.

    Attributes:
        usable: Whether this user may read and write it.
    """

    device: str
    description: str
    usable: bool


def list_ports() -> list[PortInfo]:
    """The serial ports of this machine, for the doctor; nothing is opened."""
    return [
        PortInfo(
            device=info.device,
            description=" ".join(part for part in (info.manufacturer, info.product) if part),
            usable=os.access(Path(info.device), os.R_OK | os.W_OK),
        )
        for info in serialx.list_serial_ports()
    ]
