"""A station at a gantry in this process: real games, journal and driver; no physics, only engines apart."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

import pytest

from kempelen.app.config import load_config
from kempelen.app.live_game import LiveGame
from kempelen.app.station import Station
from kempelen.app.station_types import Change
from kempelen.core.events import Event
from kempelen.testing.rigs import MemoryRig
from kempelen.testing.uci_engines import write_engine

CUE_S = 30.0
"""Longest wait for anything to happen, s, on a very busy machine."""


class MemoryStation:
    """Use as an async context manager.

    Args:
        folder: Of its data and its engine.
        monkeypatch: Puts the gantry in the place of the driver.
        options: Of the configuration, with ``__`` for dots.

    Attributes:
        station: With a robot at port "memory".
        rig: The gantry.
        changes: What was told.
        seen: Events of the games.
    """

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, **options: object) -> None:
        settings: dict[str, object] = {
            "data.dir": str(folder / "data"),
            "robot.port": "memory",
            "sensor.kind": "none",
            "engine.path": str(write_engine(folder)),
            "engine.move_time": 0.01,
        }
        settings |= {name.replace("__", "."): value for name, value in options.items()}
        self.rig = MemoryRig()
        monkeypatch.setattr(
            "kempelen.app.table_session.make_robot", lambda _config, _port, _table: self.rig.robot()
        )
        self.station = Station(load_config(None, settings))
        self.changes: list[Change] = []
        self.seen: list[Event] = []
        self._news = asyncio.Event()
        self.station.listen(self._changed)
        self.station.events.listen(self._happened)

    async def __aenter__(self) -> Self:
        """Let the gantry's time run."""
        await self.rig.__aenter__()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the station."""
        await self.station.aclose()
        await self.rig.__aexit__(kind, error, trace)

    def _changed(self, change: Change) -> None:
        self.changes.append(change)
        self._news.set()

    def _happened(self, event: Event) -> None:
        self.seen.append(event)
        self._news.set()

    @property
    def live(self) -> LiveGame:
        """The game on the table.

        Raises:
            AssertionError: there is none.
        """
        assert self.station.live is not None
        return self.station.live

    async def until(self, happened: Callable[[], object]) -> None:
        """Wait until something is so; looked at whenever the station tells of anything.

        Raises:
            TimeoutError: it is not so within half a minute.
        """
        async with asyncio.timeout(CUE_S):
            while not happened():
                self._news.clear()
                await self._news.wait()

    async def asked(self) -> None:
        """Until the person is to move."""
        await self.until(lambda: self.station.playing and self.live.cast.person.to_move)
