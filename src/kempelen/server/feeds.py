"""What is looked at again and again while somebody follows it."""

import asyncio
import logging
from collections.abc import Iterable
from typing import Protocol

from kempelen.app.eye import Eye
from kempelen.server.eyes_feed import SquaresFeed
from kempelen.server.house import House
from kempelen.server.scene_feed import SceneFeed
from kempelen.server.scene_source import scene_source

_AGAIN_S = 2.0
_log = logging.getLogger(__name__)


class Feed(Protocol):
    """Something that publishes a topic by itself."""

    async def run(self) -> None:
        """Until cancelled."""
        ...


async def kept_up(feed: Feed) -> None:
    """Run it until cancelled: a fault of one look is not the end of all."""
    while True:
        try:
            await feed.run()
        except Exception:  # noqa: BLE001 - whatever it was, the next look may go well
            _log.exception("%s failed", type(feed).__name__)
        await asyncio.sleep(_AGAIN_S)


def feeds(house: House) -> Iterable[Feed]:
    """All of a server; each is run as a task."""
    station, hub = house.station, house.hub

    def eye() -> Eye | None:
        return station.eyes.camera if station.eyes is not None and station.session is not None else None

    yield SquaresFeed(eye, lambda: hub.followed("squares"), lambda value: hub.put("squares", value))
    yield SceneFeed(
        lambda: scene_source(station),
        lambda: station.session,
        lambda: hub.followed("scene"),
        lambda news, everything: hub.put("scene", news, whole=everything),
    )
