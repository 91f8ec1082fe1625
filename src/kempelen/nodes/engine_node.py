"""The node beside an engine: one search at a time, each question answered once however often it is asked."""

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Self

import chess

from kempelen.core.errors import KempelenError, LinkError
from kempelen.core.protocols import Engine, EngineChoice, Thinking
from kempelen.nodes.link import Link
from kempelen.nodes.messages import Trouble, key_of
from kempelen.nodes.thoughts import Introduced, Musing, Think, ThinkingMessage, Thought

_LINGER_S = 0.25
"""A question waits so long for the move before it is told that the search goes on."""
_UNWANTED_S = 10.0
"""A search that nobody has asked after for so long is given up."""
_LOOK_S = 1.0


@dataclass
class _Search:
    """For one client."""

    number: int
    asked: float
    latest: ThinkingMessage | None = None
    fresh: asyncio.Event = field(default_factory=asyncio.Event)
    task: asyncio.Task[Thought] = field(init=False)


class EngineNode:
    """Offers an engine under a name. Async context manager, entered inside of the engine and the link.

    Args:
        engine: Entered.
        link: Entered.
        name: By which it is found.
        clock: s.
    """

    def __init__(
        self, engine: Engine, link: Link, name: str, *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.engine = engine
        self._link = link
        self._name = name
        self._clock = clock
        self._searches: dict[str, _Search] = {}
        self._turn = asyncio.Lock()
        self._chore: asyncio.Task[None]

    async def __aenter__(self) -> Self:
        """Be found."""
        await self._link.answer(key_of(self._name, "engine", "hello"), self._hello)
        await self._link.answer(key_of(self._name, "engine", "think"), self._think)
        await self._link.stand(key_of(self._name, "engine"))
        self._chore = asyncio.create_task(self._tidy())
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Nothing is thought any more."""
        tasks = [self._chore, *(search.task for search in self._searches.values())]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    @property
    def searching(self) -> int:
        """Positions that are being thought about, or wait for it."""
        return sum(not search.task.done() for search in self._searches.values())

    async def _hello(self, _content: bytes) -> bytes:
        return Introduced(name=self.engine.name[:200]).pack()

    async def _think(self, content: bytes) -> bytes:
        number = 0
        try:
            asked = Think.unpack(content)
            number = asked.number
            if asked.forget:
                self._forget(asked)
                return Thought(number=number, status="failed").pack()
            return (await self._so_far(self._search(asked))).pack()
        except KempelenError as error:
            return Thought(number=number, status="failed", trouble=Trouble.of(error)).pack()

    def _search(self, asked: Think) -> _Search:
        """The search for a question: the one that goes on or has ended, or a new one.

        Raises:
            LinkError: a newer question of the same client has overtaken it, or it makes no sense.
        """
        before = self._searches.get(asked.client)
        if before is not None and before.number > asked.number:
            raise LinkError(f"Question {asked.number} was overtaken by question {before.number}.")
        if before is None or before.number < asked.number:
            board = asked.board()
            if before is not None:
                before.task.cancel()
            search = _Search(asked.number, self._clock())
            search.task = asyncio.create_task(self._found(asked, board, search))
            self._searches[asked.client] = search
        search = self._searches[asked.client]
        search.asked = self._clock()
        return search

    async def _found(self, asked: Think, board: chess.Board, search: _Search) -> Thought:
        """One search after the other: an engine has but one mind."""

        def muse(thinking: Thinking) -> None:
            search.latest = ThinkingMessage.of(thinking)
            search.fresh.set()

        telling = asyncio.create_task(self._tell(asked, search))
        try:
            async with self._turn:
                choice = await self.engine.choose(board, seconds=asked.seconds, on_thinking=muse)
        except KempelenError as error:
            return Thought(number=asked.number, status="failed", trouble=Trouble.of(error))
        finally:
            telling.cancel()
        return _thought(asked.number, choice)

    async def _tell(self, asked: Think, search: _Search) -> None:
        """What it thinks; a slow network skips to the newest."""
        while True:
            await search.fresh.wait()
            search.fresh.clear()
            if search.latest is not None:
                musing = Musing(client=asked.client, number=asked.number, thinking=search.latest)
                await self._link.tell(key_of(self._name, "engine", "news"), musing.pack())

    async def _so_far(self, search: _Search) -> Thought:
        await asyncio.wait({search.task}, timeout=_LINGER_S)
        if (
            not search.task.done() or search.task.cancelled()
        ):  # cancelled: the node is ending, ask the next one
            return Thought(number=search.number, status="running", thinking=search.latest)
        return search.task.result()

    def _forget(self, asked: Think) -> None:
        search = self._searches.get(asked.client)
        if search is not None and search.number <= asked.number:
            search.task.cancel()

    async def _tidy(self) -> None:
        """Give up what nobody asks after any more."""
        while True:
            await asyncio.sleep(_LOOK_S)
            for client, search in list(self._searches.items()):
                if self._clock() - search.asked > _UNWANTED_S:
                    search.task.cancel()
                    del self._searches[client]


def _thought(number: int, choice: EngineChoice) -> Thought:
    return Thought(
        number=number, status="done", move=choice.move.uci(), thinking=ThinkingMessage.of(choice.thinking),
        resigns=choice.resigns, offers_draw=choice.offers_draw,
    )  # fmt: skip
