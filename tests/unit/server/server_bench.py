"""A server over a station without a table, and its clients."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fastapi import FastAPI
from fastapi.testclient import TestClient

from kempelen.app.config import Config, load_config
from kempelen.app.station import Station
from kempelen.core.errors import GameError
from kempelen.server.app import create_app
from kempelen.server.commands import Role
from kempelen.server.house import House, Settings

ORIGIN = "http://127.0.0.1:8420"


class RecordingStation(Station):
    """Notes what it is told to do, and does not do it."""

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self.calls: list[tuple[Any, ...]] = []
        self.gate = asyncio.Event()

    async def set_speed(self, speed: float) -> None:
        self.calls.append(("speed", speed))

    async def home(self) -> None:
        """Takes until the gate opens."""
        self.calls.append(("home",))
        await self.gate.wait()

    async def stop(self) -> None:
        self.calls.append(("stop",))

    async def pause(self) -> None:
        raise GameError("No game is being played.", hint="Begin one.")

    async def resume(self) -> None:
        raise RuntimeError("a mistake at /secret/place")

    async def connect(self, kind: str, port: str) -> None:
        self.calls.append(("connect", kind, port))

    async def jog(self, owner: str, direction: tuple[float, float, float], speed: float) -> None:
        self.calls.append(("jog", owner, direction, speed))

    async def owner_left(self, owner: str) -> None:
        self.calls.append(("left", owner))


def station_in(directory: Path) -> RecordingStation:
    return RecordingStation(load_config(None, {"data.dir": str(directory), "sensor.kind": "none"}))


def app_in(directory: Path, **settings: Any) -> FastAPI:
    return create_app(station_in(directory), Settings(origin=ORIGIN, **settings))


def house_of(app: FastAPI) -> House:
    house = app.state.house
    assert isinstance(house, House)
    return house


@contextmanager
def client_of(app: FastAPI, role: Role = "spectator") -> Iterator[TestClient]:
    """A browser in this role."""
    with TestClient(app, base_url=ORIGIN, follow_redirects=False, raise_server_exceptions=False) as client:
        if role != "spectator":
            session = house_of(app).sessions.open(role)
            client.cookies.set("kempelen_session", session)
        yield client


def command(name: str, identity: str = "command-1", **values: Any) -> dict[str, Any]:
    return {"name": name, "id": identity, **values}
