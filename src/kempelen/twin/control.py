"""The twin's side door: ground truth for tests, reports and views, orders to the virtual person, faults.

A Unix socket with one JSON object a line: ``{"id": 1, "op": "truth"}`` is answered by ``{"id": 1, "ok": true,
...}`` or ``{"id": 1, "ok": false, "error": "..."}``. No driver, tracker or arbiter may use it (decision 1).
"""

import json
import select
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kempelen.core.errors import KempelenError, TwinError

Reply = dict[str, Any]
Handler = Callable[[Mapping[str, Any]], "Reply | Pending"]

_MAX_LINE = 1 << 20


@dataclass
class Pending:
    """An answer that is not ready yet: ``poll`` gives it, or None."""

    poll: Callable[[], Reply | None]


@dataclass
class _Client:
    sock: socket.socket
    buffer: bytes = b""
    pending: list[tuple[object, Pending]] = field(default_factory=list)


class ControlServer:
    """Answers requests between two steps of the loop.

    Args:
        path: Of the socket; a stale one is replaced.
        handlers: By operation name. A handler may raise KempelenError, KeyError, TypeError or ValueError.

    Raises:
        TwinError: the socket cannot be made.
    """

    def __init__(self, path: Path, handlers: Mapping[str, Handler]) -> None:
        self._handlers = handlers
        self._path = path
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        with suppress(FileNotFoundError):
            path.unlink()
        try:
            self._server.bind(str(path))
        except OSError as error:
            self._server.close()
            raise TwinError(
                f"The control socket {path} cannot be made: {error}.",
                hint="Choose a data folder with a shorter path (a socket's path has at most 107 characters).",
            ) from None
        path.chmod(0o600)
        self._server.listen(8)
        self._server.setblocking(False)  # noqa: FBT003 - the standard library's signature
        self._clients: list[_Client] = []

    def filenos(self) -> list[int]:
        """Descriptors worth waiting for."""
        return [self._server.fileno(), *(client.sock.fileno() for client in self._clients)]

    @property
    def waiting(self) -> bool:
        """Whether somebody waits for the world to go on."""
        return any(client.pending for client in self._clients)

    def serve(self) -> None:
        """Answer whatever has arrived or become ready."""
        if not (self.waiting or select.select(self.filenos(), [], [], 0.0)[0]):
            return
        with suppress(BlockingIOError):
            sock, _ = self._server.accept()
            sock.setblocking(False)  # noqa: FBT003 - the standard library's signature
            self._clients.append(_Client(sock))
        for client in list(self._clients):
            self._read(client)
            self._settle(client)

    def _read(self, client: _Client) -> None:
        try:
            data = client.sock.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data or len(client.buffer) > _MAX_LINE:
            client.sock.close()
            self._clients.remove(client)
            return
        *lines, client.buffer = (client.buffer + data).split(b"\n")
        for line in lines:
            self._answer(client, line)

    def _answer(self, client: _Client, line: bytes) -> None:
        number: object = None
        try:
            request = json.loads(line)
            number = request.get("id")
            reply = self._handlers[request["op"]](request)
        except (KempelenError, KeyError, TypeError, ValueError, AttributeError) as error:
            self._send(client, number, {"ok": False, "error": f"{type(error).__name__}: {error}"})
            return
        if isinstance(reply, Pending):
            client.pending.append((number, reply))
        else:
            self._send(client, number, {"ok": True, **reply})

    def _settle(self, client: _Client) -> None:
        for entry in list(client.pending):
            number, pending = entry
            reply = pending.poll()
            if reply is not None:
                client.pending.remove(entry)
                self._send(client, number, {"ok": True, **reply})

    def _send(self, client: _Client, number: object, reply: Reply) -> None:
        data = json.dumps({"id": number, **reply}, allow_nan=False).encode() + b"\n"
        client.sock.settimeout(1.0)
        with suppress(OSError):
            client.sock.sendall(data)
        client.sock.setblocking(False)  # noqa: FBT003 - the standard library's signature

    def close(self) -> None:
        """Hang up on everybody."""
        for client in self._clients:
            client.sock.close()
        self._server.close()
        with suppress(FileNotFoundError):
            self._path.unlink()
