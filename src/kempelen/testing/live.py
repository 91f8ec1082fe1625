"""A whole game in the test's own process: real arbiter, journal, driver and wire; the twin at its other end.

A `Stage` writes down what happens as the sentences that people read, and waits for cues in them, so that a
scenario reads like a script: "when the knight is being carried, pause".
"""

import asyncio
import os
import signal
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from kempelen.app.audit import disagreements
from kempelen.app.cast import GameRequest
from kempelen.app.config import load_config
from kempelen.app.live_game import LiveGame
from kempelen.app.narrate import sentence
from kempelen.app.people import Question
from kempelen.app.report import GameReport
from kempelen.core.events import Event
from kempelen.core.places import Place
from kempelen.game.arbiter import Arbiter
from kempelen.game.game_log import san_of
from kempelen.testing.scenarios import twin_of
from kempelen.twin.client import TwinControl

CUE_S = 60.0
"""Longest wait for anything to happen, s, on a very busy machine."""


async def nobody(question: Question) -> str:
    """The virtual person answers for itself; nobody sits at the terminal.

    Raises:
        AssertionError: somebody was asked.
    """
    raise AssertionError(f"nobody is here to answer: {question}")


class Stage:
    """A game on the twin, as fast as it can. Async context manager.

    Args:
        data: Its data directory.
        request: A new game, or the number of one to resume.
        options: Of the configuration, with ``__`` for dots: ``play__hands="person"``.

    Attributes:
        trace: What happened, a sentence each.
        live: The game.
    """

    def __init__(self, data: Path, request: GameRequest | int, **options: object) -> None:
        settings = {"data.dir": str(data), "twin.speed": "max", "engine.level": "1", "engine.move_time": 0.05}
        settings |= {name.replace("__", "."): value for name, value in options.items()}
        self.live = LiveGame(load_config(None, settings), request, nobody)
        self.trace: list[str] = []
        self._read = 0
        self._news = asyncio.Event()
        self._playing: asyncio.Task[GameReport] | None = None

    async def __aenter__(self) -> Self:
        """Up to the first turn; nothing is played before `play`."""
        await self.live.__aenter__()
        self.arbiter.events.listen(self._hear)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """The game is cut off if it still runs."""
        if self._playing is not None:
            self._playing.cancel()
            await asyncio.gather(self._playing, return_exceptions=True)
        await self.live.__aexit__(kind, error, trace)

    def _hear(self, event: Event) -> None:
        if text := sentence(event).strip():
            self.trace.append(text)
            self._news.set()

    @property
    def arbiter(self) -> Arbiter:
        """Owns the game."""
        return self.live.arbiter

    @property
    def control(self) -> TwinControl:
        """The twin's side door.

        Raises:
            RuntimeError: the game is not on a twin of its own.
        """
        if self.live.session.twin is None:
            raise RuntimeError("the game is not on a twin of its own")
        return self.live.session.twin.control

    @property
    def moves(self) -> str:
        """The game so far: ``1. e4 e5``."""
        return san_of(self.arbiter.state)

    def play(self) -> "asyncio.Task[GameReport]":
        """Let the game begin, or go on."""
        if self._playing is None:
            self._playing = asyncio.create_task(self.live.play())
        return self._playing

    async def report(self) -> GameReport:
        """The game to its end."""
        return await self.play()

    async def cue(self, text: str) -> str:
        """Wait until something happens that was not cued before; the sentence that holds ``text``.

        Raises:
            AssertionError: the game ended before it happened.
            KempelenError: it ended badly.
        """
        playing = self.play()
        while True:
            while self._read < len(self.trace):
                self._read += 1
                if text in self.trace[self._read - 1]:
                    return self.trace[self._read - 1]
            if playing.done():
                playing.result()
                raise AssertionError(f"the game ended without '{text}':\n" + "\n".join(self.trace))
            self._news.clear()
            waiting = asyncio.ensure_future(self._news.wait())
            done, _ = await asyncio.wait(
                {waiting, playing}, timeout=CUE_S, return_when=asyncio.FIRST_COMPLETED
            )
            waiting.cancel()
            if not done:
                raise AssertionError(f"no '{text}' within {CUE_S} s:\n" + "\n".join(self.trace))

    async def type(self, text: str) -> None:
        """Type a person's move as soon as one is wanted."""
        await self.wanted()
        self.live.cast.person.submit(text)

    async def wanted(self) -> None:
        """Until a person's move is wanted: what the robot has done has been seen, or felt, to stand."""
        person = self.live.cast.person
        while not person.to_move:
            await person.wanted.wait()

    async def truth(self) -> Mapping[str, Any]:
        """Where everything really is, now."""
        return await self.control.ask("truth")

    async def piece(self, square: str) -> Mapping[str, Any]:
        """The piece that really stands nearest to a square."""
        x, y, _ = self.live.session.table.centre(Place(square))
        truth = await self.truth()
        found: Mapping[str, Any] = min(
            truth["pieces"], key=lambda piece: (piece["x"] - x) ** 2 + (piece["y"] - y) ** 2
        )
        return found

    async def fault(self, name: str, **how: object) -> None:
        """Break something at the far end of the wire (`kempelen.twin.faults`)."""
        await self.control.ask("fault", name=name, **how)

    @staticmethod
    def kill_twin() -> None:
        """The process at the far end of the wire dies, and its table with it."""
        os.kill(twin_of(os.getpid()), signal.SIGKILL)

    async def wrong(self) -> list[str]:
        """Where table and journal differ once everything has settled."""
        table, layout = self.live.session.table, self.arbiter.state.layout
        return disagreements(table, layout, await self.control.ask("settle"))
