"""Light robots at nodes in other processes, for tests: on loopback, or in a network namespace."""

import asyncio
import json
import socket
import sys
from types import TracebackType
from typing import Any, Self

_START_S = 40.0


def free_endpoint(kind: str = "tcp", host: str = "127.0.0.1") -> str:
    """One that nobody listens to."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return f"{kind}/{host}:{server.getsockname()[1]}"


class Elsewhere:
    """Async context manager: `kempelen.testing.node_process` in a process of its own.

    Args:
        wanted: For it.
        before: Words before its command, such as ``ip netns exec NAME``.
    """

    def __init__(self, before: tuple[str, ...] = (), **wanted: Any) -> None:
        self._wanted = wanted
        self._before = before
        self._process: asyncio.subprocess.Process

    async def __aenter__(self) -> Self:
        """It is there."""
        self._process = await asyncio.create_subprocess_exec(
            *self._before, sys.executable, "-m", "kempelen.testing.node_process", json.dumps(self._wanted),
            stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
        )  # fmt: skip
        try:
            async with asyncio.timeout(_START_S):
                await self._line()
        except BaseException:
            await self.__aexit__(None, None, None)
            raise
        return self

    async def __aexit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """It ends with its input."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        await self._process.wait()

    async def _line(self) -> str:
        line = await self._process.stdout.readline() if self._process.stdout else b""
        return line.decode().strip()

    async def told(self, pace: float | None = None) -> dict[str, Any]:
        """What became of its table: pieces, carried, faults, held, phase.

        Args:
            pace: Of its robot from now on.
        """
        if self._process.stdin is not None:
            self._process.stdin.write(f"{'' if pace is None else pace}\n".encode())
        told: dict[str, Any] = json.loads(await self._line())
        return told
