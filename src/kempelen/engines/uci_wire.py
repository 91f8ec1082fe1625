"""A running UCI process: python-chess speaks the protocol.

This module stands on both sides of it: in front, it lets only lines of the protocol through; behind, it turns
what was found into `Findings`.
"""

import asyncio
import dataclasses
import re
from collections.abc import Callable, Coroutine, Mapping
from typing import Any, Self

import chess
import chess.engine

from kempelen.core.errors import EngineError
from kempelen.core.protocols import OnThinking
from kempelen.engines.info import parse_info, parse_policy
from kempelen.engines.wire import (
    EngineProcess,
    Findings,
    Listening,
    NotSpokenError,
    OptionValue,
    Patience,
    not_started,
)

_PASSED_ON = frozenset({b"id", b"option", b"uciok", b"readyok", b"bestmove"})
_STRANGE = re.compile(rb"feature |.*\b(?:(?:illegal|invalid) move|unknown command)", re.IGNORECASE)
_MOMENT = 0.002  # s
_DOUBT = 2.0  # s of silence after which the other protocol's greeting is tried
_LAST_CHANCE = 0.5  # s for ``uciok`` after words of another protocol


class _Protocol(Listening, chess.engine.UciProtocol):
    """python-chess's protocol with our own way from bytes to lines."""

    def __init__(self) -> None:
        super().__init__()
        self.on_info: Callable[[str], None] | None = None
        self.on_strange: Callable[[], None] | None = None

    def sort(self, fd: int, line: bytes) -> None:
        word = line.partition(b" ")[0]
        if fd == 1 and word in _PASSED_ON:
            chess.engine.UciProtocol.pipe_data_received(self, fd, line + b"\n")
        elif fd == 1 and word == b"info":
            self._hear(line.decode("utf-8", "replace"))
        elif line:
            self.note(line)
            self._doubt(line)
        # An engine reports its own misery as "info string ERROR …": keep those words too.
        if line.startswith(b"info string") and b"error" in line.lower():
            self.note(line.removeprefix(b"info string"))

    def _doubt(self, line: bytes) -> None:
        if self.on_strange and _STRANGE.match(line):
            self.on_strange()

    def _hear(self, line: str) -> None:
        # What still comes in of a cancelled search, or of thinking in the opponent's time, belongs to another
        # position.
        searching = self.command is not None and self.command.state == chess.engine.CommandState.ACTIVE
        if self.on_info and searching:
            self.on_info(line)


class UciProcess(EngineProcess):
    """One process that has said ``uciok``; made by `start`, ended by `close`."""

    tongue = "uci"

    def __init__(
        self, protocol: _Protocol, transport: asyncio.SubprocessTransport, patience: Patience
    ) -> None:
        super().__init__(protocol, transport, patience)
        self._protocol = protocol

    @classmethod
    async def start(cls, command: tuple[str, ...], patience: Patience) -> Self:
        """Start the program and wait for ``uciok``.

        Raises:
            EngineError: It cannot be executed.
            NotSpokenError: It ends at once, or does not speak UCI.
        """
        try:
            transport, protocol = await _Protocol.popen(list(command), setpgrp=True)
        except OSError as error:
            raise not_started(command[0], error) from error
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

    async def configure(self, options: Mapping[str, OptionValue], *, lines: int = 1) -> None:
        """See the base class."""
        if lines > 1:
            self.look_for(lines)
        async with self._explained("became ready", self._patience.ready):
            await self._protocol.configure(dict(options))
            await self._protocol.ping()

    def look_for(self, lines: int) -> None:
        """How many lines the searches to come shall follow; it must offer MultiPV."""
        # python-chess sets MultiPV back to its default before each search: so make our number the default.
        offered = self._protocol.options["MultiPV"]
        self._protocol.options["MultiPV"] = dataclasses.replace(offered, default=lines)

    async def search(
        self,
        board: chess.Board,
        limit: chess.engine.Limit,
        game: object,
        on_thinking: OnThinking | None,
        *,
        ponder: bool = False,
    ) -> Findings:
        """See the base class."""
        findings = Findings()
        self._protocol.on_info = lambda line: _record(line, board, findings, on_thinking)
        try:
            async with self._explained("answered", (limit.time or 0.0) + self._patience.grace):
                played = await self._played(self._protocol.play(board, limit, game=game, ponder=ponder))
        finally:
            self._protocol.on_info = None
        if not played.move or played.move not in board.legal_moves:
            raise self._fault(f"it named no move although {board.legal_moves.count()} are legal")
        findings.move = played.move
        return findings

    async def _played(self, playing: Coroutine[Any, Any, chess.engine.PlayResult]) -> chess.engine.PlayResult:
        play = asyncio.ensure_future(playing)
        try:
            return await asyncio.shield(play)
        except asyncio.CancelledError:
            await self._begun()
            play.cancel()
            await asyncio.gather(play, return_exceptions=True)
            raise

    async def _begun(self) -> None:
        """Wait until the last search has begun.

        python-chess cannot cancel one that still waits for the end of thinking in the other side's time. An
        engine that does not end that is killed.
        """
        loop = asyncio.get_running_loop()
        end = loop.time() + self._patience.farewell
        while self._protocol.next_command is not None and not self._protocol.exited.is_set():
            if loop.time() > end:
                self._kill()
                await self._gone(self._patience.farewell)
                return
            await asyncio.sleep(_MOMENT)

    def _write(self, *lines: str) -> None:
        for line in lines:
            self._protocol.send_line(line)

    async def _hung_up(self) -> None:
        await asyncio.wait([self._protocol.returncode], timeout=self._patience.farewell)

    async def _greet(self) -> None:
        """Greet, and give up early where the program shows that it speaks something else."""
        loop, strange = asyncio.get_running_loop(), list[float]()
        doubt = loop.call_later(_DOUBT, self._protocol.send_line, "protover 2")
        try:
            deed = "said 'uciok', so it seems to be no UCI engine"
            async with self._explained(deed, self._patience.hello) as limit:
                end = limit.when() or loop.time()

                def doubt_it() -> None:
                    strange.append(loop.time())
                    limit.reschedule(min(end, loop.time() + _LAST_CHANCE))

                self._protocol.on_strange = doubt_it
                await self._protocol.initialize()
        except EngineError as error:
            early = self._fault("it has not said 'uciok', so it seems to be no UCI engine")
            raise NotSpokenError((early if strange else error).message) from error
        finally:
            doubt.cancel()
            self._protocol.on_strange = None


def _record(line: str, board: chess.Board, findings: Findings, on_thinking: OnThinking | None) -> None:
    if policy := parse_policy(line, board):
        findings.policy.update([policy])
    if (thought := parse_info(line, board)) is None:
        return
    findings.lines[thought.rank] = thought.thinking
    if on_thinking and thought.rank == 1:
        # Not called from within the transport: a fault in the listener must not break the wire.
        asyncio.get_running_loop().call_soon(on_thinking, thought.thinking)
