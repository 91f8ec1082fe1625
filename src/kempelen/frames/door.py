"""Where a ring's two sides meet: a Unix socket by name.

The socket carries the memory's descriptor to the reader, a byte for each new frame, and, as its end, the
news that the other side is gone: from the kernel and at once, however it went. The memory itself has no
name (``memfd``): it lives as long as somebody has it open, so a killed program leaves nothing behind and
nothing has to be swept up. Nor is its size limited by /dev/shm, which is small in containers.

The socket's name is an abstract one (Linux), which is gone with its owner as well.
"""

import os
import selectors
import socket
import struct
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from kempelen.core.errors import CameraError
from kempelen.frames.layout import READERS

_GREETING_S = 5.0
_RETRY_S = 0.02
_GREETING = struct.Struct("<q")
_FULL = -1
_CREDENTIALS = struct.Struct("3i")  # pid, uid, gid
_WAKE = b"\0"
_LONGEST_NAME = 80  # an address holds 107 bytes


def address(name: str) -> str:
    """Of the socket; a user's rings are his own.

    Raises:
        CameraError: not a name.
    """
    if not 0 < len(name.encode()) <= _LONGEST_NAME or not name.isprintable():
        raise CameraError(
            f"{name!r} is no name of a ring: wanted are 1 to {_LONGEST_NAME} printable bytes.",
            hint="Choose a shorter name, such as kempelen-twin.",
        )
    return f"\0kempelen-ring-{os.getuid()}-{name}"


def peer(connection: socket.socket) -> tuple[int, int]:
    """Process and user at the other end."""
    raw = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    pid, uid, _ = _CREDENTIALS.unpack(raw)
    return pid, uid


class Door:
    """The writer's side: lets readers in, notices when they are gone, wakes them.

    Args:
        name: Of the ring.
        memory: Descriptor that readers get.
        left: Called with the row of a reader who is gone, from a thread of the door's own.

    Raises:
        CameraError: another program writes to a ring of this name.
    """

    def __init__(self, name: str, memory: int, left: Callable[[int], None]) -> None:
        self._memory = memory
        self._left = left
        self._listener = _listen(name)
        self._readers: dict[int, socket.socket] = {}
        self._lock = threading.Lock()
        self._ear, self._mouth = socket.socketpair()
        self._thread = threading.Thread(target=self._serve, name=f"ring {name}", daemon=True)
        self._thread.start()

    @property
    def readers(self) -> int:
        """How many are attached."""
        return len(self._readers)

    def wake(self) -> None:
        """Tell all readers that there is something new; never waits."""
        with self._lock:
            for reader in self._readers.values():
                with suppress(OSError):  # gone, or so many bytes behind that it is awake anyway
                    reader.send(_WAKE, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)

    def close(self) -> None:
        """Send everybody away."""
        self._mouth.close()
        self._thread.join()
        for each in (self._listener, self._ear, *self._readers.values()):
            each.close()
        self._readers.clear()

    def _serve(self) -> None:
        """Until the mouth is closed."""
        with selectors.DefaultSelector() as selector:
            selector.register(self._ear, selectors.EVENT_READ)
            selector.register(self._listener, selectors.EVENT_READ)
            while True:
                for key, _ in selector.select():
                    if key.fileobj is self._ear:
                        return
                    if key.fileobj is self._listener:
                        self._welcome(selector)
                    else:
                        self._see_off(selector, key)

    def _welcome(self, selector: selectors.BaseSelector) -> None:
        try:
            visitor, _ = self._listener.accept()
        except OSError:
            return  # gone again
        if peer(visitor)[1] != os.getuid():
            visitor.close()
            return
        row = next((row for row in range(READERS) if row not in self._readers), _FULL)
        try:
            socket.send_fds(visitor, [_GREETING.pack(row)], [] if row == _FULL else [self._memory])
        except OSError:
            row = _FULL
        if row == _FULL:
            visitor.close()
            return
        with self._lock:
            self._readers[row] = visitor
        selector.register(visitor, selectors.EVENT_READ, row)

    def _see_off(self, selector: selectors.BaseSelector, key: selectors.SelectorKey) -> None:
        """Readers never send: to be readable is to be gone."""
        selector.unregister(key.fileobj)
        with self._lock:
            self._readers.pop(key.data).close()
        self._left(key.data)


def _listen(name: str) -> socket.socket:
    where = address(name)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        listener.bind(where)
        listener.listen(READERS)
    except OSError as error:
        listener.close()
        raise CameraError(
            f"The ring '{name}' cannot be opened for writing: {error.strerror}.",
            hint="Another program writes to a ring of this name: end it, or choose another name.",
        ) from None
    return listener


def enter(name: str, patience: float) -> tuple[socket.socket, int, int]:
    """The reader's side: the open socket, the memory's descriptor, and the row that is ours.

    Args:
        name: Of the ring.
        patience: s to wait for a writer that is still starting.

    Raises:
        CameraError: nobody writes to a ring of that name, or it has readers enough.
    """
    deadline = time.monotonic() + patience
    while True:
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            connection.connect(address(name))
            return connection, *_greeted(connection, name)
        except OSError as error:
            connection.close()
            if time.monotonic() >= deadline:
                raise CameraError(
                    f"Nobody writes to a ring named '{name}': {error.strerror or error}.",
                    hint="Start the camera or the twin first, and check the name.",
                ) from None
        except BaseException:
            connection.close()
            raise
        time.sleep(_RETRY_S)


def _greeted(connection: socket.socket, name: str) -> tuple[int, int]:
    """Descriptor and row."""
    connection.settimeout(_GREETING_S)
    message, descriptors, _, _ = socket.recv_fds(connection, _GREETING.size, 1)
    connection.settimeout(0.0)
    if len(message) != _GREETING.size:
        raise ConnectionResetError(0, "its writer ended at this moment")
    (row,) = _GREETING.unpack(message)
    if row == _FULL or not descriptors:
        raise CameraError(
            f"The ring '{name}' has {READERS} readers already; more is not allowed.",
            hint="End one of them.",
        )
    return descriptors[0], row
