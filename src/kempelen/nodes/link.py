"""What nodes need of a network: questions and answers, news, and who is there.

Keys are words between slashes, ``kempelen/1/hall-3/robot/do``; in patterns ``*`` stands for one word. A link
may lose, delay, repeat and reorder what it carries, and be cut and healed at any time: whoever uses one has
to stand that.
"""

from collections.abc import Awaitable, Callable
from typing import Protocol, Self

Answer = Callable[[bytes], Awaitable[bytes]]
"""Takes a question, gives the answer; runs in the loop, for several at once if need be."""
Hear = Callable[[str, bytes], None]
"""Takes key and content of a piece of news, in the loop."""
Changed = Callable[[str, bool], None]
"""Told that whoever stands for a key has come or gone, in the loop."""


class Link(Protocol):
    """One program's way to the others. Async context manager; what was declared ends with it."""

    async def __aenter__(self) -> Self:
        """Join.

        Raises:
            LinkError: the endpoints cannot be used, or a certificate was refused.
        """
        ...

    async def __aexit__(self, *exc: object) -> None:
        """Leave."""
        ...

    async def ask(self, key: str, question: bytes, *, seconds: float) -> bytes:
        """The answer of whoever answers for ``key``.

        Raises:
            LinkError: none came within ``seconds``. The question may have arrived all the same.
        """
        ...

    async def answer(self, key: str, answer: Answer) -> None:
        """Answer questions to ``key`` from now on."""
        ...

    async def tell(self, key: str, news: bytes) -> None:
        """Tell whoever listens; nobody waits for them."""
        ...

    async def listen(self, pattern: str, hear: Hear) -> None:
        """Hear what is told from now on."""
        ...

    async def stand(self, key: str) -> None:
        """Be seen under ``key`` as long as this link lives and reaches."""
        ...

    async def standing(self, pattern: str) -> list[str]:
        """Who is seen now, in order."""
        ...

    async def watch(self, pattern: str, changed: Changed) -> None:
        """Be told who comes and goes from now on; whoever is there already is told first."""
        ...
