"""What the operator's pages read and save over HTTP: who may, what comes, what is refused."""

import logging
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from tests.unit.server.server_bench import app_in, client_of, house_of

from kempelen.app.calibration_file import save_calibration
from kempelen.app.doctor_rows import ok, warn
from kempelen.app.port_scan import FoundPort
from kempelen.app.station_types import Change, Phase
from kempelen.app.table_session import robot_kinds
from kempelen.core.calibration import calibrate
from kempelen.core.senses import Observation, Sight
from kempelen.robots.transport import WIRE
from kempelen.server import desk as desk_module
from kempelen.server import routes_eyes
from kempelen.server.desk import Desk
from kempelen.server.eyes_feed import squares_view

OPERATORS_ONLY = [
    ("GET", "/api/ports"),
    ("POST", "/api/ports/scan"),
    ("POST", "/api/fit"),
    ("PUT", "/api/table"),
    ("GET", "/api/logs/wire"),
    ("GET", "/api/logs/program"),
    ("GET", "/api/about/doctor"),
    ("POST", "/api/about/doctor"),
]


@pytest.fixture
def app(tmp_path: Path) -> FastAPI:
    return app_in(tmp_path)


@pytest.fixture
def operator(app: FastAPI) -> Iterator[TestClient]:
    with client_of(app, "operator") as client:
        yield client


@pytest.mark.parametrize("role", ["player", "spectator"])
def test_only_operators_may(app: FastAPI, role: Any) -> None:
    with client_of(app, role) as client:
        form = client.get("/api/table").json()["form"]
        for method, path in OPERATORS_ONLY:
            body = None if method == "GET" else form if path in {"/api/fit", "/api/table"} else {}
            assert client.request(method, path, json=body).status_code == 403, path
        assert client.get("/api/calibration").status_code == 200
        assert client.get("/api/about").json()["licence"] == "GPL-3.0-or-later"


# --- ports ------------------------------------------------------------------------------------------------


def test_a_scan_is_kept_for_who_asks_next(operator: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, str]] = []

    async def scan(in_use: str, address: str) -> tuple[FoundPort, ...]:
        asked.append((in_use, address))
        return (FoundPort("/dev/ttyUSB7", "A board", "grbl", "GRBL, Idle."),)

    monkeypatch.setattr(desk_module, "scan_ports", scan)
    assert operator.get("/api/ports").json() == {"kinds": [*robot_kinds()], "at": None, "ports": []}
    assert asked == []
    found = operator.post("/api/ports/scan", json={"address": " socket://host:23 "}).json()
    assert asked == [("", "socket://host:23")]
    assert found["ports"][0]["answer"] == "grbl"
    assert operator.get("/api/ports").json() == found


# --- table ------------------------------------------------------------------------------------------------


def test_the_table_comes_with_its_picture_and_fits(operator: TestClient) -> None:
    table = operator.get("/api/table").json()
    geometry = table["fit"]["geometry"]
    assert table["fit"]["findings"] == []
    assert [area["name"] for area in geometry["areas"]] == ["board", "left", "right"]
    assert geometry["areas"][0]["corners"] == [[150, 25], [550, 25], [550, 425], [150, 425]]
    assert len(geometry["places"]) == 64 + 32
    assert table["presets"]["club"]["king"]["height"] == 95
    assert not table["calibrated"]


def test_a_what_if_changes_nothing(operator: TestClient, tmp_path: Path) -> None:
    form = operator.get("/api/table").json()["form"]
    form["trays"][0]["origin"] = [-200, 25]
    seen = operator.post("/api/fit", json=form).json()
    assert ["left", "left1"] in [finding["where"] for finding in seen["findings"]]
    assert seen["tilts"] == {}
    assert operator.get("/api/table").json()["fit"]["findings"] == []
    assert list(tmp_path.iterdir()) == []


def test_a_saved_table_is_in_force_and_stays(operator: TestClient, tmp_path: Path) -> None:
    form = operator.get("/api/table").json()["form"]
    form["pieces"]["pawn"]["grip_height"] = 22.0
    saved = operator.put("/api/table", json=form)
    assert saved.status_code == 200
    assert saved.json()["fit"]["pieces"]["pawn"]["grip_height"] == 22
    assert operator.get("/api/table").json()["form"]["pieces"]["pawn"]["grip_height"] == 22
    with client_of(app_in(tmp_path), "operator") as later:
        assert later.get("/api/table").json()["form"]["pieces"]["pawn"]["grip_height"] == 22


