"""The twin's side door over a network: ground truth for reports, requests to the virtual person."""

import json
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Self

from pydantic import Field, JsonValue

from kempelen.core.errors import KempelenError, LinkError, TwinError
from kempelen.nodes.link import Link
from kempelen.nodes.messages import Message, Trouble, key_of

Open = Callable[..., Awaitable[Mapping[str, Any]]]
"""`kempelen.twin.client.TwinControl.ask`, or what does the same."""
_ANSWER_S = 30.0


class Request(Message):
    """One request to the twin."""

    op: str
    arguments: dict[str, JsonValue] = Field(default_factory=dict)


class Reply(Message):
    """What the twin said, as JSON, or what went wrong."""

    answer: str = ""
    trouble: Trouble | None = None


async def open_door(link: Link, table: str, ask: Open) -> None:
    """Let others in, as long as ``link`` lives."""

    async def answer(content: bytes) -> bytes:
        try:
            request = Request.unpack(content)
            return Reply(answer=json.dumps(await ask(request.op, **request.arguments))).pack()
        except KempelenError as error:
            return Reply(trouble=Trouble.of(error)).pack()

    await link.answer(key_of(table, "door"), answer)
    await link.stand(key_of(table, "door"))


class RemoteDoor:
    """Asks a twin at another machine's node.

    Args:
        link: Entered.
        table: At which the twin is.
    """

    def __init__(self, link: Link, table: str) -> None:
        self._link = link
        self._table = table

    def beside(self) -> "RemoteDoor":
        """A further way: requests never wait for each other here."""
        return RemoteDoor(self._link, self._table)

    async def __aenter__(self) -> Self:
        """Nothing to be done: the link is there."""
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Nothing to be done."""

    async def ask(self, op: str, **arguments: Any) -> Mapping[str, Any]:
        """One request, one answer.

        Raises:
            TwinError: the twin refused, or cannot be reached.
        """
        question = Request(op=op, arguments=arguments).pack()
        try:
            content = await self._link.ask(key_of(self._table, "door"), question, seconds=_ANSWER_S)
        except LinkError as error:
            raise TwinError(
                f"The twin at table {self._table} cannot be reached: {error.message}",
                hint="Look after its node and the network.",
            ) from None
        reply = Reply.unpack(content)
        if reply.trouble is not None:
            raise reply.trouble.error()
        answer = json.loads(reply.answer)
        if not isinstance(answer, dict):
            raise LinkError(f"The twin at table {self._table} answered '{op}' with something odd.")
        return answer
