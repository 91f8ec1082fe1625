"""An engine at another machine's node, as a `kempelen.core.protocols.Engine` like any other."""

import asyncio
import itertools
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Self

import chess

from kempelen.core.errors import EngineError, KempelenError, LinkError
from kempelen.core.protocols import EngineChoice, OnThinking
from kempelen.nodes.link import Link
from kempelen.nodes.messages import key_of
from kempelen.nodes.presence import presence
from kempelen.nodes.thoughts import Introduce, Introduced, Musing, Think, Thought


@dataclass(frozen=True)
class EngineWaits:
    """How long is waited, s.

    Attributes:
        answer: For one answer.
        again: After none, before it is asked again.
        found: For the node, at first.
        lost: Without any answer: then the node counts as gone.
    """

    answer: float = 1.0
    again: float = 0.1
    found: float = 5.0
    lost: float = 20.0


class RemoteEngine:
    """Async context manager; a cut link is waited out, and a node that was started again is asked anew.

    Args:
        link: Not yet entered; left when this is.
        name: Of the node.
        waits: How long for what.
        clock: s.
    """

    def __init__(
        self,
        link: Link,
        name: str,
        *,
        waits: EngineWaits | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.name = f"engine at {name}"
        self._link = link
        self._node = name
        self._waits = waits or EngineWaits()
        self._clock = clock
        self._client = uuid.uuid4().hex
        self._numbers = itertools.count(1)
        self._number = 0
        self._tell: OnThinking | None = None

    async def __aenter__(self) -> Self:
        """Find the node.

        Raises:
            EngineError: no engine node of that name answers; the message says which do.
            LinkError: the network cannot be joined.
        """
        await self._link.__aenter__()
        try:
            await self._link.listen(key_of(self._node, "engine", "news"), self._hear)
            self.name = (await self._introduced()).name
        except BaseException:
            await self._link.__aexit__(None, None, None)
            raise
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Leave the network."""
        await self._link.__aexit__(*exc)

    async def _introduced(self) -> Introduced:
        deadline = self._clock() + self._waits.found
        while True:
            with suppress(LinkError):
                key, question = key_of(self._node, "engine", "hello"), Introduce().pack()
                return Introduced.unpack(await self._link.ask(key, question, seconds=self._waits.answer))
            if self._clock() > deadline:
                seen = await presence(self._link, "engine", self._node)
                raise seen.absence(self._waits.found)
            await asyncio.sleep(self._waits.again)

    def _hear(self, _key: str, content: bytes) -> None:
        with suppress(LinkError):
            musing = Musing.unpack(content)
            mine = (musing.client, musing.number) == (self._client, self._number)
            if mine and self._tell is not None:
                self._tell(musing.thinking.thinking())

    async def choose(
        self, board: chess.Board, *, seconds: float | None = None, on_thinking: OnThinking | None = None
    ) -> EngineChoice:
        """A legal move for ``board``, whose move stack is the game so far; when cancelled, the node stops.

        Raises:
            EngineError: the engine named none, or its node is lost.
        """
        number = self._number = next(self._numbers)
        think = Think(
            client=self._client, number=number, start=board.root().fen(),
            moves=tuple(move.uci() for move in board.move_stack), seconds=seconds,
        )  # fmt: skip
        self._tell = on_thinking
        try:
            return await self._chosen(think, board)
        except asyncio.CancelledError:
            forget = think.model_copy(update={"forget": True, "moves": ()}).pack()
            with suppress(LinkError):
                await self._link.ask(self._thinking, forget, seconds=self._waits.answer)
            raise
        finally:
            self._tell = None

    @property
    def _thinking(self) -> str:
        return key_of(self._node, "engine", "think")

    async def _chosen(self, think: Think, board: chess.Board) -> EngineChoice:
        heard, fault = self._clock(), "it has not answered"
        while (silent := self._clock() - heard) <= self._waits.lost:
            try:
                content = await self._link.ask(self._thinking, think.pack(), seconds=self._waits.answer)
                thought = Thought.unpack(content)
                if thought.status == "done":
                    return thought.choice(board)
            except LinkError as error:
                fault = error.message
                await asyncio.sleep(self._waits.again)
                continue
            heard = self._clock()
            if thought.trouble is not None:
                raise _engine_error(thought.trouble.error())
        raise EngineError(
            f"The engine node {self._node} has named no move for {silent:.0f} s: {fault}",
            hint="The game is kept. Look after its machine and the network, or take another engine: "
            "kempelen resume --engine NAME",
        )


def _engine_error(error: KempelenError) -> EngineError:
    return error if isinstance(error, EngineError) else EngineError(error.message, hint=error.hint)