def test_during_a_game_a_table_is_not_saved(
    app: FastAPI, operator: TestClient, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(type(house_of(app).station), "phase", Phase.PLAYING)
    table = operator.get("/api/table").json()
    assert "being played" in table["why_not"]
    refused = operator.put("/api/table", json=table["form"])
    assert refused.status_code == 409
    assert refused.json()["error"] == table["why_not"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "change",
    [
        {"square": 1},
        {"square": "NaN"},
        {"trays": [{"name": "../../etc", "origin": [0, 0]}]},
        {"pieces": {"preset": "huge"}},
        {"pieces": {"preset": "club", "king": {"grip_height": 200}}},
        {"path": "/etc/passwd"},
    ],
)
def test_a_form_that_cannot_be_is_refused(operator: TestClient, change: dict[str, Any]) -> None:
    form = operator.get("/api/table").json()["form"] | change
    for answer in (operator.post("/api/fit", json=form), operator.put("/api/table", json=form)):
        assert answer.status_code == 422
        assert answer.json()["error"]


def test_two_trays_of_one_name_are_told_and_not_kept(operator: TestClient, tmp_path: Path) -> None:
    form = operator.get("/api/table").json()["form"]
    form["trays"][1]["name"] = "left"
    answer = operator.put("/api/table", json=form)
    assert answer.status_code == 409
    assert "same name" in answer.json()["error"]
    assert list(tmp_path.iterdir()) == []


def test_the_calibration_in_force_is_told(app: FastAPI, operator: TestClient) -> None:
    before = operator.get("/api/calibration").json()
    assert not before["made"]
    assert before["pose"] == {"x": 150, "y": 25, "z": 0, "turn": 0, "tilt": 0}
    path = house_of(app).station.config.calibration_path
    corners = {"a1": (150.0, 25.0, 1.0), "h1": (550.0, 25.0, 1.0), "h8": (550.2, 425.0, 1.0)}
    save_calibration(path, calibrate(corners, date=datetime.now(UTC)))
    after = operator.get("/api/calibration").json()
    assert after["made"]
    assert after["checked"]
    assert set(after["corners"]) == set(corners)
    assert 0 < after["rms"] < 0.5
    assert 0 <= after["age"] < 60


# --- eyes -------------------------------------------------------------------------------------------------


class Drawn:
    """Eyes that count how often they are asked for a picture."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, tuple[str, ...], int]] = []

    async def layers(self, ground: str, layers: tuple[str, ...], width: int) -> bytes:
        self.asked.append((ground, layers, width))
        return b"\xff\xd8 a picture"

    async def parameters(self) -> list[dict[str, Any]]:
        return [
            {
                "name": "depth.noise", "value": 3.0, "estimate": 2.0, "unit": "mm", "low": 0.1, "high": 30.0,
                "about": "scatter", "source": "prior", "overridden": True,
            }
        ]  # fmt: skip


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> Drawn:
    eyes = Drawn()
    for module in (desk_module, routes_eyes):
        monkeypatch.setattr(module, "open_eyes", lambda _station: eyes)
    return eyes


def test_a_crowd_gets_one_picture(app: FastAPI, drawn: Drawn, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(desk_module, "FRESH_S", 3600.0)
    with client_of(app, "player") as client:
        path = "/api/eyes/picture?ground=depth&layers=hand&layers=squares&layers=hand&width=640"
        answers = [client.get(path) for _ in range(3)]
        assert {answer.headers["content-type"] for answer in answers} == {"image/jpeg"}
        assert answers[2].content == b"\xff\xd8 a picture"
        assert drawn.asked == [("depth", ("hand", "squares"), 640)]
        client.get("/api/eyes/picture")
        assert drawn.asked[1:] == [("colour", (), 960)]
        assert client.get("/api/eyes/parameters").json()[0]["value"] == 3


@pytest.mark.parametrize("query", ["ground=xray", "layers=everything", "width=10", "width=100000"])
def test_other_pictures_are_not_drawn(operator: TestClient, drawn: Drawn, query: str) -> None:
    assert operator.get(f"/api/eyes/picture?{query}").status_code == 422
    assert drawn.asked == []


def test_without_eyes_it_is_said_what_to_do(operator: TestClient) -> None:
    for path in ("/api/eyes/picture", "/api/eyes/parameters"):
        answer = operator.get(path)
        assert answer.status_code == 409
        assert "eyes on" in answer.json()["hint"]


def test_spectators_get_no_pictures(app: FastAPI) -> None:
    with client_of(app) as client:
        assert client.get("/api/eyes/picture").status_code == 403
        assert client.get("/api/eyes/parameters").status_code == 403


def test_squares_are_shown_as_far_as_they_may_be_believed() -> None:
    likelihood = np.zeros((64, 3))
    likelihood[0] = (-50, 0, -5)
    heights = np.full(64, np.nan)
    heights[0] = 52.04
    seen = squares_view(Observation(likelihood, 1.0, heights=heights), 7.25)
    assert seen.occupancy[0] == (0.0, 0.993, 0.007)
    assert seen.heights is not None
    assert seen.heights[:2] == (52.0, None)
    assert (seen.fps, seen.sight) == (7.2, "clear")
    dark = squares_view(Observation.blind(1.0, Sight.DARK, "Switch the light on."), 2.0)
    assert (dark.occupancy, dark.heights, dark.sight) == ((), None, "dark")
    assert dark.message == "Switch the light on."


# --- logs and about -----------------------------------------------------------------------------------------


def test_the_wire_is_found_by_number_and_text(app: FastAPI, operator: TestClient) -> None:
    wire = logging.getLogger(WIRE)
    wire.debug("%s %r", "out", b"$J=G21G90X10F600\n")
    wire.debug("%s %r", "in", b"ok\r\n")
    lines = operator.get("/api/logs/wire").json()["lines"]
    assert [(line["way"], line["text"]) for line in lines] == [("out", "$J=G21G90X10F600"), ("in", "ok")]
    first = lines[0]["number"]
    assert operator.get(f"/api/logs/wire?after={first}").json()["lines"] == lines[1:]
    assert operator.get("/api/logs/wire?match=g21").json()["lines"] == lines[:1]
    assert house_of(app).hub.wire.last == 2  # and to those who follow, at once
    assert operator.get("/api/logs/wire?limit=0").status_code == 422
    assert operator.get("/api/logs/wire?what=else").status_code == 422


def test_the_programs_log_tells_no_paths(operator: TestClient) -> None:
    logging.getLogger("kempelen.test").warning("The disk at %s is full", "/home/anna/games/db")
    lines = operator.get("/api/logs/program?match=disk").json()["lines"]
    assert [(line["level"], line["text"]) for line in lines] == [("WARNING", "The disk at db is full")]


def test_the_doctor_looks_once_and_tells_no_paths(
    operator: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def examine(_config: object, *, at_play: bool) -> Any:
        assert not at_play
        yield ok("disk", "10 MB free for /home/anna/games")
        yield warn("engine", "none", "Look into /usr/games/stockfish.")

    monkeypatch.setattr(desk_module, "examine_machine", examine)
    assert operator.get("/api/about/doctor").json() is None
    found = operator.post("/api/about/doctor").json()
    assert [row["found"] for row in found["rows"]] == ["10 MB free for games", "none"]
    assert found["rows"][1] == {
        "name": "engine", "status": "warn", "found": "none", "todo": "Look into stockfish."
    }  # fmt: skip
    assert operator.get("/api/about/doctor").json() == found


def test_a_doctor_who_takes_too_long_tells_what_he_has(
    operator: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def examine(_config: object, *, at_play: bool) -> Any:
        del at_play
        yield ok("first", "there")
        raise TimeoutError

    monkeypatch.setattr(desk_module, "examine_machine", examine)
    rows = operator.post("/api/about/doctor").json()["rows"]
    assert [(row["name"], row["status"]) for row in rows] == [("first", "ok"), ("doctor", "warn")]


def test_what_becomes_of_the_station_is_noted_once(app: FastAPI, operator: TestClient) -> None:
    desk = app.state.desk
    assert isinstance(desk, Desk)
    house_of(app).station.busy = "Homing …"
    for _ in range(3):
        house_of(app).station._tell(Change.STATION, Change.ROBOT)
    lines = operator.get("/api/logs/program?match=homing").json()["lines"]
    assert [line["text"] for line in lines] == ["Station: Homing …"]
