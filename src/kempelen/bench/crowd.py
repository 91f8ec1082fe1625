"""The crowd of `kempelen.bench.spectators`: ``python -m kempelen.bench.crowd ORIGIN CLIENTS SECONDS``.

Prints what it has measured as JSON. Its clients do no more than take messages and look at their time.
"""

import asyncio
import base64
import json
import os
import re
import socket
import sys
import time
from dataclasses import asdict, dataclass, field
from urllib.parse import urlsplit

from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

_MOVED_AT = re.compile(r'"moved_at":([0-9.]+)')
_HEAD = 120
"""Characters of a message in which that stands."""
_FOLLOW = json.dumps(
    {"type": "follow", "topics": ["station", "robot", "game", "thinking", "activity", "prompts", "scene"]}
)
_JOIN_S = 0.01
_DEAF_BUFFER = 4096


@dataclass
class Crowd:
    """What all have seen together.

    Attributes:
        latencies: Of each message about something new, ms.
        connected: Clients that had a snapshot.
        lost: Those that were cut off.
        deaf_closed: Whether the socket that never reads was closed by the server.
    """

    latencies: list[float] = field(default_factory=list)
    connected: int = 0
    lost: int = 0
    deaf_closed: bool = False


async def _look_on(origin: str, crowd: Crowd, until: float) -> None:
    url = f"{origin.replace('http', 'ws', 1)}/api/ws"
    try:
        async with (
            connect(url, proxy=None, compression=None, max_queue=256) as page,
            asyncio.timeout_at(until),
        ):
            await page.send(_FOLLOW)
            await page.recv()
            crowd.connected += 1
            async for message in page:
                found = _MOVED_AT.search(str(message)[:_HEAD])
                if found is not None:
                    crowd.latencies.append(1000 * (time.time() - float(found[1])))
            crowd.lost += 1
    except TimeoutError:
        return
    except (OSError, WebSocketException):
        crowd.lost += 1


async def _never_read(origin: str, crowd: Crowd, until: float) -> None:
    """Follows everything and reads nothing; that it was closed shows when it writes."""
    parts = urlsplit(origin)
    plug = socket.socket()
    plug.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _DEAF_BUFFER)
    plug.setblocking(False)  # noqa: FBT003 - the library's
    loop = asyncio.get_running_loop()
    with plug:
        await loop.sock_connect(plug, (parts.hostname, parts.port))
        key = base64.b64encode(os.urandom(16)).decode()
        await loop.sock_sendall(
            plug,
            f"GET /api/ws HTTP/1.1\r\nHost: {parts.netloc}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode(),
        )
        await asyncio.sleep(1.0)
        follow, mask = _FOLLOW.encode(), b"\0\0\0\0"
        await loop.sock_sendall(plug, bytes((0x81, 0x80 | len(follow))) + mask + follow)
        while loop.time() < until + 30:
            await asyncio.sleep(0.5)
            try:
                await loop.sock_sendall(plug, bytes((0x8A, 0x80)) + mask)  # a pong that nobody asked for
            except OSError:
                crowd.deaf_closed = True
                return


async def look_on(origin: str, clients: int, seconds: float) -> Crowd:
    """All of them, until the time is over."""
    crowd, until = Crowd(), asyncio.get_running_loop().time() + seconds
    async with asyncio.TaskGroup() as group:
        group.create_task(_never_read(origin, crowd, until))
        for _ in range(clients):
            group.create_task(_look_on(origin, crowd, until))
            await asyncio.sleep(_JOIN_S)
    return crowd


if __name__ == "__main__":
    result = asyncio.run(look_on(sys.argv[1], int(sys.argv[2]), float(sys.argv[3])))
    sys.stdout.write(json.dumps(asdict(result)))
