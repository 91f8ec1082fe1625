"""The chess clock of a game: it runs while a side decides, and is kept in the journal."""

import asyncio
import time
from collections.abc import Callable, Coroutine
from typing import Any

import chess

from kempelen.core import events
from kempelen.game.clock import ChessClock, ClockReading, TimeControl
from kempelen.game.journal import GameLog
from kempelen.game.observers import EventBus
from kempelen.game.players import Proposal, Propose
from kempelen.game.records import Clocked

KEPT_S = 5.0
"""While a side decides, the journal gets the time this often: a kill gives back no more than that."""


class TurnClock:
    """Does nothing in a game without a clock.

    Args:
        log: Of the game; its state has the times that are left.
        bus: Told when the clock starts and stops.
        now: A clock that never goes back, s.
    """

    def __init__(self, log: GameLog, bus: EventBus, now: Callable[[], float] = time.monotonic) -> None:
        self._log = log
        self._bus = bus
        self._clock = _clock_of(log, now)
        self._deciding: chess.Color | None = None
        self._paused = False
        self._switched = asyncio.Event()

    def read(self) -> ClockReading | None:
        """What it shows; None where there is no clock."""
        return self._clock.read() if self._clock else None

    def left(self, colour: chess.Color) -> float | None:
        """Time of a side, s; None where there is no clock."""
        return self._clock.read().left(colour) if self._clock else None

    def fallen(self, colour: chess.Color) -> bool:
        """Whether a side has no time left."""
        return self.left(colour) == 0.0

    async def during(
        self, colour: chess.Color, work: Coroutine[Any, Any, Proposal | None]
    ) -> Proposal | None:
        """What a side decides, on its time; None when that is over first, or something else came in between.

        A move gets the increment.
        """
        if (clock := self._clock) is None:
            return await work
        task = asyncio.ensure_future(work)
        self._deciding = colour
        try:
            if not self._paused:
                clock.start(colour)
                self._tell()
            await self._until_done_or_fallen(clock, colour, task)
            if task.done() and isinstance(task.result(), Propose):
                clock.moved(colour)
            return task.result() if task.done() else None
        finally:
            self._deciding = None
            clock.stop()
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
            self._keep()
            self._tell()

    async def _until_done_or_fallen(
        self, clock: ChessClock, colour: chess.Color, task: "asyncio.Future[Any]"
    ) -> None:
        while not task.done() and clock.read().left(colour) > 0:
            self._switched.clear()
            switched = asyncio.ensure_future(self._switched.wait())
            reading = clock.read()
            patience = KEPT_S if reading.running is None else min(reading.left(colour), KEPT_S)
            try:
                await asyncio.wait({task, switched}, timeout=patience, return_when=asyncio.FIRST_COMPLETED)
            finally:
                switched.cancel()
            self._keep()

    def pause(self) -> None:
        """Nobody's time runs until `resume`."""
        self._paused = True
        if self._clock is not None and self._deciding is not None:
            self._clock.stop()
            self._keep()
            self._switch()

    def resume(self) -> None:
        """Go on where it was paused."""
        self._paused = False
        if self._clock is not None and self._deciding is not None:
            self._clock.start(self._deciding)
            self._switch()

    def _switch(self) -> None:
        self._switched.set()
        self._tell()

    def _keep(self) -> None:
        """Into the journal, unless it has that already."""
        if (reading := self.read()) is not None and self._log.state.ended is None:
            times = (round(reading.white, 3), round(reading.black, 3))
            if times != self._log.state.clock:
                self._log.write(Clocked(white=times[0], black=times[1]))

    def _tell(self) -> None:
        if (reading := self.read()) is not None:
            self._bus.emit(events.ClockChanged(reading.white, reading.black, reading.running))


def _clock_of(log: GameLog, now: Callable[[], float]) -> ChessClock | None:
    spec, kept = log.state.begun.clock, log.state.clock
    if spec is None or kept is None:
        return None
    return ChessClock(TimeControl(spec.seconds, spec.increment), now).set_to(*kept)
