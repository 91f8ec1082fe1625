"""Tables without physics that play by themselves, as many as wanted in one process: a hall to look at."""

import asyncio
import random
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Self

import chess

from kempelen.app.narrate import sentence
from kempelen.core import events
from kempelen.core.protocols import OnThinking
from kempelen.core.table import Table, start_layout
from kempelen.game.arbiter import Arbiter
from kempelen.game.journal import Journal
from kempelen.game.modes import Mode, Pairing
from kempelen.game.opening import new_game
from kempelen.game.players import Proposal, Propose
from kempelen.game.records import PlayerSpec
from kempelen.nodes.link import Link
from kempelen.nodes.status import Status, stand_for, tell
from kempelen.robots.hand import CartesianHand
from kempelen.twin.light import LightRobot, LightTable

_THINKING_S = (0.5, 4.0)
_LIFE_S = 2.0
"""A table is heard of at least this often."""


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
        self._status = Status(table=name)
        self._tasks: list[asyncio.Task[None]] = []

    async def __aenter__(self) -> Self:
        """Begin to play."""
        await stand_for(self._link, self._name)
        self._tasks = [asyncio.create_task(self._play()), asyncio.create_task(self._live())]
        return self

    async def __aexit__(self, *exc: object) -> None:
        """The game is left."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
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
                arbiter.events.listen(self._note)
                await arbiter.run()

    async def _live(self) -> None:
        while True:
            await self._tell()
            await asyncio.sleep(_LIFE_S)

    async def _tell(self) -> None:
        self._status = self._status.model_copy(update={"count": self._status.count + 1})
        await tell(self._link, self._status)

    def _note(self, event: events.Event) -> None:
        if changes := status_after(event):
            self._status = self._status.model_copy(update=changes)


def status_after(event: events.Event) -> dict[str, object]:
    """What an event changes in a table's status."""
    changes: dict[str, object] = {}
    match event:
        case events.GameStarted():
            changes = {
                "game": event.game, "white": event.white, "black": event.black, "fen": event.fen,
                "ply": event.plies, "last": "", "result": "", "doing": "getting ready",
            }  # fmt: skip
        case events.TurnBegan():
            changes = {"doing": f"{event.player} thinks"}
        case events.CheckpointReached() | events.Resumed():
            changes = {"doing": sentence(event), "paused": False}
        case events.RobotChanged():
            changes = {"robot": event.state.phase.value}
        case events.MoveCommitted():
            changes = {"fen": event.fen, "ply": event.ply, "last": event.san}
        case events.Paused():
            changes = {"paused": True, "doing": "paused"}
        case events.OperatorAsked():
            changes = {"trouble": event.text[:300]}
        case events.OperatorAnswered():
            changes = {"trouble": ""}
        case events.GameOver():
            changes = {"result": event.result, "doing": event.reason}
        case _:
            pass
    return changes
