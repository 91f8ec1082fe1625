"""Commands that wait for their time: between moves, and what moves the robot not in a pause."""

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

from kempelen.core.errors import GameError, KempelenError
from kempelen.core.words import say

Action = Callable[[], Awaitable[None]]


def _future() -> "asyncio.Future[None]":
    return asyncio.get_running_loop().create_future()


@dataclass(eq=False)
class _Order:
    action: Action
    moves_robot: bool
    answer: "asyncio.Future[None]" = field(default_factory=_future)

    async def obey(self) -> None:
        """Do it. A refusal goes to whoever gave the order alone; whatever else fails also ends the game."""
        try:
            await self.action()
        except GameError as refused:
            self.fail(refused)
        except KempelenError as error:
            self.fail(error)
            raise
        except BaseException:
            self.fail(
                GameError(
                    say("ended_meanwhile", "The game ended while this was being done."),
                    hint=say("resume_it", "Resume it."),
                )
            )
            raise
        else:
            if not self.answer.done():
                self.answer.set_result(None)

    def fail(self, error: KempelenError) -> None:
        """Tell whoever gave it, who may have gone."""
        if not self.answer.done():
            self.answer.set_exception(error)
            self.answer.exception()


class Orders:
    """First come, first served.

    Attributes:
        came: Set when an order has come since the last `obey_one`.
    """

    def __init__(self) -> None:
        self.came = asyncio.Event()
        self._waiting: deque[_Order] = deque()

    def __bool__(self) -> bool:
        return bool(self._waiting)

    async def give(self, action: Action, *, moves_robot: bool = False) -> None:
        """Have something done between moves; returns when it is done.

        Raises:
            GameError: It was refused, or the game ended first.
        """
        order = _Order(action, moves_robot)
        self._waiting.append(order)
        self.came.set()
        await asyncio.shield(order.answer)

    async def obey_one(self, *, paused: bool) -> bool:
        """Do the first order that may be done now; whether there was one."""
        self.came.clear()
        order = next((o for o in self._waiting if not (o.moves_robot and paused)), None)
        if order is None:
            return False
        self._waiting.remove(order)
        await order.obey()
        return True

    def close(self) -> None:
        """Refuse all that still wait."""
        while self._waiting:
            self._waiting.popleft().fail(
                GameError(say("ended_meanwhile", "The game ended before this could be done."))
            )
