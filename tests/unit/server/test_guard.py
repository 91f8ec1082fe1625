"""What every request must pass: name, origin, kind and size."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from starlette.types import Message, Receive, Scope, Send
from tests.unit.server.server_bench import app_in, client_of, house_of

from kempelen.server.problems import Tally
from kempelen.server.security import LARGE, SMALL, Guard

EVIL = "http://evil.example"


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8420", "localhost", "LOCALHOST:1", "[::1]:8420", "192.168.7.7", "table.lan"]
)
def test_names_of_this_machine(tmp_path: Path, host: str) -> None:
    with client_of(app_in(tmp_path, names=frozenset({"table.lan"}))) as client:
        assert client.get("/api/me", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "127.0.0.1.evil.example",
        "localhost.evil.example:8420",
        "",
        "a@localhost",
        "localhost:x",
    ],
)
def test_a_name_that_leads_here_from_elsewhere_is_refused(tmp_path: Path, host: str) -> None:
    app = app_in(tmp_path)
    with client_of(app, "operator") as client:
        answer = client.get("/api/state", headers={"Host": host})
        assert answer.status_code == 421
        assert answer.json()["hint"]
    assert house_of(app).tally.counts["421"] == 1


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": EVIL},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": "http://127.0.0.1:8420.evil.example"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_another_sites_page_commands_nothing(tmp_path: Path, headers: dict[str, str]) -> None:
    app = app_in(tmp_path)
    with client_of(app, "operator") as client:
        body = {"name": "speed", "id": "12345678", "speed": 2}
        assert client.post("/api/commands", json=body, headers=headers).status_code == 403
        assert client.delete("/api/session", headers=headers).status_code == 403
    assert house_of(app).station.calls == []  # type: ignore[attr-defined]


def test_our_own_page_and_programs_do(tmp_path: Path) -> None:
    with client_of(app_in(tmp_path), "operator") as client:
        for number, origin in enumerate(({"Origin": "http://127.0.0.1:8420"}, {})):
            body = {"name": "speed", "id": f"12345678{number}", "speed": 2}
            assert client.post("/api/commands", json=body, headers=origin).json()["ok"]


def test_forms_are_refused(tmp_path: Path) -> None:
    with client_of(app_in(tmp_path), "operator") as client:
        body = b'{"name":"estop","id":"12345678"}'
        for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data", ""):
            answer = client.post("/api/commands", content=body, headers={"Content-Type": kind})
            assert answer.status_code == 415
        answer = client.post(
            "/api/commands", content=body, headers={"Content-Type": "application/json; charset=utf-8"}
        )
        assert answer.json()["ok"]


@pytest.mark.parametrize(("path", "limit"), [("/api/session", SMALL), ("/api/pgn", LARGE)])
def test_what_is_announced_as_too_large_is_not_read(tmp_path: Path, path: str, limit: int) -> None:
    with client_of(app_in(tmp_path)) as client:
        content = b'{"pgn": "' + b"x" * limit + b'"}'
        answer = client.post(path, content=content, headers={"Content-Type": "application/json"})
        assert answer.status_code == 413
        assert f"{limit // 1024} kB" in answer.json()["error"]


async def test_what_turns_out_too_large_is_cut_off(tmp_path: Path) -> None:
    """A hundred megabytes, announced by nobody."""
    app, sent, read = app_in(tmp_path), list[Message](), 0

    async def receive() -> Message:
        nonlocal read
        if read >= 100 << 20:
            return {"type": "http.request", "body": b"", "more_body": False}
        read += 1 << 20
        return {"type": "http.request", "body": b" " * (1 << 20), "more_body": True}

    async def send(message: Message) -> None:
        sent.append(message)

    await app(_scope("POST", "/api/pgn", [(b"transfer-encoding", b"chunked")]), receive, send)
    assert sent[0]["status"] == 413
    assert b"too large" in sent[1]["body"]
    assert read < 40 << 20  # little more than is dropped so that the answer arrives


@pytest.mark.parametrize("length", ["-1", "1e3", "\u0661", "12x"])
async def test_a_length_that_is_no_number(length: str) -> None:
    assert await _status(headers=[(b"content-length", length.encode("utf-8"))]) == 400


async def test_two_hosts_are_none() -> None:
    assert await _status(headers=[(b"host", b"localhost")]) == 421


async def test_a_client_that_goes_on_sending_is_not_waited_for_for_ever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("kempelen.server.security._DRAIN_S", 0.05)

    async def receive() -> Message:
        await asyncio.sleep(3600)
        return {}

    assert await _status(headers=[(b"content-length", b"99999999")], receive=receive) == 413


def test_every_answer_has_the_headers(tmp_path: Path) -> None:
    with client_of(app_in(tmp_path)) as client:
        for path in ("/", "/api/me", "/api/nothing", "/assets/nothing.js"):
            headers = client.get(path).headers
            policy = headers["content-security-policy"]
            assert "script-src 'self';" in policy
            assert "unsafe" not in policy
            assert "frame-ancestors 'none'" in policy
            assert headers["x-content-type-options"] == "nosniff"
            assert headers["referrer-policy"] == "no-referrer"
        assert client.get("/api/me").headers["cache-control"] == "no-store"
        assert "content-security-policy" in client.post("/api/commands", content=b"x").headers


def _scope(method: str, path: str, headers: list[tuple[bytes, bytes]]) -> Scope:
    usual = [(b"host", b"127.0.0.1:8420"), (b"content-type", b"application/json")]
    return {
        "type": "http", "method": method, "path": path, "raw_path": path.encode(), "query_string": b"",
        "headers": [*usual, *headers], "client": ("127.0.0.1", 5), "server": ("127.0.0.1", 8420),
        "scheme": "http", "http_version": "1.1", "root_path": "",
    }  # fmt: skip


async def _nothing() -> Message:
    return {"type": "http.request", "body": b"", "more_body": False}


async def _status(headers: list[tuple[bytes, bytes]], receive: Receive = _nothing) -> int:
    sent: list[Any] = []

    async def inner(scope: Scope, receive: Receive, send: Send) -> None:
        raise AssertionError((scope, receive, send))

    async def send(message: Message) -> None:
        sent.append(message)

    await Guard(inner, frozenset(), Tally())(_scope("POST", "/api/pgn", headers), receive, send)
    return int(sent[0]["status"])
