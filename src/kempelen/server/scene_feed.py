"""One look at the table for all who follow the 3D view."""

import asyncio
from collections.abc import Callable
from contextlib import suppress

from kempelen.core.errors import KempelenError
from kempelen.server.scene_source import Sample, SceneSource
from kempelen.server.topics import SceneView

MOVING_S = 0.05
"""Between two looks while something moves."""
RESTING_S = 0.125
"""Between two looks at a table at rest."""
ABSENT_S = 0.5
"""Until it is looked again whether there is a table, or somebody who looks at it."""

Publish = Callable[[SceneView | None, SceneView | None], None]


def whole_scene(sample: Sample | None) -> SceneView | None:
    """Everything that a look showed; None where there is no table."""
    if sample is None:
        return None
    return SceneView(
        tool=sample.tool,
        closed=sample.closed,
        hand=sample.hand,
        pieces=sample.pieces,
        table=sample.table,
        joints=sample.joints,
    )


def scene_news(before: Sample | None, after: Sample | None) -> SceneView | None:
    """What a look showed that is new to whoever knows the one before it.

    Pieces that are gone cannot be told piece by piece: then it is everything.
    """
    everything = whole_scene(after)
    if before is None or after is None or everything is None:
        return everything
    known = {piece.id: piece for piece in before.pieces}
    if known.keys() - {piece.id for piece in after.pieces}:
        return everything
    moved = tuple(piece for piece in after.pieces if known.get(piece.id) != piece)
    return everything.model_copy(update={"pieces": moved, "whole": False})


class SceneFeed:
    """Looks at the table for everybody who follows it, and only then.

    Args:
        source: A new source for the table that is up; None when there is none.
        table: Identifies that table: another object means another source; None when there is none.
        wanted: Whether anybody follows the scene.
        publish: Called after each look that showed something new: with the news, and with everything.
    """

    def __init__(
        self,
        source: Callable[[], SceneSource | None],
        table: Callable[[], object | None],
        wanted: Callable[[], bool],
        publish: Publish,
    ) -> None:
        self._make = source
        self._table = table
        self._wanted = wanted
        self._publish = publish
        self._of: object | None = None
        self._source: SceneSource | None = None
        self._seen: Sample | None = None
        self._known: object | None = None  # whose pieces were told last
        self._woken = asyncio.Event()

    async def run(self) -> None:
        """Look until cancelled."""
        while True:
            await self._wait(await self.step())

    def wake(self) -> None:
        """Look now: somebody came to look, or something begins to move."""
        self._woken.set()

    async def _wait(self, seconds: float) -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._woken.wait()
        self._woken.clear()

    async def step(self) -> float:
        """Look once, if anybody wants it; returns how long to wait until the next time, s."""
        if not self._wanted():
            return ABSENT_S
        before, sample = self._seen, await self._look()
        self._seen = sample
        if _shown(sample) != _shown(before):
            known = before if self._of is self._known else None
            self._publish(scene_news(known, sample), whole_scene(sample))
            self._known = self._of
        if sample is None:
            return ABSENT_S
        return RESTING_S if sample.resting else MOVING_S

    async def _look(self) -> Sample | None:
        table = self._table()
        if table is not self._of:
            self._of, self._source = table, None
        if self._source is None and table is not None:
            self._source = self._make()
        if self._source is None:
            return None
        try:
            return await self._source.sample()
        except KempelenError:  # it is being put away, or died: the station says so itself
            return None


def _shown(sample: Sample | None) -> object:
    return sample and (sample.tool, sample.closed, sample.hand, sample.pieces, sample.table, sample.joints)
