"""Tables without physics that play by themselves, as many as wanted in one process: a hall to look at."""

import asyncio
import random
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Self

import chess

from kempelen.app.table_status import TableStatus
from kempelen.core.protocols import OnThinking
from kempelen.core.table import Table, start_layout
from kempelen.game.arbiter import Arbiter
from kempelen.game.journal import Journal
from kempelen.game.modes import Mode, Pairing
from kempelen.game.opening import new_game
from kempelen.game.players import Proposal, Propose
from kempelen.game.records import PlayerSpec
from kempelen.nodes.link import Link
from kempelen.robots.hand import CartesianHand
from kempelen.twin.light import LightRobot, LightTable

_THINKING_S = (0.5, 4.0)
_SOON_S = 1.0
"""Many tables share one processor: each tells at most this often."""


class Passer:
    """A player who plays anything legal, after a while.

    Args:
        name: For the score.
        rng: What is played, and when.
        thinking: (least, most) s.
    """

    def __init__(self, name: str, rng: random.Random, *, thinking: tuple[float, float] = _THINKING_S) -> None:
        self._rng = rng
        self._thinking = thinking
        self.spec = PlayerSpec(kind="passer", name=name)

    async def propose(self, board: chess.Board, on_thinking: OnThinking) -> Proposal:
        """A legal move."""
        del on_thinking
        await asyncio.sleep(self._rng.uniform(*self._thinking))
        return Propose(self._rng.choice(list(board.legal_moves)))

    async def answer_draw(self, board: chess.Board) -> bool:
        """Never."""
        del board
        return False


class LightTableRun:
    """One table: its robot, its arbiter, its games one after another. Async context manager.

    Args:
        link: Entered.
        name: Of the table.
        folder: For its journal.
        seed: Of everything random.
        pace: Seconds of motion for each second of the clock.
    """

    def __init__(self, link: Link, name: str, folder: Path, *, seed: int = 0, pace: float = 1.0) -> None:
        self._link = link
        self._name = name
        self._folder = folder
        self._rng = random.Random(seed)  # noqa: S311 - games to look at, no secrets
        self._pace = pace
        self._stack = AsyncExitStack()
        self._status: TableStatus
        self._playing: asyncio.Task[None]

    async def __aenter__(self) -> Self:
        """Begin to play."""
        self._status = await self._stack.enter_async_context(
            TableStatus(self._link, self._name, soon=_SOON_S)
        )
        self._playing = asyncio.create_task(self._play())
        return self

    async def __aexit__(self, *exc: object) -> None:
        """The game is left."""
        self._playing.cancel()
        await asyncio.gather(self._playing, return_exceptions=True)
        await self._stack.aclose()

    async def _play(self) -> None:
        journal = self._stack.enter_context(Journal(self._folder / f"{self._name}.sqlite3"))
        players = (Passer(colour, self._rng) for colour in ("White", "Black"))
        pairing = Pairing(Mode.WATCH, *players)
        while True:
            table = Table()
            world = LightTable(table, start_layout(table, chess.Board()))
            async with LightRobot(table, world, pace=self._pace) as robot:
                log = new_game(journal, pairing, table)
                arbiter = Arbiter(log, CartesianHand(robot, table), pairing, table)
                arbiter.events.listen(self._status.hear)
                await arbiter.run()
