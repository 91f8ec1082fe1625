"""`kempelen serve` as it is started from a shell, and driven over the network."""

import itertools
import json
import select
import signal
import socket
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx2
import pytest
from websockets.sync.client import connect

from kempelen.cli.remote_run import Remote
from kempelen.core.errors import NotationError
from kempelen.game.journal import JournalReader
from kempelen.server.doorplate import read
from kempelen.testing.scenarios import LINE_S, Program

pytestmark = pytest.mark.physics

_numbers = itertools.count()


class Served:
    """A server that runs, and its operator. Context manager."""

    def __init__(self, directory: Path, *options: str) -> None:
        self.directory = directory
        self.program = Program(
            "serve", "--no-browser", "--port", "0", "--data-dir", str(directory), "--speed", "max", *options
        )

    def __enter__(self) -> Self:
        self.program.__enter__()
        if not self.program.until("Ctrl-C"):
            self.program.kill()
            raise AssertionError(self.program.output + self.program.errors)
        address = read(self.directory)
        self.origin = address.origin
        self.cookies = {"kempelen_session": address.session}
        self.http = httpx2.Client(base_url=self.origin, cookies=self.cookies, timeout=60, trust_env=False)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.http.close()
        self.program.__exit__(kind, error, trace)

    @property
    def topics(self) -> Mapping[str, Any]:
        topics: Mapping[str, Any] = self.http.get("/api/state").json()["topics"]
        return topics

    def obey(self, name: str, **values: Any) -> dict[str, Any]:
        body = {"name": name, "id": f"command-{next(_numbers)}", **values}
        reply: dict[str, Any] = self.http.post("/api/commands", json=body).json()
        return reply

    def until(self, done: Callable[[Mapping[str, Any]], bool]) -> Mapping[str, Any]:
        """What is shown, as soon as it is so; the WebSocket tells of every change."""
        url = f"{self.origin.replace('http', 'ws')}/api/ws"
        cookie = "; ".join(f"{name}={value}" for name, value in self.cookies.items())
        with connect(url, additional_headers={"Cookie": cookie}, proxy=None) as page:
            page.send(json.dumps({"type": "follow", "topics": ["station", "robot", "game", "activity"]}))
            known: dict[str, Any] = {}
            until = time.monotonic() + LINE_S
            while not known or not done(known):
                message = json.loads(page.recv(timeout=max(until - time.monotonic(), 0.01)))
                changed = message.get("changed", message["topics"])
                known |= {name: message["topics"][name] for name in changed}
            return known

    def ready(self) -> None:
        self.until(lambda topics: topics["station"]["phase"] == "ready")


def persons_turn(topics: Mapping[str, Any]) -> bool:
    return topics["game"] is not None and topics["game"]["person_to_move"]


def test_a_game_over_http_survives_a_kill_and_ends_at_rest(tmp_path: Path) -> None:
    with Served(tmp_path) as server:
        server.ready()
        assert server.obey("new_game", mode="play", level="1", move_time=0.05)["ok"]
        server.until(persons_turn)
        stale = server.obey("move", uci="e2e4", ply=3)
        assert (stale["ok"], bool(stale["error"])) == (False, True)
        assert server.obey("move", uci="e2e4", ply=0)["ok"]
        topics = server.until(lambda topics: persons_turn(topics) and len(topics["game"]["moves"]) == 2)
        assert topics["game"]["moves"][0]["san"] == "e4"
        assert not server.obey("move", uci="e4e6", ply=2)["ok"]
        server.obey("move", uci="d2d4", ply=2)
        server.until(carrying)
        server.program.kill()
    with Served(tmp_path) as server:
        server.ready()
        assert server.obey("resume_game")["result"] == {"game": 1}
        topics = server.until(lambda topics: persons_turn(topics) and len(topics["game"]["moves"]) == 4)
        assert [move["san"] for move in topics["game"]["moves"]][::2] == ["e4", "d4"]
        _reads(server)
        _emergency_stop_and_back(server)
        _upload_without_end(server)
        server.program.send(signal.SIGINT)
        assert server.program.wait() == 0
        assert "Game 1 is kept: go on with it in the page" in server.program.output
        assert "Traceback" not in server.program.errors
        assert not (tmp_path / "server.json").exists()
    with JournalReader(tmp_path / "journal.sqlite3") as journal:
        assert journal.latest(unfinished=True) == 1


def carrying(topics: Mapping[str, Any]) -> bool:
    return topics["activity"] is not None and topics["activity"]["kind"] == "carrying"


def _reads(server: Served) -> None:
    pgn = server.http.get("/api/games/1/pgn")
    assert "1. e4" in pgn.text
    assert "attachment" in pgn.headers["content-disposition"]
    assert server.http.get("/api/games").json()["games"][0]["plies"] == 4
    address = read(server.directory)
    with Remote(address.origin, session=address.session) as remote:
        assert "e4" in remote.status()
        with pytest.raises(NotationError):
            remote.move("Ke8")
        assert "token=" in remote.link("player")


def _emergency_stop_and_back(server: Served) -> None:
    server.obey("swap_mode", mode="watch")
    server.until(carrying)
    assert server.obey("estop")["ok"]
    topics = server.until(lambda topics: topics["station"]["phase"] == "ready")
    while faults := topics["station"]["faults"]:  # each says what mends it
        assert server.obey(faults[0]["remedy"])["ok"], faults
        topics = server.until(partial(_mended, faults))
    plies = len(topics["game"]["moves"])
    server.until(lambda topics: len(topics["game"]["moves"]) > plies)


def _mended(faults: object, topics: Mapping[str, Any]) -> bool:
    return topics["station"]["faults"] != faults and not topics["station"]["busy"]


def _upload_without_end(server: Served) -> None:
    """A hundred megabytes, announced by nobody, are cut off early, and the sender is told why."""
    port = httpx2.URL(server.origin).port or 0
    head = (
        f"POST /api/pgn HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Type: application/json\r\n"
        "Transfer-Encoding: chunked\r\n\r\n"
    )
    sent, chunk = 0, b"10000\r\n" + b" " * 0x10000 + b"\r\n"
    with socket.create_connection(("127.0.0.1", port), timeout=LINE_S) as plug:
        plug.sendall(head.encode())
        while not select.select([plug], [], [], 0)[0]:
            plug.sendall(chunk)
            sent += 0x10000
            assert sent < 100 << 20
        assert plug.recv(1000).startswith(b"HTTP/1.1 413")
    assert sent < 30 << 20
    assert server.http.get("/api/me").status_code == 200
