"""One running UCI process: started, asked, ended without residue.

python-chess speaks the protocol. This module stands on both sides of it: in front, it turns the engine's
bytes into lines and lets only lines of the protocol through, so that nothing an engine prints can reach the
terminal or grow without bound; behind, it turns every fault of the process into an `EngineError` and leaves
no process, pipe or task.
"""

import asyncio
import dataclasses
import errno
import os
import re
import signal
from collections import deque
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Self

import chess
import chess.engine

from kempelen.core.errors import EngineError
from kempelen.core.protocols import OnThinking, Thinking
from kempelen.engines.info import parse_info, parse_policy

OptionValue = str | int | bool
_PASSED_ON = frozenset({b"id", b"option", b"uciok", b"readyok", b"bestmove"})
_LONGEST_LINE = 1 << 20  # bytes; a line of 500 principal variations is far shorter
_TAIL_LINES, _TAIL_WIDTH = 4, 160
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")


@dataclass(frozen=True, slots=True)
class Patience:
    """How long an engine may be silent, s, and how often it is started again for one move.

    Attributes:
        hello: From the start of the process to ``uciok``.
        ready: From the options to ``readyok``; large networks are loaded here.
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
    """

    move: chess.Move = field(default_factory=chess.Move.null)
    lines: dict[int, Thinking] = field(default_factory=dict)
    policy: dict[chess.Move, float] = field(default_factory=dict)


class _Protocol(chess.engine.UciProtocol):
    """python-chess's protocol with our own way from bytes to lines."""

    def __init__(self) -> None:
        super().__init__()
        self.exited = asyncio.Event()
        self.tail: deque[str] = deque(maxlen=_TAIL_LINES)
        self.on_info: Callable[[str], None] | None = None
        self._partial = {1: b"", 2: b""}

    def process_exited(self) -> None:
        self.exited.set()

    def pipe_data_received(self, fd: int, data: bytes | str) -> None:
        raw = data if isinstance(data, bytes) else data.encode()
        *lines, self._partial[fd] = (self._partial[fd] + raw).split(b"\n")
        if len(self._partial[fd]) > _LONGEST_LINE:
            self._partial[fd] = b""
        for line in lines:
            self._sort(fd, line.strip())

    def _sort(self, fd: int, line: bytes) -> None:
        word = line.partition(b" ")[0]
        if fd == 1 and word in _PASSED_ON:
            super().pipe_data_received(fd, line + b"\n")
        elif fd == 1 and word == b"info":
            self._hear(line.decode("utf-8", "replace"))
        elif line:
            self.note(line)
        # An engine reports its own misery as "info string ERROR …": keep those words too.
        if line.startswith(b"info string") and b"error" in line.lower():
            self.note(line.removeprefix(b"info string"))

    def _hear(self, line: str) -> None:
        # What still comes in of a cancelled search belongs to another position.
        searching = self.command is not None and self.command.state == chess.engine.CommandState.ACTIVE
        if self.on_info and searching:
            self.on_info(line)

    def note(self, line: bytes) -> None:
        """Keep the engine's last words for an error message."""
        words = _COLOURS.sub("", line[: 4 * _TAIL_WIDTH].decode("utf-8", "replace")).strip()
        self.tail.append("".join(c if c.isprintable() else " " for c in words)[:_TAIL_WIDTH])


