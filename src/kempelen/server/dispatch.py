"""Commands to the station: who may, how often, once; a refusal has a reason.

Whatever comes twice with the same id from the same client is done once. Commands do not queue here: each is
handed to the station at once, which refuses what does not fit its state. An e-stop is subject to no limit.
"""

import asyncio
import logging
from collections import OrderedDict
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from kempelen.app.station import Station
from kempelen.core.errors import KempelenError
from kempelen.core.words import say
from kempelen.server.commands import AnyCommand, Command, EStop, Jog, JogStop, Reply
from kempelen.server.deeds import deed
from kempelen.server.limits import Limiter, Rate
from kempelen.server.problems import FAULT, Problem, Tally, told, wrong
from kempelen.server.sessions import Visitor, allows

_COMMANDS = Rate(per_second=10, burst=30)
_JOGS = Rate(per_second=40, burst=60)
_REMEMBERED = 256
_CLIENTS = 512
_AT_ONCE = 16
_log = logging.getLogger(__name__)


@dataclass(slots=True)
class _Done:
    """A command that is being done, or was."""

    command: Command
    task: asyncio.Task[Reply]


class Dispatcher:
    """One for a server.

    Args:
        station: Does it.
        tally: Counts what is refused.
    """

    def __init__(self, station: Station, tally: Tally) -> None:
        self._station = station
        self._tally = tally
        self._done: OrderedDict[str, OrderedDict[str, _Done]] = OrderedDict()
        self._commands = Limiter(_COMMANDS)
        self._jogs = Limiter(_JOGS)
        self._tasks: set[asyncio.Task[Any]] = set()

    async def obey(self, command: AnyCommand, visitor: Visitor, socket: str = "") -> Reply:
        """Do it, or say why not; never raises.

        Args:
            command: What is asked for.
            visitor: By whom.
            socket: The WebSocket that it came over; empty for HTTP.
        """
        if not allows(visitor.role, command.needs):
            return self._refuse(
                command, visitor, "role", say("role", f"A {visitor.role} may not do that."), _MORE
            )
        known = self._of(visitor).get(command.id)
        if known is not None:
            if known.command != command:
                return self._refuse(
                    command, visitor, "id", say("id_used", "This id was used for another command.")
                )
            return await asyncio.shield(known.task)
        refused = None if isinstance(command, EStop) else self._limited(command, visitor, socket)
        return refused or await self._do(command, visitor, socket)

    def _of(self, visitor: Visitor) -> OrderedDict[str, _Done]:
        return self._done.get(visitor.key) or OrderedDict()

    def _limited(self, command: Command, visitor: Visitor, socket: str) -> Reply | None:
        jog = isinstance(command, Jog | JogStop)
        if jog and not socket:
            return self._refuse(
                command,
                visitor,
                "jog",
                say("jog_socket", "Jogging needs a WebSocket."),
                say("jog_ends", "It ends when its client goes away."),
            )
        if not (self._jogs if jog else self._commands).take(visitor.key):
            return self._refuse(
                command,
                visitor,
                "rate",
                say("too_many", "Too many commands at once."),
                say("wait_second", "Wait a second, then try again."),
            )
        at_work = sum(not kept.task.done() for kept in self._of(visitor).values())
        if at_work >= _AT_ONCE:
            return self._refuse(
                command,
                visitor,
                "at once",
                say("too_many_at_work", "Too many commands are at work."),
                say("wait_for_it", "Wait for their answers."),
            )
        return None

    async def _do(self, command: AnyCommand, visitor: Visitor, socket: str) -> Reply:
        """In a task of its own, so that it is not cut off when its client goes away."""
        task = asyncio.ensure_future(self._answered(command, deed(self._station, command, socket)))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        if not isinstance(command, Jog | JogStop):
            self._remember(visitor.key, _Done(command, task))
        return await asyncio.shield(task)

    async def _answered(
        self, command: Command, act: Callable[[], Coroutine[Any, Any, dict[str, Any] | None]]
    ) -> Reply:
        try:
            result = await act()
        except KempelenError as error:
            return _refusal(command, told(error))
        except Exception:  # noqa: BLE001 - a fault of one command is not the end of the server
            _log.exception("The command %s failed", type(command).__name__)
            return _refusal(command, wrong(FAULT))
        return Reply(id=command.id, ok=True, result=result or {})

    def _remember(self, key: str, done: _Done) -> None:
        kept = self._done.pop(key, OrderedDict())
        self._done[key] = kept
        kept[done.command.id] = done
        if len(kept) > _REMEMBERED:
            kept.popitem(last=False)
        if len(self._done) > _CLIENTS:
            self._done.popitem(last=False)

    def _refuse(self, command: Command, visitor: Visitor, why: str, error: str, hint: str = "") -> Reply:
        self._tally.refused(why, visitor.role, type(command).__name__)
        return _refusal(command, wrong(error, hint))

    def gone(self, socket: str) -> None:
        """A WebSocket is gone: what it was jogging stops."""
        task = asyncio.ensure_future(self._stop_jogging(socket))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _stop_jogging(self, socket: str) -> None:
        try:
            await self._station.owner_left(socket)
        except KempelenError as error:
            _log.warning("Jogging could not be stopped: %s", error)

    async def close(self) -> None:
        """End what is still being done."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)


_MORE = say("more_rights", "Open the link of an operator or player, or enter the password.")


def _refusal(command: Command, why: Problem) -> Reply:
    return Reply(id=command.id, ok=False, **dict(why))
