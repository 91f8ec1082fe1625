"""One running engine process, whatever protocol it speaks: started, asked, ended without residue.

What is common to both protocols stands here: lines instead of bytes, so that nothing an engine prints can
reach the terminal or grow without bound; every fault of the process as an `EngineError` with the engine's
last words; and an end that leaves no process, pipe or task.
"""

import asyncio
import errno
import os
import re
import signal
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

import chess
import chess.engine

from kempelen.core.errors import EngineError
from kempelen.core.protocols import OnThinking, Thinking

OptionValue = str | int | bool
_LONGEST_LINE = 1 << 20  # bytes; a line of 500 principal variations is far shorter
_TAIL_LINES, _TAIL_WIDTH = 4, 160
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")


@dataclass(frozen=True, slots=True)
class Patience:
    """How long an engine may be silent, s, and how often it is started again for one move.

    Attributes:
        hello: From the start of the process to its greeting.
        ready: From the options to the engine being ready; large networks are loaded here.
        grace: For the move, beyond the time it was given.
        farewell: From ``quit`` to the end of the process; killed afterwards.
        restarts: Per move.
    """

    hello: float = 15.0
    ready: float = 30.0
    grace: float = 5.0
    farewell: float = 1.0
    restarts: int = 2


@dataclass(slots=True)
class Findings:
    """What one search brought to light.

    Attributes:
        move: Legal in the searched position.
        lines: The last thought for each line of MultiPV, by its number from 1.
        policy: Probability of each move as the network sees it; empty where the engine does not tell.
        resigns: The engine gives the game up.
        offers_draw: It offers a draw with its move.
    """

    move: chess.Move = field(default_factory=chess.Move.null)
    lines: dict[int, Thinking] = field(default_factory=dict)
    policy: dict[chess.Move, float] = field(default_factory=dict)
    resigns: bool = False
    offers_draw: bool = False


class NotSpokenError(EngineError):
    """The program does not speak the protocol in which it was greeted."""


class Listening:
    """The near end of an engine's pipes: bytes to lines, and the last words of the dead."""

    def __init__(self) -> None:
        super().__init__()
        self.exited = asyncio.Event()
        self.tail: deque[str] = deque(maxlen=_TAIL_LINES)
        self._partial = {1: b"", 2: b""}

    def process_exited(self) -> None:
        """Called by the transport."""
        self.exited.set()

    def pipe_data_received(self, fd: int, data: bytes | str) -> None:
        """Called by the transport."""
        raw = data if isinstance(data, bytes) else data.encode()
        *lines, self._partial[fd] = (self._partial[fd] + raw).split(b"\n")
        if len(self._partial[fd]) > _LONGEST_LINE:
            self._partial[fd] = b""
        for line in lines:
            self.sort(fd, line.strip())

    def sort(self, fd: int, line: bytes) -> None:
        """What to do with a whole line; ``fd`` is 1 for the output, 2 for errors."""
        raise NotImplementedError

    def note(self, line: bytes) -> None:
        """Keep the engine's last words for an error message."""
        words = _COLOURS.sub("", line[: 4 * _TAIL_WIDTH].decode("utf-8", "replace")).strip()
        self.tail.append("".join(c if c.isprintable() else " " for c in words)[:_TAIL_WIDTH])


