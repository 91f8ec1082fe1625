"""What the eyes read off the squares, for all who follow it, a few times a second, and only then."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

import numpy as np

from kempelen.core.senses import Observation
from kempelen.server.topics import SquaresView

PERIOD_S = 0.2
ABSENT_S = 0.5
"""Until it is looked again whether there are eyes, or somebody who wants to know."""
_WINDOW_S = 2.0
"""Over which the frame rate is measured."""


class Seeing(Protocol):
    """An open eye (`kempelen.app.eye.Eye`)."""

    async def next_after(self, mark: int, number: int) -> tuple[int, Observation]:
        """The newest observation after that of ``number``, and its own number."""
        ...


class SquaresFeed:
    """Run it as a task.

    Args:
        eye: The eye that is open now; None for none.
        wanted: Whether anybody follows.
        publish: Called with each new value; None when there is nothing to tell any more.
        period: Least time between two values, s.
    """

    def __init__(
        self,
        eye: Callable[[], Seeing | None],
        wanted: Callable[[], bool],
        publish: Callable[[SquaresView | None], None],
        *,
        period: float = PERIOD_S,
    ) -> None:
        self._eye = eye
        self._wanted = wanted
        self._publish = publish
        self._period = period
        self._looked: Seeing | None = None
        self._number = -1
        self._counted: list[tuple[float, int]] = []

    async def run(self) -> None:
        """Until cancelled."""
        while True:
            eye = self._eye() if self._wanted() else None
            if eye is not self._looked:
                self._looked, self._number, self._counted = eye, -1, []
            if eye is None:
                self._publish(None)
                await asyncio.sleep(ABSENT_S)
                continue
            with suppress(TimeoutError):  # an eye that is being closed tells nothing any more
                async with asyncio.timeout(ABSENT_S):
                    self._number, seen = await eye.next_after(0, self._number)
                    self._publish(squares_view(seen, self._rate()))
            await asyncio.sleep(self._period)

    def _rate(self) -> float:
        """Observations a second."""
        now = asyncio.get_running_loop().time()
        self._counted.append((now, self._number))
        while len(self._counted) > 2 and now - self._counted[0][0] > _WINDOW_S:  # noqa: PLR2004 - two make a rate
            self._counted.pop(0)
        since, first = self._counted[0]
        return (self._number - first) / (now - since) if now > since else 0.0


def squares_view(seen: Observation, fps: float) -> SquaresView:
    """What a page shows of an observation: no squares when it may not be believed."""
    if not seen.valid:
        return SquaresView(
            fps=round(fps, 1), occupancy=(), heights=None, sight=seen.sight.value, message=seen.message
        )
    rows = np.round(seen.occupancy, 3).tolist()
    heights = None
    if seen.heights is not None:
        measured = np.round(seen.heights, 1).tolist()
        heights = tuple(None if np.isnan(height) else height for height in measured)
    occupancy = tuple((empty, white, black) for empty, white, black in rows)
    return SquaresView(fps=round(fps, 1), occupancy=occupancy, heights=heights)
