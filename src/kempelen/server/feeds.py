"""What is looked at again and again while somebody follows it."""

from collections.abc import Iterable
from typing import Protocol

from kempelen.app.eye import Eye
from kempelen.server.eyes_feed import SquaresFeed
from kempelen.server.house import House
from kempelen.server.scene_feed import SceneFeed
from kempelen.server.scene_source import scene_source


class Feed(Protocol):
    """Something that publishes a topic by itself."""

    async def run(self) -> None:
        """Until cancelled."""
        ...


def feeds(house: House) -> Iterable[Feed]:
    """All of a server; each is run as a task."""
    station, hub = house.station, house.hub

    def eye() -> Eye | None:
        return station.eyes.eye if station.eyes is not None and station.session is not None else None

    yield SquaresFeed(eye, lambda: hub.followed("squares"), lambda value: hub.put("squares", value))
    yield SceneFeed(
        lambda: scene_source(station),
        lambda: station.session,
        lambda: hub.followed("scene"),
        lambda news, everything: hub.put("scene", news, whole=everything),
    )
