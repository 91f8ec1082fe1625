"""The reed board as a board sensor: `kempelen.core.senses.BoardSensor`."""

import asyncio
import re
from collections import deque
from collections.abc import AsyncIterator, Callable
from types import TracebackType
from typing import Self

import chess

from kempelen.core.reed import NUMBERS, Change, Finding, Snapshot, Sound
from kempelen.core.senses import Observation, Sight
from kempelen.sensing.reed.board import Opener, ReedBoard, Trouble
from kempelen.sensing.reed.faults import SwitchFault
from kempelen.sensing.reed.reading import Reading

_RECENT = 16
_REPEAT_S = 1.0
"""While the line is down, it is said again so often."""
_SQUARE = re.compile(r"\b[a-h][1-8]\b")
_HALF = NUMBERS // 2


class ReedSensor:
    """Async context manager: a reed board that is watched.

    Args:
        name: The port, for messages.
        opener: Opens it.
        board: What stands on it.
        tell: Takes what is wrong with its switches.

    Attributes:
        reading: What its messages come to.
        board: Its driver.
    """

    def __init__(
        self,
        name: str,
        opener: Opener,
        board: chess.Board | None = None,
        tell: Callable[[SwitchFault], None] = lambda _: None,
    ) -> None:
        self.reading = Reading(board, tell)
        self.board = ReedBoard(name, opener, self._take, self._trouble)
        self._recent: deque[tuple[int, int, Observation]] = deque(maxlen=_RECENT)
        self._news = asyncio.Event()
        self._count = 0
        self._down = ""
        self.latest = self.reading.observation()

    async def __aenter__(self) -> Self:
        """Connect; raises as `ReedBoard`."""
        await self.board.__aenter__()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Lamps off, port free."""
        await self.board.__aexit__(kind, error, trace)

    # --- what it sees ---

    async def observe(self) -> AsyncIterator[Observation]:
        """Observations of readings taken from now on; a slow reader skips to the newest."""
        mark, number = self.board.mark(), -1
        while True:
            fresh = [each for each in self._recent if each[0] > number and (each[1] - mark) % NUMBERS < _HALF]
            if fresh:
                hidden = [each for each in fresh if not each[2].valid]
                told = hidden[-1] if hidden else fresh[-1]
                number = told[0]
                yield told[2]
                continue
            self._news.clear()
            try:
                async with asyncio.timeout(_REPEAT_S):
                    await self._news.wait()
            except TimeoutError:
                if self._down:
                    yield self._blind()

    def stands(self, board: chess.Board) -> None:
        """A position has been confirmed."""
        self.reading.stands(board)

    def expect(self, board: chess.Board) -> None:
        """What should stand there; it is not known yet whether it does."""
        self.reading.expect(board)

    def _take(self, message: Change | Snapshot | Finding) -> None:
        self.reading.take(message)
        if isinstance(message, Snapshot):
            self._see(self.reading.observation(), message.mark)

    def _trouble(self, trouble: Trouble) -> None:
        self._down = trouble.text
        if trouble.text:
            self._see(self._blind(), self._recent[-1][1] if self._recent else 0)

    def _blind(self) -> Observation:
        return Observation.blind(self.latest.time, Sight.STALE, self._down)

    def _see(self, observation: Observation, mark: int) -> None:
        self.latest = observation
        self._count += 1
        self._recent.append((self._count, mark, observation))
        self._news.set()

    # --- what it shows ---

    def warn(self, advice: str) -> None:
        """Light the squares that a sentence names, and sound the warning; an empty one: all is well."""
        self.show(advice)
        if advice:
            self.board.sound(Sound.WARN)

    def show(self, text: str) -> None:
        """Light the squares that a sentence names, and no others."""
        self.board.light(sum({1 << chess.parse_square(name) for name in _SQUARE.findall(text)}))
