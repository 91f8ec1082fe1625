"""Tokens, passwords, sessions: who may come in, once, and for how long."""

import json
import stat
from pathlib import Path

import pytest
from tests.unit.server.server_bench import ORIGIN, app_in, client_of, command, house_of

from kempelen.server.limits import Limiter, Rate
from kempelen.server.sessions import SESSION_LASTS_S, TOKEN_LASTS_S, Sessions, allows


class Clock:
    now = 1000.0

    def __call__(self) -> float:
        return self.now


def test_a_token_lets_in_once_and_not_for_ever() -> None:
    clock = Clock()
    sessions = Sessions(clock=clock)
    session = sessions.redeem(token := sessions.token("player"))
    assert session is not None
    assert sessions.visitor(session, "here").role == "player"
    assert sessions.redeem(token) is None
    late = sessions.token("operator")
    clock.now += TOKEN_LASTS_S
    assert sessions.redeem(late) is None
    clock.now += SESSION_LASTS_S
    assert sessions.visitor(session, "here").role == "spectator"


def test_passwords_are_of_roles() -> None:
    sessions = Sessions(passwords={"operator": "correct horse", "player": "battery staple"})
    for password, role in (("correct horse", "operator"), ("battery staple", "player")):
        session = sessions.enter(password)
        assert session is not None
        assert sessions.visitor(session, "").role == role
    assert sessions.enter("correct hors") is None
    assert sessions.enter("") is None
    assert Sessions().enter("") is None


def test_sessions_outlive_the_server_and_their_file_lets_nobody_in(tmp_path: Path) -> None:
    file = tmp_path / "sessions.json"
    first = Sessions(file)
    session = first.redeem(first.token("operator"))
    assert session is not None
    text = file.read_text()
    assert session not in text
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert Sessions(file).visitor(session, "").role == "operator"
    assert Sessions(file).visitor(next(iter(json.loads(text))), "").role == "spectator"
    Sessions(file).close(session)
    assert Sessions(file).visitor(session, "").role == "spectator"


@pytest.mark.parametrize(
    "text", ["", "[]", "{", '{"x": {"role": "king", "until": 9e99}}', '{"x": 1}', "\x00"]
)
def test_a_damaged_file_lets_nobody_in(tmp_path: Path, text: str) -> None:
    file = tmp_path / "sessions.json"
    file.write_text(text)
    assert Sessions(file).visitor("x", "").role == "spectator"


def test_roles_include_each_other() -> None:
    assert allows("operator", "player")
    assert not allows("spectator", "player")


def test_a_bucket_fills_again_and_those_of_others_are_others() -> None:
    clock = Clock()
    limiter = Limiter(Rate(per_second=1, burst=2), clock=clock)
    assert [limiter.take("a") for _ in range(3)] == [True, True, False]
    assert limiter.take("b")
    clock.now += 1
    assert [limiter.take("a") for _ in range(2)] == [True, False]
    for number in range(10_000):
        limiter.take(number)
    assert len(limiter._buckets) < 5000


def test_the_printed_link_becomes_a_cookie_that_no_script_reads(tmp_path: Path) -> None:
    app = app_in(tmp_path)
    with client_of(app) as client:
        token = house_of(app).sessions.token("operator")
        answer = client.get(f"/setup?token={token}")
        assert (answer.status_code, answer.headers["location"]) == (303, "/setup")
        cookie = answer.headers["set-cookie"].lower()
        assert "httponly" in cookie
        assert "samesite=strict" in cookie
        assert "secure" not in cookie
        assert client.get("/api/me").json()["role"] == "operator"
        assert client.delete("/api/session").status_code == 204
        assert client.get("/api/me").json()["role"] == "spectator"
        again = client.get(f"/?token={token}")
        assert again.headers["location"] == "/?link=used"
        assert "set-cookie" not in again.headers


def test_over_tls_the_cookie_stays_there(tmp_path: Path) -> None:
    app = app_in(tmp_path, secure=True)
    with client_of(app) as client:
        answer = client.get(f"/?token={house_of(app).sessions.token('player')}")
        assert "secure" in answer.headers["set-cookie"].lower()


@pytest.mark.parametrize(
    "path", ["//evil.example", "/\\evil.example", "/%5Cevil.example", "///evil.example/x"]
)
def test_a_link_leads_to_no_other_site(tmp_path: Path, path: str) -> None:
    with client_of(app_in(tmp_path)) as client:
        location = client.get(f"{ORIGIN}{path}?token=x").headers.get("location", "/")
        assert location[0] == "/"
        assert location[1:2] not in {"/", "\\"}


def test_passwords_over_http_and_not_too_many_tries(tmp_path: Path) -> None:
    app = app_in(tmp_path, passwords={"operator": "correct horse"})
    with client_of(app) as client:
        wrong = client.post("/api/session", json={"password": "wrong"})
        assert (wrong.status_code, "wrong." in wrong.json()["error"]) == (401, True)
        assert client.post("/api/session", json={"password": "correct horse"}).json()["role"] == "operator"
        client.delete("/api/session")
        tries = [client.post("/api/session", json={"password": str(n)}).status_code for n in range(10)]
        assert tries[-1] == 429
        assert client.post("/api/session", json={"password": "correct horse"}).status_code == 429
    assert house_of(app).tally.counts["entry"] >= 1


def test_nobody_becomes_more_than_they_are(tmp_path: Path) -> None:
    app = app_in(tmp_path)
    with client_of(app) as client:
        assert client.post("/api/session", json={"role": "operator"}).status_code == 422
        assert client.post("/api/session", json={}).status_code == 401
        assert client.post("/api/links", json={"role": "operator"}).status_code == 403
    with client_of(app, "player") as client:
        assert client.post("/api/links", json={"role": "operator"}).status_code == 403
        reply = client.post("/api/commands", json=command("disconnect") | {"role": "operator"})
        assert reply.status_code == 422
        reply = client.post(
            "/api/commands", json=command("disconnect", role="operator") | {"needs": "spectator"}
        )
        assert reply.status_code == 422
        assert not client.post("/api/commands", json=command("disconnect")).json()["ok"]
        for forged in ("operator", "x" * 500, "../../etc", ""):
            client.cookies.clear()
            client.cookies.set("kempelen_session", forged)
            assert client.get("/api/me").json()["role"] == "spectator"
    with client_of(app, "operator") as client:
        link = client.post("/api/links", json={"role": "player"}).json()
        client.cookies.clear()
        client.get(link["url"])
        assert client.get("/api/me").json()["role"] == "player"
