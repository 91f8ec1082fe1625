"""Commands: who may, once, not too many, and an e-stop always."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from pydantic import TypeAdapter
from tests.unit.server.server_bench import RecordingStation, app_in, client_of, command, station_in

from kempelen.server.commands import AnyCommand, Reply
from kempelen.server.deeds import _ACTS
from kempelen.server.dispatch import Dispatcher
from kempelen.server.problems import FAULT, Tally
from kempelen.server.sessions import Visitor

OPERATOR, PLAYER, SPECTATOR = (
    Visitor("operator", "a"),
    Visitor("player", "b"),
    Visitor("spectator", "c"),
)
_COMMAND: TypeAdapter[AnyCommand] = TypeAdapter(AnyCommand)


class Bench:
    def __init__(self, directory: Path) -> None:
        self.station: RecordingStation = station_in(directory)
        self.tally = Tally()
        self.dispatcher = Dispatcher(self.station, self.tally)

    async def obey(
        self,
        name: str,
        visitor: Visitor = OPERATOR,
        identity: str = "command-1",
        socket: str = "",
        **values: object,
    ) -> Reply:
        asked = _COMMAND.validate_python(command(name, identity, **values))
        return await self.dispatcher.obey(asked, visitor, socket)


@pytest_asyncio.fixture
async def bench(tmp_path: Path) -> AsyncIterator[Bench]:
    made = Bench(tmp_path)
    yield made
    await made.dispatcher.close()


def test_every_command_means_something() -> None:
    """Jogging, which is somebody's, is dealt with apart."""
    names = {model.__name__ for model in _ACTS} | {"Jog", "JogStop"}
    union = AnyCommand.__origin__  # type: ignore[attr-defined]
    assert names == {model.__name__ for model in union.__args__}


async def test_the_same_command_again_is_done_once(bench: Bench) -> None:
    first = await bench.obey("speed", speed=2)
    assert first.ok
    assert await bench.obey("speed", speed=2) == first
    assert await bench.obey("speed", PLAYER, speed=2) != first  # another client's id is another one
    assert bench.station.calls == [("speed", 2)]


async def test_the_same_command_while_it_is_being_done(bench: Bench) -> None:
    both = asyncio.gather(bench.obey("home"), bench.obey("home"))
    await asyncio.sleep(0)
    bench.station.gate.set()
    first, second = await both
    assert first == second
    assert bench.station.calls == [("home",)]


async def test_an_id_stands_for_one_command(bench: Bench) -> None:
    await bench.obey("speed", speed=2)
    forged = await bench.obey("speed", speed=3)
    assert (forged.ok, bench.station.calls) == (False, [("speed", 2)])
    assert bench.tally.counts["id"] == 1


async def test_a_failure_is_remembered_too(bench: Bench) -> None:
    first = await bench.obey("pause")
    assert (first.ok, first.error, first.hint) == (False, "No game is being played.", "Begin one.")
    assert await bench.obey("pause") == first


async def test_a_mistake_of_ours_tells_nothing(bench: Bench) -> None:
    reply = await bench.obey("resume")
    assert (reply.ok, reply.error, reply.hint) == (False, FAULT, "")


@pytest.mark.parametrize(("name", "values"), [("speed", {"speed": 1}), ("disconnect", {}), ("home", {})])
async def test_operators_alone(bench: Bench, name: str, values: dict[str, Any]) -> None:
    for visitor in (PLAYER, SPECTATOR):
        assert not (await bench.obey(name, visitor, **values)).ok
    assert bench.station.calls == []
    assert bench.tally.counts["role"] == 2


async def test_players_stop_the_robot_and_spectators_do_not(bench: Bench) -> None:
    assert (await bench.obey("estop", PLAYER)).ok
    assert not (await bench.obey("estop", SPECTATOR)).ok


