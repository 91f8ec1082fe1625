"""How it stands at a table: told by its arbiter, seen by whoever looks over the hall."""

import contextlib
import time
from collections.abc import Callable, Mapping
from typing import Annotated

from pydantic import Field

from kempelen.core.errors import LinkError
from kempelen.nodes.link import Link
from kempelen.nodes.messages import Message, Number, key_of

_Text = Annotated[str, Field(max_length=300)]


class Status(Message):
    """Of one table, replaced whole.

    Attributes:
        program: Of its making: another one's counts begin anew.
        count: Rises; an older one that comes later is passed over.
        doing: What goes on, in a few words.
        trouble: What is wrong; empty when nothing is.
        result: Of the game; empty while it is played.
    """

    table: _Text
    program: _Text = ""
    count: int = 0
    game: int = 0
    white: _Text = ""
    black: _Text = ""
    fen: Annotated[str, Field(max_length=120)] = ""
    ply: int = 0
    last: Annotated[str, Field(max_length=20)] = ""
    doing: _Text = ""
    robot: Annotated[str, Field(max_length=20)] = ""
    paused: bool = False
    trouble: _Text = ""
    result: Annotated[str, Field(max_length=10)] = ""


async def stand_for(link: Link, table: str) -> None:
    """Be seen as the arbiter of a table, as long as ``link`` lives."""
    await link.stand(key_of(table, "arbiter"))


async def tell(link: Link, status: Status) -> None:
    """To whoever looks."""
    await link.tell(key_of(status.table, "status"), status.pack())


class Seen(Message):
    """A table as it is seen from afar.

    Attributes:
        status: The last that was heard; None before anything was.
        here: Whether its arbiter is on the network.
        heard: Of the looker's own clock, s; 0 before anything was heard.
    """

    status: Status | None = None
    here: bool = False
    heard: Number = 0.0


class HallView:
    """Every table of a hall.

    Args:
        link: Entered.
        changed: Called with a table's name when something about it has changed.
        clock: s.
    """

    def __init__(
        self,
        link: Link,
        changed: Callable[[str], None] = lambda _: None,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._link = link
        self._changed = changed
        self._clock = clock
        self._tables: dict[str, Seen] = {}

    async def open(self) -> None:
        """Begin to look; it ends with the link."""
        await self._link.listen(key_of("*", "status"), self._hear)
        await self._link.watch(key_of("*", "arbiter"), self._see)

    @property
    def tables(self) -> Mapping[str, Seen]:
        """By name, in order."""
        return dict(sorted(self._tables.items()))

    def _hear(self, key: str, content: bytes) -> None:
        with contextlib.suppress(LinkError):  # another program's, or damaged: the next one comes soon
            status = Status.unpack(content)
            table, before = key.split("/")[2], self._tables.get(key.split("/")[2], Seen())
            known = before.status
            if known is None or status.program != known.program or status.count > known.count:
                self._put(table, before.model_copy(update={"status": status, "heard": self._clock()}))

    def _see(self, key: str, here: bool) -> None:  # noqa: FBT001 - as `Link.watch` tells it
        table = key.split("/")[2]
        self._put(table, self._tables.get(table, Seen()).model_copy(update={"here": here}))

    def _put(self, table: str, seen: Seen) -> None:
        self._tables[table] = seen
        self._changed(table)
