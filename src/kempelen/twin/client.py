"""The parent's side of a twin: start the process, talk through its side door, end it."""

import asyncio
import itertools
import json
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

from kempelen.core.errors import TwinError
from kempelen.twin.spec import TwinSpec

_START_S = 60.0
_ANSWER_S = 120.0
_END_S = 30.0


class TwinControl:
    """A connection to a twin's control socket. Async context manager.

    One request is answered after the other: who looks on while the virtual person works needs a connection of
    its own (`beside`).

    Args:
        path: Of the socket.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._numbers = itertools.count(1)
        self._lock = asyncio.Lock()

    def beside(self) -> "TwinControl":
        """A further connection to the same twin, to be entered."""
        return TwinControl(self._path)

    async def __aenter__(self) -> Self:
        """Connect.

        Raises:
            TwinError: nothing listens there.
        """
        try:
            self._reader, self._writer = await asyncio.open_unix_connection(str(self._path), limit=1 << 22)
        except OSError as error:
            raise TwinError(
                f"No twin answers at {self._path}: {error.strerror or error}.",
                hint="Start one: kempelen twin --control PATH",
            ) from None
        return self

    async def __aexit__(self, *_exc: object) -> None:
        """Hang up."""
        self._writer.close()
        with suppress(OSError):
            await self._writer.wait_closed()

    async def ask(self, op: str, **arguments: object) -> Mapping[str, Any]:
        """One request, one answer.

        Raises:
            TwinError: the twin refused, died or did not answer.
        """
        number = next(self._numbers)
        request = json.dumps({"id": number, "op": op, **arguments}).encode() + b"\n"
        try:
            async with self._lock, asyncio.timeout(_ANSWER_S):
                self._writer.write(request)
                await self._writer.drain()
                reply = await self._reply(number)
        except (TimeoutError, OSError) as error:
            raise TwinError(
                f"The twin gave no answer to '{op}': {error!r}.", hint="Start it again."
            ) from None
        if reply is None:
            raise TwinError(f"The twin ended before it answered '{op}'.", hint="Start it again.")
        if not reply["ok"]:
            raise TwinError(f"The twin refused '{op}': {reply['error']}.", hint="Check the request.")
        return reply

    async def _reply(self, number: int) -> dict[str, Any] | None:
        """The answer to a request; answers to those that were cancelled before it are passed over."""
        while line := await self._reader.readline():
            reply: dict[str, Any] = json.loads(line)
            if reply["id"] == number:
                return reply
        return None


class Door(Protocol):
    """`TwinControl`, or what reaches one over a network."""

    def beside(self) -> "Door":
        """A further way to the same twin, to be entered."""
        ...

    async def __aenter__(self) -> Self:
        """Connect."""
        ...

    async def __aexit__(self, *exc: object) -> None:
        """Let go of it."""
        ...

    async def ask(self, op: str, **arguments: Any) -> Mapping[str, Any]:
        """One request, one answer.

        Raises:
            KempelenError: there was none, or it was refused.
        """
        ...


class TwinProcess:
    """A twin of our own. Async context manager: starts the process, ends it, keeps its state if told to.

    Args:
        spec: What to simulate.

    Attributes:
        address: Where the driver connects.
        rings: Names of the rings that hold the cameras' frames, in the spec's order.
        reed: Where the reed board's driver connects; empty where there is none.
        control: The side door.
    """

    def __init__(self, spec: TwinSpec) -> None:
        self._spec = spec
        self.address = self.reed = ""
        self.rings: tuple[str, ...] = ()
        self.control = TwinControl(Path(spec.control))

    async def __aenter__(self) -> Self:
        """Start and wait until the wire is there.

        Raises:
            TwinError: it did not come up; the message holds the reason.
        """
        self._process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "kempelen.twin",
            stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, start_new_session=True,
        )  # fmt: skip
        try:
            answer = await self._greeting()
            self.address, self.rings = str(answer["address"]), tuple(answer.get("rings", ()))
            self.reed = str(answer.get("reed", ""))
            await self.control.__aenter__()
        except BaseException:
            await self._end()
            raise
        return self

    @property
    def ring(self) -> str:
        """Of the first camera.

        Raises:
            TwinError: the twin has none.
        """
        if not self.rings:
            raise TwinError("The twin has no camera.", hint="Give its spec one: cameras=(CameraSpec(),).")
        return self.rings[0]

    async def _greeting(self) -> Mapping[str, Any]:
        stdin, stdout = self._process.stdin, self._process.stdout
        if stdin is None or stdout is None:
            raise TwinError("The twin's pipes are missing.", hint="Start it again.")
        line = b""
        with suppress(TimeoutError, OSError):
            async with asyncio.timeout(_START_S):
                stdin.write(self._spec.model_dump_json().encode() + b"\n")
                await stdin.drain()
                line = await stdout.readline()
        answer: dict[str, Any] = json.loads(line) if line else {"error": "it ended without a word"}
        if "error" in answer:
            raise TwinError(f"The twin did not start: {answer['error']}", hint="Run `kempelen doctor`.")
        return answer

    async def __aexit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """End it; it finishes what its controller had in its buffer and keeps the table."""
        await self.control.__aexit__()
        await self._end()

    async def _end(self) -> None:
        process = self._process
        if process.stdin is not None:
            process.stdin.close()
        try:
            async with asyncio.timeout(_END_S):
                await process.wait()
        except TimeoutError:
            process.kill()
            await process.wait()
