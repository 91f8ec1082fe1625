"""Waiting for two things at once, and for the end of a pause."""

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


async def unless(signal: asyncio.Event, work: Coroutine[Any, Any, T]) -> T | None:
    """The result of ``work``, or None when ``signal`` comes first; ``work`` is then cancelled and over."""
    task = asyncio.ensure_future(work)
    alarm = asyncio.ensure_future(signal.wait())
    try:
        await asyncio.wait({task, alarm}, return_when=asyncio.FIRST_COMPLETED)
        return task.result() if task.done() else None
    finally:
        task.cancel()
        alarm.cancel()
        await asyncio.gather(task, alarm, return_exceptions=True)


class Gate:
    """Where motion waits while the game is paused.

    A closed gate can let one move through: `finish` opens it until `move_done` closes it again.
    """

    def __init__(self) -> None:
        self._open = asyncio.Event()
        self._open.set()
        self._finished: asyncio.Future[None] | None = None
        self.paused = False

    @property
    def finishing(self) -> bool:
        """Whether a move is let through a pause."""
        return self._finished is not None

    def close(self) -> None:
        """Nothing passes from now on."""
        self.paused = True
        self._open.clear()
        self._end_finishing()

    def open(self) -> None:
        """Everything passes."""
        self.paused = False
        self._open.set()
        self._end_finishing()

    async def passed(self) -> None:
        """Returns when the gate is open."""
        await self._open.wait()

    def finish(self) -> "asyncio.Future[None]":
        """Open until the move in hand is done; the future tells when."""
        if self._finished is None:
            self._finished = asyncio.get_running_loop().create_future()
        self._open.set()
        return self._finished

    def move_done(self) -> None:
        """The move in hand is done: close again if it was only to be finished."""
        if self._finished is not None:
            self._open.clear()
            self._end_finishing()

    def _end_finishing(self) -> None:
        if self._finished is not None and not self._finished.done():
            self._finished.set_result(None)
        self._finished = None
