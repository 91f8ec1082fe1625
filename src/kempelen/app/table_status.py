"""How it stands at a table, told to whoever looks over the hall."""

import asyncio
import uuid
from contextlib import AsyncExitStack, suppress
from typing import Self

from kempelen.app.config import Config
from kempelen.app.narrate import sentence
from kempelen.app.network import link_of, table_name
from kempelen.core import events
from kempelen.game.observers import EventBus
from kempelen.nodes.link import Link
from kempelen.nodes.status import Status, stand_for, tell

_LIFE_S = 2.0
"""A table is heard of at least this often."""
_SOON_S = 0.2
"""And at most this often."""
_LONGEST = 300


class TableStatus:
    """Tells of a table from what happens in its games. Async context manager.

    Args:
        link: Entered.
        table: Its name.
        soon: Least time between two news, s.
    """

    def __init__(self, link: Link, table: str, *, soon: float = _SOON_S) -> None:
        self._link = link
        self._soon = soon
        self._status = Status(table=table, program=uuid.uuid4().hex, doing="no game")
        self._changed = asyncio.Event()
        self._task: asyncio.Task[None]

    async def __aenter__(self) -> Self:
        """Be seen."""
        await stand_for(self._link, self._status.table)
        self._changed.set()
        self._task = asyncio.create_task(self._live())
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Nothing is told any more."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    def hear(self, event: events.Event) -> None:
        """Take what happens in the game."""
        if changes := status_after(event):
            self._status = self._status.model_copy(update=changes)
            self._changed.set()

    async def _live(self) -> None:
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout(_LIFE_S):
                    await self._changed.wait()
            self._changed.clear()
            self._status = self._status.model_copy(update={"count": self._status.count + 1})
            await tell(self._link, self._status)
            await asyncio.sleep(self._soon)


class ToldStatus:
    """Async context manager: tells of the configured table as long as it lasts, if one has a name.

    Args:
        config: With the table's name, and the network.
        bus: Of its games' events.
    """

    def __init__(self, config: Config, bus: EventBus) -> None:
        self._config = config
        self._bus = bus
        self._stack = AsyncExitStack()

    async def __aenter__(self) -> Self:
        """Join the network.

        Raises:
            LinkError: it cannot be joined.
            ConfigError: the table's name is none.
        """
        if self._config.network.table:
            try:
                link = await self._stack.enter_async_context(link_of(self._config))
                teller = TableStatus(link, table_name(self._config.network.table))
                self._bus.listen((await self._stack.enter_async_context(teller)).hear)
            except BaseException:
                await self._stack.aclose()
                raise
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Leave it."""
        await self._stack.aclose()


def status_after(event: events.Event) -> dict[str, object]:
    """What an event changes in a table's status."""
    changes: dict[str, object] = {}
    match event:
        case events.GameStarted():
            changes = {
                "game": event.game, "white": event.white[:_LONGEST], "black": event.black[:_LONGEST],
                "fen": event.fen, "ply": event.plies, "last": "", "result": "", "doing": "getting ready",
                "paused": False, "trouble": "",
            }  # fmt: skip
        case events.TurnBegan():
            changes = {"doing": f"{event.player[: _LONGEST - 7]} thinks"}
        case events.CheckpointReached() | events.Resumed():
            changes = {"doing": sentence(event), "paused": False}
        case events.RobotChanged():
            changes = {"robot": event.state.phase.value}
        case events.MoveCommitted():
            changes = {"fen": event.fen, "ply": event.ply, "last": event.san}
        case events.Paused():
            changes = {"paused": True, "doing": "paused"}
        case events.OperatorAsked():
            changes = {"trouble": event.text[:_LONGEST]}
        case events.OperatorAnswered():
            changes = {"trouble": ""}
        case events.GameOver():
            changes = {"result": event.result, "doing": event.reason[:_LONGEST]}
        case _:
            pass
    return changes
