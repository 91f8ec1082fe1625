"""The WebSocket: a snapshot, commands, and whoever sends nonsense or takes nothing."""

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from starlette.websockets import WebSocketDisconnect
from tests.unit.server.server_bench import (
    ORIGIN,
    RecordingStation,
    app_in,
    client_of,
    command,
    house_of,
    station_in,
)

from kempelen.server.house import House, Settings
from kempelen.server.sessions import Visitor
from kempelen.server.socket import ABORT, _Socket
from kempelen.server.topics import StationView

WS = f"{ORIGIN.replace('http', 'ws')}/api/ws"
FOLLOW = {"type": "follow", "topics": ["station", "clients"]}


def ask(name: str, identity: str = "command-1", **values: Any) -> dict[str, Any]:
    return {"type": "command", "command": command(name, identity, **values)}


def test_a_page_follows_and_commands(tmp_path: Path) -> None:
    app = app_in(tmp_path)
    with client_of(app, "operator") as client, client.websocket_connect(WS) as page:
        page.send_json(FOLLOW)
        snapshot = page.receive_json()
        assert (snapshot["type"], snapshot["role"]) == ("snapshot", "operator")
        assert snapshot["topics"]["station"]["phase"] == "off"
        page.send_json(ask("speed", speed=2))
        reply = page.receive_json()
        assert reply["type"] == "reply"
        told = {name: reply["reply"][name] for name in ("id", "ok", "error", "hint", "result")}
        assert told == {"id": "command-1", "ok": True, "error": "", "hint": "", "result": {}}


def test_a_spectators_page_commands_nothing(tmp_path: Path) -> None:
    app = app_in(tmp_path)
    with client_of(app) as client, client.websocket_connect(WS) as page:
        page.send_json(FOLLOW)
        assert page.receive_json()["topics"]["clients"] is None
        page.send_json(ask("estop"))
        assert not page.receive_json()["reply"]["ok"]
    assert house_of(app).tally.counts["role"] == 1


@pytest.mark.parametrize(
    "headers", [{"Origin": "http://evil.example"}, {"Host": "evil.example"}, {"Origin": "null"}]
)
def test_another_sites_page_gets_no_socket(tmp_path: Path, headers: dict[str, str]) -> None:
    with client_of(app_in(tmp_path), "operator") as client, pytest.raises(WebSocketDisconnect):  # noqa: SIM117
        with client.websocket_connect(WS, headers=headers):
            pass


def test_nonsense_is_refused_and_goes_on_only_for_so_long(tmp_path: Path) -> None:
    app = app_in(tmp_path)
    with client_of(app, "operator") as client, client.websocket_connect(WS) as other:
        with client.websocket_connect(WS) as page:
            page.send_text("{")
            assert page.receive_json()["type"] == "refused"
            page.send_json({"type": "become", "role": "operator"})
            assert "cannot be understood" in page.receive_json()["error"]
            page.send_json(ask("speed", speed=3))
            assert page.receive_json()["reply"]["ok"]
            with pytest.raises(WebSocketDisconnect) as closed:
                _flood(page)
            assert closed.value.code == 1008
        other.send_json(FOLLOW)
        assert other.receive_json()["topics"]["clients"]["operators"] == 1
    assert house_of(app).tally.counts["bytes"] >= 5


def _flood(page: Any) -> None:
    for _ in range(50):
        page.send_bytes(b"\0")
        page.receive_json()


def test_a_spectators_message_is_small(tmp_path: Path) -> None:
    with client_of(app_in(tmp_path)) as client, client.websocket_connect(WS) as page:
        page.send_json({"type": "follow", "topics": [], "more": "x" * 70_000})
        assert "too large" in page.receive_json()["error"]


def test_jogging_ends_with_its_page(tmp_path: Path) -> None:
    app = app_in(tmp_path)
    station = house_of(app).station
    assert isinstance(station, RecordingStation)
    with client_of(app, "operator") as client:
        with client.websocket_connect(WS) as page:
            page.send_json(ask("jog", direction=[1, 0, 0], speed=20))
            assert page.receive_json()["reply"]["ok"]
        _until(client, lambda: station.calls[-1][0] == "left")
    assert station.calls[0][1] == station.calls[-1][1]


def _until(client: TestClient, done: Any) -> None:
    for _ in range(200):
        if done():
            return
        client.get("/api/me")  # a turn of the loop
    raise AssertionError("it did not happen")


def test_a_socket_is_counted_as_long_as_it_is_open(tmp_path: Path) -> None:
    app = app_in(tmp_path)
    with client_of(app) as client:
        for _ in range(5):
            with client.websocket_connect(WS) as page:
                page.send_json(FOLLOW)
                page.receive_json()
        _until(client, lambda: house_of(app).hub.clients == 0)


class DeafSocket:
    """Takes what it is sent until its buffer is full, then nothing any more."""

    def __init__(self, room: int) -> None:
        self.sent: list[str] = []
        self.aborted = asyncio.Event()
        self.scope = {"extensions": {ABORT: self.aborted.set}}
        self._room = room
        self._asked = False

    async def receive(self) -> dict[str, Any]:
        if self._asked:
            await asyncio.Event().wait()
        self._asked = True
        return {"type": "websocket.receive", "text": json.dumps(FOLLOW)}

    async def send_text(self, text: str) -> None:
        if len(self.sent) >= self._room:
            await asyncio.Event().wait()
        self.sent.append(text)


async def test_a_socket_that_never_reads_is_let_go_of_and_disturbs_nobody(tmp_path: Path) -> None:
    house = House(station_in(tmp_path), Settings(send_s=0.1), "epoch")
    deaf, well = DeafSocket(room=1), DeafSocket(room=1_000_000)
    serving = [
        asyncio.ensure_future(_Socket(house, made, Visitor("spectator", str(id(made)))).serve())  # type: ignore[arg-type]
        for made in (deaf, well)
    ]
    async with asyncio.timeout(10):
        while not deaf.aborted.is_set():
            house.hub.put("station", StationView(speed=float(len(well.sent))))
            await asyncio.sleep(0.002)
        await serving[0]
    assert len(deaf.sent) == 1
    assert len(well.sent) > 5
    assert house.hub.clients == 1
    assert house.tally.counts["takes nothing"] == 1
    serving[1].cancel()
    await asyncio.gather(serving[1], return_exceptions=True)
    assert house.hub.clients == 0
    await house.dispatcher.close()