class EngineProcess:
    """One process that has said ``uciok``; made by `start`, ended by `close`."""

    def __init__(
        self, protocol: _Protocol, transport: asyncio.SubprocessTransport, patience: Patience
    ) -> None:
        self._protocol = protocol
        self._transport = transport
        self._patience = patience

    @classmethod
    async def start(cls, command: tuple[str, ...], patience: Patience) -> Self:
        """Start the program and wait for ``uciok``.

        Raises:
            EngineError: It cannot be executed, ends at once, or does not speak UCI.
        """
        try:
            transport, protocol = await _Protocol.popen(list(command), setpgrp=True)
        except OSError as error:
            raise _not_started(command[0], error) from error
        process = cls(protocol, transport, patience)
        try:
            await process._greet()
        except BaseException:
            await process.close(politely=False)
            raise
        return process

    @property
    def name(self) -> str:
        """As the engine calls itself; empty when it does not."""
        return self._protocol.id.get("name", "")

    @property
    def options(self) -> Mapping[str, chess.engine.Option]:
        """The options that the engine offers, by name, in any case."""
        return self._protocol.options

    @property
    def pid(self) -> int:
        """Of the process, for messages and tests."""
        return self._transport.get_pid()

    async def configure(self, options: Mapping[str, OptionValue], *, lines: int = 1) -> None:
        """Set options, and wait until the engine is ready.

        Args:
            options: By name; the engine must offer each.
            lines: MultiPV for the searches to come.

        Raises:
            EngineError: A value is out of its range, or the engine dies or falls silent.
        """
        if lines > 1:
            # python-chess sets MultiPV back to its default before each search: so make our number the
            # default.
            offered = self._protocol.options["MultiPV"]
            self._protocol.options["MultiPV"] = dataclasses.replace(offered, default=lines)
        async with self._explained("became ready", self._patience.ready):
            await self._protocol.configure(dict(options))
            await self._protocol.ping()

    async def search(
        self, board: chess.Board, limit: chess.engine.Limit, game: object, on_thinking: OnThinking | None
    ) -> Findings:
        """Search a position.

        Cancelled, it tells the engine to stop, and the process stays fit for the next search.

        Args:
            board: With the moves that led to it; not changed.
            limit: Without a time the engine has the grace alone.
            game: The same object for the moves of one game; with another one the engine is told
                ``ucinewgame``.
            on_thinking: Called in the loop with each new thought about the best line.

        Raises:
            EngineError: It died, fell silent, or answered with no legal move.
        """
        findings = Findings()
        self._protocol.on_info = lambda line: _record(line, board, findings, on_thinking)
        try:
            async with self._explained("answered", (limit.time or 0.0) + self._patience.grace):
                played = await self._protocol.play(board, limit, game=game)
        finally:
            self._protocol.on_info = None
        if not played.move or played.move not in board.legal_moves:
            raise EngineError(f"it named no move although {board.legal_moves.count()} are legal")
        findings.move = played.move
        return findings

    async def close(self, *, politely: bool = True) -> None:
        """End the process: by ``quit`` where it listens, else by force. Safe to call at any time."""
        try:
            if politely and not self._protocol.exited.is_set():
                self._protocol.send_line("quit")
                await self._gone(self._patience.farewell)
        finally:
            await self._end()

    async def _end(self) -> None:
        try:
            if not self._protocol.returncode.done():
                self._kill()
            # The exit must be noticed before the transport is closed: closing polls the process itself, and
            # whoever comes second finds no child any more.
            await self._gone(self._patience.farewell)
        finally:
            self._transport.close()
        await asyncio.wait([self._protocol.returncode], timeout=self._patience.farewell)

    async def _gone(self, seconds: float) -> None:
        try:
            async with asyncio.timeout(seconds):
                await self._protocol.exited.wait()
        except TimeoutError:
            return

    def _kill(self) -> None:
        """Kill the process and what it started: it leads a process group of its own."""
        try:
            os.killpg(self.pid, signal.SIGKILL)
        except ProcessLookupError:
            return

    async def _greet(self) -> None:
        async with self._explained("said 'uciok', so it seems to be no UCI engine", self._patience.hello):
            await self._protocol.initialize()

    @asynccontextmanager
    async def _explained(self, deed: str, seconds: float) -> AsyncIterator[None]:
        """A time limit; the engine's faults become an `EngineError`, with its own last words."""
        try:
            async with asyncio.timeout(seconds):
                yield
        except TimeoutError as silence:
            raise self._fault(f"it has not {deed} within {seconds:g} s") from silence
        except chess.engine.EngineTerminatedError as error:
            code = self._transport.get_returncode()
            raise self._fault(f"it ended with exit code {code} before it had {deed}") from error
        except chess.engine.EngineError as error:
            raise self._fault(f"python-chess refused what it said: {error}") from error

    def _fault(self, what: str) -> EngineError:
        words = " | ".join(self._protocol.tail)
        return EngineError(f"{what}; its last words: {words}" if words else what)


def _not_started(program: str, error: OSError) -> EngineError:
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


def _record(line: str, board: chess.Board, findings: Findings, on_thinking: OnThinking | None) -> None:
    if policy := parse_policy(line, board):
        findings.policy.update([policy])
    if (thought := parse_info(line, board)) is None:
        return
    findings.lines[thought.rank] = thought.thinking
    if on_thinking and thought.rank == 1:
        # Not called from within the transport: a fault in the listener must not break the wire.
        asyncio.get_running_loop().call_soon(on_thinking, thought.thinking)