async def test_too_many_commands_are_refused_and_an_emergency_stop_is_not(bench: Bench) -> None:
    replies = [await bench.obey("speed", identity=f"command-{n}", speed=1) for n in range(60)]
    assert [reply.ok for reply in replies[:20]] == [True] * 20
    assert not replies[-1].ok
    assert (await bench.obey("speed", Visitor("operator", "another"), speed=1)).ok
    for number in range(60):
        assert (await bench.obey("estop", identity=f"estop-{number:03}")).ok


async def test_an_emergency_stop_waits_for_nothing(bench: Bench) -> None:
    waiting = [asyncio.ensure_future(bench.obey("home", identity=f"command-{n}")) for n in range(20)]
    await asyncio.sleep(0)
    async with asyncio.timeout(5):
        assert (await bench.obey("estop", identity="estop-001")).ok
        bench.station.gate.set()
        replies = await asyncio.gather(*waiting)
    assert sum(reply.ok for reply in replies) == 16  # no more at once
    assert replies[-1].hint == "Wait for their answers."


async def test_jogging_is_the_sockets_own(bench: Bench) -> None:
    jog: dict[str, Any] = {"direction": (1, 0, 0), "speed": 50}
    assert not (await bench.obey("jog", **jog)).ok
    for number in range(50):
        assert (await bench.obey("jog", identity=f"command-{number}", socket="socket 1", **jog)).ok
    bench.dispatcher.gone("socket 1")
    await asyncio.sleep(0)
    assert bench.station.calls[0] == ("jog", "socket 1", (1, 0, 0), 50)
    assert bench.station.calls[-1] == ("left", "socket 1")


async def test_no_engine_but_those_offered(bench: Bench) -> None:
    """A free choice would let an operator run any program on this computer."""
    for number, engine in enumerate(("/bin/sh", "python3 -c pass", "../engine", "stockfish; rm")):
        reply = await bench.obey("new_game", identity=f"new-game-{number}", mode="play", engine=engine)
        assert "not offered" in reply.error


async def test_what_is_remembered_is_bounded(bench: Bench) -> None:
    bench.dispatcher._commands._rate = bench.dispatcher._commands._rate.__class__(1e9, 1e9)
    for number in range(2000):
        await bench.obey("speed", Visitor("operator", f"client {number % 700}"), f"command-{number}", speed=1)
    assert sum(len(kept) for kept in bench.dispatcher._done.values()) <= 2000
    assert len(bench.dispatcher._done) <= 512


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"name": "nothing", "id": "command-1"},
        {"name": "estop"},
        {"name": "estop", "id": "x"},
        {"name": "estop", "id": "../../etc/passwd"},
        {"name": "estop", "id": "command-1", "more": 1},
        {"name": "move", "id": "command-1", "uci": "e2e9"},
        {"name": "move", "id": "command-1", "uci": "<script>"},
        {"name": "speed", "id": "command-1", "speed": -1},
        {"name": "speed", "id": "command-1", "speed": "NaN"},
        {"name": "hand_carry", "id": "command-1", "source": [0, 1e9], "target": [0, 0]},
        [],
        "estop",
        None,
    ],
)
def test_what_cannot_be_understood(tmp_path: Path, body: object) -> None:
    with client_of(app_in(tmp_path), "operator") as client:
        answer = client.post("/api/commands", json=body)
        assert answer.status_code == 422
        assert "cannot be understood" in answer.json()["error"]
        assert "<script>" not in answer.text


@pytest.mark.parametrize(
    "text", [b"{", b"", b"\xff\xfe", b'{"name":"estop"', b"[" * 100_000, b'{"speed":NaN}']
)
def test_malformed_json(tmp_path: Path, text: bytes) -> None:
    with client_of(app_in(tmp_path), "operator") as client:
        answer = client.post("/api/commands", content=text, headers={"Content-Type": "application/json"})
        assert answer.status_code in {400, 413, 422}
        assert answer.json()["error"]


def test_errors_hold_no_path(tmp_path: Path) -> None:
    with client_of(app_in(tmp_path), "operator") as client:
        for path in ("/api/games/7", "/api/games/7/pgn"):
            answer = client.get(path)
            assert answer.status_code == 409
            assert str(tmp_path) not in answer.text
