"""Control messages between a camera's process and its owner: one line of JSON each, over a socket.

======== ======================================= ============================================
sent by  kind                                    fields
======== ======================================= ============================================
owner    ``open``: first of all                  factory, options, slots, first
owner    ``options``: which are in force?
owner    ``close``: end
camera   ``opened``: there are frames            ring, name
camera   ``options``                             whatever the driver tells
camera   ``status``: each second                 frames, dropped, lost
camera   ``error``: and the process ends         message, hint
camera   ``ended``: the recording has ended
======== ======================================= ============================================

The end of the socket is the end of the other side.
"""

import asyncio
import json
import socket
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

_LONGEST = 1 << 20
_CHUNK = 1 << 16


@dataclass(frozen=True, slots=True)
class Message:
    """One line."""

    kind: str
    fields: Mapping[str, Any] = field(default_factory=dict)

    def encode(self) -> bytes:
        """As it is sent."""
        return json.dumps({"kind": self.kind, **self.fields}).encode() + b"\n"

    @classmethod
    def decode(cls, line: bytes) -> "Message":
        """As it was sent.

        Raises:
            ValueError: not a message.
        """
        fields = json.loads(line)
        if not isinstance(fields, dict) or not isinstance(kind := fields.pop("kind", None), str):
            raise ValueError(f"not a message: {line[:80]!r}")  # noqa: TRY004 - its value is what is wrong
        return cls(kind, fields)


class Channel:
    """The camera's end: blocking; one thread may send while another receives.

    Args:
        connection: An open socket, ours from now on.
    """

    def __init__(self, connection: socket.socket) -> None:
        self._socket = connection
        self._left = b""

    def send(self, kind: str, **fields: object) -> None:
        """Nothing is said to an owner who has gone: ``receive`` tells of that.

        Args:
            kind: Of the message.
            **fields: Its contents.
        """
        try:
            self._socket.sendall(Message(kind, fields).encode())
        except (BrokenPipeError, ConnectionResetError):
            return

    def receive(self) -> Message | None:
        """The next message; None when the owner has gone."""
        while b"\n" not in self._left:
            try:
                more = self._socket.recv(_CHUNK)
            except ConnectionResetError:
                return None
            if not more:
                return None
            self._left += more
        line, _, self._left = self._left.partition(b"\n")
        return Message.decode(line)

    def close(self) -> None:
        """Hang up; whoever is receiving is told that the other side has gone."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()


class OwnerChannel:
    """The owner's end, for asyncio."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer

    @classmethod
    async def over(cls, connection: socket.socket) -> "OwnerChannel":
        """Over an open socket, which belongs to the channel from now on."""
        return cls(*await asyncio.open_unix_connection(sock=connection, limit=_LONGEST))

    def send(self, kind: str, **fields: object) -> None:
        """Messages are few and short: they are buffered.

        Args:
            kind: Of the message.
            **fields: Its contents.
        """
        if not self._writer.is_closing():
            self._writer.write(Message(kind, fields).encode())

    async def receive(self) -> Message | None:
        """The next message; None when the camera's process has gone."""
        try:
            line = await self._reader.readline()
        except ConnectionResetError:
            return None
        return Message.decode(line) if line.endswith(b"\n") else None

    async def close(self) -> None:
        """Hang up."""
        self._writer.close()
        with suppress(BrokenPipeError, ConnectionResetError):
            await self._writer.wait_closed()
