"""Links between programs in one process, through weather if wanted."""

import asyncio
import random
from collections.abc import Coroutine, Iterator
from dataclasses import dataclass, field
from typing import Any, Self

from kempelen.core.errors import LinkError
from kempelen.nodes.link import Answer, Changed, Hear


@dataclass
class Weather:
    """What happens to everything that is sent.

    Attributes:
        cut: Nothing comes through.
        loss: Share of it that is lost.
        twice: Share of it that comes a second time, later.
        delay: (least, most) s; with most above least it also comes in another order.
    """

    rng: random.Random = field(default_factory=random.Random)
    cut: bool = False
    loss: float = 0.0
    twice: float = 0.0
    delay: tuple[float, float] = (0.0, 0.0)

    def arrivals(self) -> Iterator[float]:
        """After how many seconds a copy comes out at the other end, for each that does."""
        for _ in range(1 + (self.rng.random() < self.twice)):
            if not self.cut and self.rng.random() >= self.loss:
                yield self.rng.uniform(*self.delay)


class LocalNet:
    """Everything that is declared in one process.

    Args:
        weather: Of all links; fair by default. May be changed at any time.
    """

    def __init__(self, weather: Weather | None = None) -> None:
        self.weather = weather or Weather()
        self.answers: dict[str, Answer] = {}
        self.listeners: list[tuple[str, Hear]] = []
        self.here: set[str] = set()
        self.watchers: list[tuple[str, Changed]] = []

    def join(self) -> "LocalLink":
        """A program's own link, to be entered."""
        return LocalLink(self)


class LocalLink:
    """Implements `kempelen.nodes.link.Link`."""

    def __init__(self, net: LocalNet) -> None:
        self._net = net
        self._keys: list[str] = []
        self._listeners: list[tuple[str, Hear]] = []
        self._watchers: list[tuple[str, Changed]] = []
        self._tasks: set[asyncio.Task[None]] = set()

    async def __aenter__(self) -> Self:
        """Nothing to be done."""
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Take back what was declared, and what is still on its way."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for listener in self._listeners:
            self._net.listeners.remove(listener)
        for watcher in self._watchers:
            self._net.watchers.remove(watcher)
        for key in self._keys:
            self._net.answers.pop(key, None)
            self._seen(key, there=False)
        self._listeners, self._watchers, self._keys = [], [], []

    async def ask(self, key: str, question: bytes, *, seconds: float) -> bytes:
        """The answer of whoever answers for ``key``.

        Raises:
            LinkError: none came within ``seconds``.
        """
        reply: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        for delay in self._net.weather.arrivals():
            self._start(self._carry(key, question, delay, reply))
        try:
            async with asyncio.timeout(seconds):
                return await reply
        except TimeoutError:
            raise LinkError(f"No answer from {key} within {seconds:.1f} s.") from None

    async def _carry(self, key: str, question: bytes, delay: float, reply: "asyncio.Future[bytes]") -> None:
        await asyncio.sleep(delay)
        answer = self._net.answers.get(key)
        if answer is None:
            return
        content = await answer(question)
        for back in self._net.weather.arrivals():
            await asyncio.sleep(back)
            if not reply.done():
                reply.set_result(content)

    async def answer(self, key: str, answer: Answer) -> None:
        """Answer questions to ``key`` from now on."""
        self._net.answers[key] = answer
        self._keys.append(key)

    async def tell(self, key: str, news: bytes) -> None:
        """Tell whoever listens."""
        for pattern, hear in list(self._net.listeners):
            if _matches(key, pattern):
                for delay in self._net.weather.arrivals():
                    self._start(self._bring(hear, key, news, delay))

    @staticmethod
    async def _bring(hear: Hear, key: str, news: bytes, delay: float) -> None:
        await asyncio.sleep(delay)
        hear(key, news)

    async def listen(self, pattern: str, hear: Hear) -> None:
        """Hear what is told from now on."""
        self._listeners.append((pattern, hear))
        self._net.listeners.append((pattern, hear))

    async def stand(self, key: str) -> None:
        """Be seen under ``key``."""
        self._keys.append(key)
        self._net.here.add(key)
        self._seen(key, there=True)

    def _seen(self, key: str, *, there: bool) -> None:
        if not there:
            if key not in self._net.here:
                return
            self._net.here.discard(key)
        for pattern, changed in self._net.watchers:
            if _matches(key, pattern):
                changed(key, there)

    async def standing(self, pattern: str) -> list[str]:
        """Who is seen now."""
        return sorted(key for key in self._net.here if _matches(key, pattern))

    async def watch(self, pattern: str, changed: Changed) -> None:
        """Be told who comes and goes."""
        self._watchers.append((pattern, changed))
        self._net.watchers.append((pattern, changed))
        for key in await self.standing(pattern):
            changed(key, True)  # noqa: FBT003 - as the callback has it

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


def _matches(key: str, pattern: str) -> bool:
    """``*`` stands for one word."""
    words, wanted = key.split("/"), pattern.split("/")
    return len(words) == len(wanted) and all(
        meant in {"*", word} for word, meant in zip(words, wanted, strict=True)
    )
