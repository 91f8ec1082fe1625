"""The far end of the wire: where a host's driver finds the virtual controller.

Both ends are non-blocking; the loop polls them. A pseudo-terminal models DTR as a serial adapter on Linux
does: opening raises it, and a rising edge resets the board. Closing lowers it again unless the last user
had cleared ``HUPCL`` (termios(3)), which is how a host keeps the board running across its own death.
"""

import errno
import os
import pty
import select
import socket
import termios
import tty
from contextlib import suppress
from pathlib import Path
from typing import Protocol

from kempelen.core.errors import TwinError

_CHUNK = 4096


class Wire(Protocol):
    """One end of a byte stream."""

    address: str

    def filenos(self) -> list[int]:
        """Descriptors worth waiting for."""
        ...

    def read(self) -> bytes:
        """What has arrived; empty for nothing."""
        ...

    def write(self, data: bytes) -> None:
        """Send; what nobody reads is lost, as on a real line."""
        ...

    def opened(self) -> bool:
        """Whether an opening has raised DTR since the last call."""
        ...

    def keep_dtr(self) -> None:
        """Take DTR as still raised, where there is one: the table stayed powered."""
        ...

    def drop(self) -> None:
        """Pull the plug; the next host finds the port again."""
        ...

    def close(self) -> None:
        """Give the port back."""
        ...


class PtyWire:
    """A pseudo-terminal.

    Args:
        link: Symbolic link that keeps pointing at the current one.
    """

    def __init__(self, link: Path | None = None) -> None:
        self._link = link
        self._master = -1
        self._open()

    def _open(self) -> None:
        self._master, slave = pty.openpty()
        tty.setraw(slave)
        attributes = termios.tcgetattr(slave)
        attributes[2] |= termios.HUPCL
        termios.tcsetattr(slave, termios.TCSANOW, attributes)
        os.set_blocking(self._master, False)
        device = os.ttyname(slave)
        os.close(slave)
        self.address = device
        if self._link is not None:
            self._point(self._link, device)
            self.address = str(self._link)
        self._hung_up, self._dtr = True, False
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN)

    def _point(self, link: Path, device: str) -> None:
        try:
            if link.is_symlink():
                link.unlink()
            link.symlink_to(device)
        except OSError as error:
            os.close(self._master)
            raise TwinError(
                f"The link {link} to the pseudo-terminal cannot be made: {error.strerror}.",
                hint="Name a path in a directory that you may write to, where no file is yet.",
            ) from None

    def _events(self) -> int:
        for _, events in self._poll.poll(0):
            return events
        return 0

    def _hupcl(self) -> bool:
        with suppress(termios.error):
            return bool(termios.tcgetattr(self._master)[2] & termios.HUPCL)
        return True

    def filenos(self) -> list[int]:
        """The master, while somebody has the other end open."""
        return [] if self._hung_up else [self._master]

    def read(self) -> bytes:
        """What has arrived."""
        try:
            return os.read(self._master, _CHUNK)
        except BlockingIOError:
            return b""
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            return b""

    def write(self, data: bytes) -> None:
        """Send; lost while nobody has the other end open, and when nobody reads."""
        if self._hung_up or not data:
            return
        with suppress(BlockingIOError, OSError):
            os.write(self._master, data)

    def opened(self) -> bool:
        """Whether an opening has raised DTR since the last call."""
        hung_up = bool(self._events() & select.POLLHUP)
        if hung_up and not self._hung_up and self._hupcl():
            self._dtr = False
        edge = self._hung_up and not hung_up and not self._dtr
        self._hung_up = hung_up
        self._dtr = self._dtr or edge
        return edge

    def keep_dtr(self) -> None:
        """Take DTR as still raised: the table stayed powered while no process ran it."""
        self._dtr = True

    def drop(self) -> None:
        """Hang up on the host and offer a new terminal."""
        os.close(self._master)
        self._open()

    def close(self) -> None:
        """Give the terminal back."""
        os.close(self._master)
        if self._link is not None:
            with suppress(FileNotFoundError):
                self._link.unlink()


class TcpWire:
    """A TCP server for one host at a time, like a serial bridge: no DTR, so no reset on connecting.

    Args:
        port: On the loopback interface; 0 for any free one.

    Raises:
        TwinError: the port is taken.
    """

    def __init__(self, port: int) -> None:
        self._server = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._server.bind(("127.0.0.1", port))
        except (OSError, OverflowError) as error:
            self._server.close()
            raise TwinError(
                f"TCP port {port} of this machine cannot be used: {error}.",
                hint="Choose another with --wire tcp:PORT, or tcp:0 for any free one.",
            ) from None
        self._server.listen(1)
        self._server.setblocking(False)  # noqa: FBT003 - the standard library's signature
        self._client: socket.socket | None = None
        self.address = f"socket://127.0.0.1:{self._server.getsockname()[1]}"

    def filenos(self) -> list[int]:
        """The server, and the client when there is one."""
        return [self._server.fileno()] + ([self._client.fileno()] if self._client else [])

    def opened(self) -> bool:
        """Take a new host; a second one at the same time is turned away. Never a DTR edge."""
        with suppress(BlockingIOError):
            client, _ = self._server.accept()
            if self._gone():
                self.drop()
            if self._client is not None:
                client.close()
                return False
            client.setblocking(False)  # noqa: FBT003 - the standard library's signature
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client = client
        return False

    def _gone(self) -> bool:
        """Whether the present host has hung up and nothing of what it sent is left to read."""
        if self._client is None:
            return False
        try:
            return not self._client.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            return False
        except OSError:
            return True

    def keep_dtr(self) -> None:
        """Nothing to keep."""

    def read(self) -> bytes:
        """What has arrived."""
        if self._client is None:
            return b""
        try:
            data = self._client.recv(_CHUNK)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self.drop()
        return data

    def write(self, data: bytes) -> None:
        """Send; lost while nobody is connected."""
        if self._client is not None and data:
            with suppress(BlockingIOError, OSError):
                self._client.sendall(data)

    def drop(self) -> None:
        """Hang up on the host."""
        if self._client is not None:
            self._client.close()
            self._client = None

    def close(self) -> None:
        """Stop listening."""
        self.drop()
        self._server.close()


def make_wire(kind: str, link: str) -> Wire:
    """``"pty"`` or ``"tcp:PORT"``."""
    if kind == "pty":
        return PtyWire(Path(link) if link else None)
    return TcpWire(int(kind.partition(":")[2]))
