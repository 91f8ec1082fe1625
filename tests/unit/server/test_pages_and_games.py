"""The built page's files, the journal over HTTP, and uploads."""

from pathlib import Path

import pytest
from tests.unit.server.server_bench import app_in, client_of

PGN = (
    '[Event "<script>alert(1)</script>"]\n[White "<b>A</b>"]\n[Black "B"]\n[Result "1-0"]\n\n1. e4 e5 1-0\n\n'
)


@pytest.fixture
def page(tmp_path: Path) -> Path:
    folder = tmp_path / "page"
    (folder / "assets").mkdir(parents=True)
    (folder / "index.html").write_text("<title>Kempelen</title>")
    (folder / "assets" / "app-1.js").write_text("1")
    (folder / ".built-from").write_text("hidden")
    (tmp_path / "secret.txt").write_text("secret")
    (folder / "link").symlink_to(tmp_path / "secret.txt")
    return folder


def test_files_of_the_page_and_its_own_addresses(tmp_path: Path, page: Path) -> None:
    with client_of(app_in(tmp_path, page=page)) as client:
        script = client.get("/assets/app-1.js")
        assert "immutable" in script.headers["cache-control"]
        for path in ("/", "/setup", "/history/3", "/.built-from"):
            answer = client.get(path)
            assert "Kempelen" in answer.text
            assert answer.headers["cache-control"] == "no-cache"
        assert client.get("/api/nothing").status_code == 404
        assert client.get("/assets/gone.js").status_code == 404
        assert client.head("/").status_code in {200, 405}


@pytest.mark.parametrize(
    "path",
    [
        "/../secret.txt",
        "/%2e%2e/secret.txt",
        "/assets/..%2f..%2fsecret.txt",
        "/link",
        "/%00",
        "/" + "x" * 5000,
    ],
)
def test_nothing_outside_of_the_page(tmp_path: Path, page: Path, path: str) -> None:
    with client_of(app_in(tmp_path, page=page)) as client:
        answer = client.get(path)
        assert answer.status_code < 500
        assert "secret" not in answer.text


def test_a_page_that_was_not_built_says_so(tmp_path: Path) -> None:
    with client_of(app_in(tmp_path, page=tmp_path / "nothing")) as client:
        answer = client.get("/")
        assert (answer.status_code, "was not built" in answer.text) == (503, True)


def test_games_of_an_upload(tmp_path: Path) -> None:
    with client_of(app_in(tmp_path)) as client:
        answer = client.post("/api/pgn", json={"pgn": PGN * 600})
        listed = answer.json()
        assert (len(listed["games"]), listed["more"]) == (500, True)
        assert listed["games"][1]["number"] == 2
        assert listed["games"][0]["event"] == "<script>alert(1)</script>"  # text, as JSON
        assert answer.headers["content-type"] == "application/json"


@pytest.mark.parametrize("pgn", ["", "\0\0\0", "PK\x03\x04", "[" * 100_000, "x" * 500_000, "\ud800"])
def test_an_upload_that_is_none(tmp_path: Path, pgn: str) -> None:
    with client_of(app_in(tmp_path)) as client:
        body = b'{"pgn": "\\ud800"}' if pgn == "\ud800" else None
        answer = (
            client.post("/api/pgn", content=body, headers={"Content-Type": "application/json"})
            if body
            else client.post("/api/pgn", json={"pgn": pgn})
        )
        assert answer.status_code < 500
        assert answer.status_code == 200 or answer.json()["error"]


def test_no_games_yet(tmp_path: Path) -> None:
    with client_of(app_in(tmp_path)) as client:
        assert client.get("/api/games").json() == {"count": 0, "games": []}
        assert client.get("/api/games?first=-1").status_code == 422
        assert client.get("/api/games/1").status_code == 409
        assert client.get("/api/games/0").status_code == 422


def test_engines_and_the_address_for_phones(tmp_path: Path) -> None:
    with client_of(app_in(tmp_path)) as client:
        engines = client.get("/api/engines").json()
        assert engines[0]["engine"] == ""
        picture = client.get("/api/qr.svg")
        assert picture.headers["content-type"] == "image/svg+xml"
        assert picture.text.startswith("<svg")


def test_the_whole_state(tmp_path: Path) -> None:
    with client_of(app_in(tmp_path)) as client:
        state = client.get("/api/state").json()
        assert state["role"] == "spectator"
        assert state["topics"]["clients"] is None
        assert state["topics"]["station"]["phase"] == "off"
