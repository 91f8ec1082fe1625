"""One voter: an engine of its own that searches a position its own way, and tells what it found.

All search the same position with the same program. What makes them differ, so that their vote says more
than one of them does, is what each looked at before: voter i first searches what comes after the i-th of
a few promising moves, and keeps that in its table of positions when it turns to the position itself.
"""

from collections.abc import Mapping
from typing import Self

import chess
import chess.engine

from kempelen.core.errors import EngineError
from kempelen.engines.find import Shelf
from kempelen.engines.uci_wire import UciProcess
from kempelen.engines.voting import CANDIDATES, Effort, Vote, score_of
from kempelen.engines.wire import Findings, OptionValue, Patience


class Voter:
    """An engine process that votes; it is started with the first position, and again after a fault.

    Args:
        number: 0 searches the position alone; the others are warmed under candidates.
        engine: As for `Shelf.find`, which looks on the machine where the voter lives; it must speak UCI.
        options: Of the engine.
    """

    def __init__(self, number: int, engine: str, options: Mapping[str, OptionValue]) -> None:
        self._number = number
        self._engine = engine
        self._options = options
        self._process: UciProcess | None = None

    async def vote(self, start: str, moves: list[str], game: str, effort: Effort) -> Vote:
        """Search a position.

        Args:
            start: Of the game, as FEN.
            moves: Of the game so far, in UCI's notation.
            game: Another word for every game.
            effort: For everything that it searches.

        Raises:
            EngineError: The engine died, fell silent or named no legal move; the next call starts one anew.
        """
        board = chess.Board(start)
        for move in moves:
            board.push_uci(move)
        try:
            process = await self._running()
            return await self._search(process, board, game, effort)
        except BaseException:
            await self.close()
            raise

    async def ready(self) -> str:
        """Start the engine, if it does not run; its name."""
        return (await self._running()).name

    async def close(self) -> None:
        """End the engine."""
        process, self._process = self._process, None
        if process:
            await process.close(politely=False)

    async def __aenter__(self) -> Self:
        """Start the engine."""
        await self._running()
        return self

    async def __aexit__(self, *exc: object) -> None:
        """End it."""
        await self.close()

    async def _running(self) -> UciProcess:
        if self._process is None:
            program = Shelf.here().find(self._engine)
            process = await UciProcess.start(program.command, Patience())
            self._process = process
            offered = {name: value for name, value in self._options.items() if name in process.options}
            await process.configure({**offered, **program.options})
        return self._process

    async def _search(self, process: UciProcess, board: chess.Board, game: str, effort: Effort) -> Vote:
        listing, warming, rest = effort.split()
        if self._number and "MultiPV" in process.options:
            listed = await self._look(process, board, listing, game, lines=CANDIDATES)
            candidates = [line.line[0] for _, line in sorted(listed.lines.items()) if line.line]
            candidate = candidates[self._number % len(candidates)] if candidates else None
            if candidate:
                after = board.copy()
                after.push(candidate)
                if any(after.legal_moves):
                    await self._look(process, after, warming, game)
        else:
            rest = effort
        found = await self._look(process, board, rest, game)
        return _vote(found)

    async def _look(
        self, process: UciProcess, board: chess.Board, effort: Effort, game: str, *, lines: int = 1
    ) -> Findings:
        if "MultiPV" in process.options:
            process.look_for(lines)
        limit = chess.engine.Limit(time=effort.seconds, nodes=effort.nodes)
        return await process.search(board, limit, game, None)


def _vote(found: Findings) -> Vote:
    thinking = found.lines.get(1)
    if thinking is None:
        raise EngineError("it named a move without a thought")
    line = tuple(move.uci() for move in thinking.line) if thinking.line[:1] == (found.move,) else ()
    return Vote(found.move.uci(), score_of(thinking), thinking.depth, line)