class EngineProcess(ABC):
    """One process that has greeted; ended by `close`.

    Attributes:
        apart: Its strength is limited by judging every move by itself, as it offers nothing better.
    """

    tongue = ""
    apart = False

    def __init__(
        self, listener: Listening, transport: asyncio.SubprocessTransport, patience: Patience
    ) -> None:
        self._listener = listener
        self._transport = transport
        self._patience = patience

    @property
    @abstractmethod
    def name(self) -> str:
        """As the engine calls itself; empty when it does not."""

    @property
    @abstractmethod
    def options(self) -> Mapping[str, chess.engine.Option]:
        """The options that the engine offers, by name."""

    @property
    def pid(self) -> int:
        """Of the process, for messages and tests."""
        return self._transport.get_pid()

    @abstractmethod
    async def configure(self, options: Mapping[str, OptionValue], *, lines: int = 1) -> None:
        """Set options, and wait until the engine is ready.

        Args:
            options: By name; the engine must offer each.
            lines: MultiPV for the searches to come.

        Raises:
            EngineError: A value is out of its range, or the engine dies or falls silent.
        """

    @abstractmethod
    async def search(
        self,
        board: chess.Board,
        limit: chess.engine.Limit,
        game: object,
        on_thinking: OnThinking | None,
        *,
        ponder: bool = False,
    ) -> Findings:
        """Search a position.

        Cancelled, it tells the engine to stop, and the process stays fit for the next search.

        Args:
            board: With the moves that led to it; not changed.
            limit: Without a time the engine has the grace alone.
            game: The same object for the moves of one game; with another one the engine is told so.
            on_thinking: Called in the loop with each new thought about the best line.
            ponder: Afterwards the engine goes on thinking in the opponent's time, until the next search.

        Raises:
            EngineError: It died, fell silent, or answered with no legal move.
        """

    @abstractmethod
    def _write(self, *lines: str) -> None:
        """Send lines."""

    async def close(self, *, politely: bool = True) -> None:
        """End the process: by ``quit`` where it listens, else by force. Safe to call at any time."""
        try:
            if politely and not self._listener.exited.is_set():
                self._write("quit")
                await self._gone(self._patience.farewell)
        finally:
            await self._end()

    async def _end(self) -> None:
        try:
            if not self._listener.exited.is_set():
                self._kill()
            # The exit must be noticed before the transport is closed: closing polls the process itself, and
            # whoever comes second finds no child any more.
            await self._gone(self._patience.farewell)
        finally:
            self._transport.close()
        await self._hung_up()

    @abstractmethod
    async def _hung_up(self) -> None:
        """Wait until the pipes are closed, too; at most the farewell."""

    async def _gone(self, seconds: float) -> None:
        try:
            async with asyncio.timeout(seconds):
                await self._listener.exited.wait()
        except TimeoutError:
            return

    def _kill(self) -> None:
        """Kill the process and what it started: it leads a process group of its own."""
        try:
            os.killpg(self.pid, signal.SIGKILL)
        except ProcessLookupError:
            return

    @asynccontextmanager
    async def _explained(self, deed: str, seconds: float) -> AsyncIterator[asyncio.Timeout]:
        """A time limit; the engine's faults become an `EngineError`, with its own last words."""
        try:
            async with asyncio.timeout(seconds) as limit:
                yield limit
        except TimeoutError as silence:
            raise self._fault(f"it has not {deed} within {seconds:g} s") from silence
        except chess.engine.EngineTerminatedError as error:
            code = self._transport.get_returncode()
            raise self._fault(f"it ended with exit code {code} before it had {deed}") from error
        except chess.engine.EngineError as error:
            raise self._fault(f"python-chess refused what it said: {error}") from error

    def _fault(self, what: str) -> EngineError:
        words = " | ".join(self._listener.tail)
        return EngineError(f"{what}; its last words: {words}" if words else what)


def not_started(program: str, error: OSError) -> EngineError:
    """Why a program could not be executed, and what to do about it."""
    if isinstance(error, PermissionError):
        return EngineError(f"{program} is not executable.", hint=f"Allow it: chmod +x {program}")
    if error.errno == errno.ENOEXEC:
        return EngineError(
            f"{program} is no program that this machine can run.",
            hint="Name an engine built for this system.",
        )
    if isinstance(error, FileNotFoundError):
        return EngineError(f"{program} or the interpreter it names does not exist.", hint="Check the path.")
    return EngineError(f"{program} cannot be started: {error.strerror or error}.", hint="Check the program.")
