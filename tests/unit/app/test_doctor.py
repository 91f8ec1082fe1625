import asyncio
import io
import os
import shutil
import socket
import tempfile
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import pytest

from kempelen.app import doctor, doctor_ports, doctor_probe
from kempelen.app.calibration_file import save_calibration
from kempelen.app.config import Config, load_config
from kempelen.app.doctor_camera import check_camera_pose, examine_camera
from kempelen.app.doctor_ports import examine_port, examine_serial_ports, permission_advice
from kempelen.app.doctor_probe import examine_physics, examine_rendering, run_probe
from kempelen.app.doctor_rows import Check, Status
from kempelen.core.calibration import calibrate
from kempelen.engines.probe import EngineReport
from kempelen.robots.transport import PortInfo

WHEN = datetime(2026, 5, 1, 12, 30, tzinfo=UTC)
CORNERS = {"a1": (150.0, 25.0, 0.0), "h1": (550.0, 25.0, 0.0), "h8": (550.0, 425.0, 0.0)}


@pytest.fixture(autouse=True)
def _nobodys_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("KEMPELEN_DATA_DIR", str(tmp_path / "data"))


def is_ok(check: Check) -> bool:
    return check.status is Status.OK and not check.todo


def test_python_is_new_enough_or_not() -> None:
    assert is_ok(doctor.check_python((3, 11, 2)))
    old = doctor.check_python((3, 10, 12))
    assert old.status is Status.FAIL
    assert "3.10.12" in old.found
    assert "3.11" in old.todo


def test_a_wrong_configuration_fails_and_the_defaults_stand_in(tmp_path: Path) -> None:
    config, check = doctor.check_config(None, None)
    assert is_ok(check)
    assert "defaults" in check.found
    file = tmp_path / "k.toml"
    file.write_text("[twin]\nsped = 3\n")
    config, check = doctor.check_config(file, None)
    assert config == Config()
    assert check.status is Status.FAIL
    assert "Did you mean 'speed'" in check.found
    file.write_text("[twin]\nspeed = 3\n")
    config, check = doctor.check_config(file, None)
    assert config.twin.speed == 3
    assert is_ok(check)
    assert str(file) in check.found


def test_calibration_is_wanted_on_a_machine_only() -> None:
    assert is_ok(doctor.check_calibration(load_config())[1])
    check = doctor.check_calibration(load_config(None, {"robot.port": "/dev/ttyUSB0"}))[1]
    assert check.status is Status.WARN
    assert "kempelen calibrate" in check.todo


def test_a_calibration_is_shown_doubted_or_refused() -> None:
    config = load_config()
    save_calibration(config.calibration_path, calibrate(CORNERS, date=WHEN))
    found, check = doctor.check_calibration(config)
    assert found is not None
    assert is_ok(check)
    assert "squares 50.00 mm" in check.found
    two = {name: CORNERS[name] for name in ("a1", "h1")}
    save_calibration(config.calibration_path, calibrate(two, date=WHEN))
    assert doctor.check_calibration(config)[1].status is Status.WARN
    config.calibration_path.write_text("{")
    found, check = doctor.check_calibration(config)
    assert found is None
    assert check.status is Status.FAIL
    assert "damaged" in check.found


def test_what_does_not_fit_is_listed() -> None:
    assert is_ok(doctor.check_table(load_config(), None))
    check = doctor.check_table(load_config(None, {"table.board": [150.0, 80.0, 0.0]}), None)
    assert check.status is Status.FAIL
    assert "Reach of the board" in check.found
    trays = [{"name": "one", "origin": [0, 0]}, {"name": "one", "origin": [0, 0]}]
    check = doctor.check_table(load_config(None, {"table.trays": trays}), None)
    assert check.status is Status.FAIL
    assert "same name" in check.found


def test_the_planners_clearance_counts_in_the_fit() -> None:
    config = load_config(None, {"planner.clearances.vertical": 50.0, "table.space.upper": [700, 450, 160]})
    assert "Lift" in doctor.check_table(config, None).found


@pytest.mark.parametrize(("free_mb", "status"), [(10_000, Status.OK), (300, Status.WARN), (19, Status.FAIL)])
def test_disk_space(free_mb: int, status: Status, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = shutil.disk_usage(tmp_path)._replace(free=free_mb * 1_000_000)
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: usage)
    check = doctor.check_space(tmp_path / "not" / "yet" / "there")
    assert check.status is status
    assert f"{free_mb:,} MB free" in check.found
    assert not (tmp_path / "not").exists()


def test_a_directory_without_permission_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert "cannot be written" in doctor.check_space(tmp_path).found


def test_disk_speed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert doctor.sync_seconds(tmp_path) > 0
    monkeypatch.setattr(doctor, "sync_seconds", lambda _place: 0.004)
    assert doctor.check_sync(tmp_path).found == "4.0 ms to confirm a write"
    monkeypatch.setattr(doctor, "sync_seconds", lambda _place: 0.2)
    assert doctor.check_sync(tmp_path).status is Status.WARN


def test_a_broken_disk_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(**_options: object) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(tempfile, "TemporaryFile", broken)
    check = doctor.check_sync(tmp_path)
    assert check.status is Status.FAIL
    assert "Input/output error" in check.found


def test_the_first_engine_is_needed_further_ones_are_not() -> None:
    good = EngineReport("Stockfish 17", "/usr/games/stockfish", "on PATH", works=True)
    bad = EngineReport("maia-1100", fault="it ended with code 1.", hint="Install it again.")
    assert [check.status for check in doctor.check_engines([good, bad])] == [Status.OK, Status.WARN]
    (only,) = doctor.check_engines([bad])
    assert (only.status, only.found, only.todo) == (
        Status.FAIL,
        "maia-1100: it ended with code 1.",
        "Install it again.",
    )


class Screen(io.TextIOWrapper):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def screen() -> Iterator[Screen]:
    with Screen(io.BytesIO(), encoding="utf-8") as stream:
        yield stream


def test_terminals(screen: Screen, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "120")
    assert is_ok(*doctor.check_terminal(screen))
    monkeypatch.setenv("COLUMNS", "60")
    (narrow,) = doctor.check_terminal(screen)
    assert narrow.found == "60 columns"
    with io.TextIOWrapper(io.BytesIO(), encoding="latin-1") as old:
        (check,) = doctor.check_terminal(old)
        assert check.status is Status.WARN
    with io.TextIOWrapper(io.BytesIO(), encoding="utf-8") as pipe:
        (check,) = doctor.check_terminal(pipe)
        assert is_ok(check)


async def test_ports_that_are_not_there(tmp_path: Path) -> None:
    assert is_ok(await examine_port("twin"))
    absent = await examine_port("/dev/ttyNOWHERE")
    assert absent.found == "there is no /dev/ttyNOWHERE"
    file = tmp_path / "file"
    file.touch()
    assert "no serial port" in (await examine_port(str(file))).found


async def test_a_device_and_its_permission(monkeypatch: pytest.MonkeyPatch) -> None:
    assert is_ok(await examine_port(os.devnull))
    monkeypatch.setattr(os, "access", lambda *_: False)
    check = await examine_port(os.devnull)
    assert check.status is Status.FAIL
    assert "no permission" in check.found


def test_permission_advice(tmp_path: Path) -> None:
    device = tmp_path / "ttyUSB0"
    assert permission_advice(device) == "Plug it in again."
    device.touch(mode=0o600)
    assert permission_advice(device) == f"Allow it: sudo chmod a+rw {device}"
    device.chmod(0o660)
    assert permission_advice(device).startswith("Join its group, then log in again: sudo usermod -aG ")


def test_serial_ports_are_listed() -> None:
    ports = [PortInfo("/dev/ttyUSB0", "QinHeng CH340", usable=True), PortInfo("/dev/ttyS9", "", usable=False)]
    usable, forbidden = examine_serial_ports(ports)
    assert is_ok(usable)
    assert usable.found == "/dev/ttyUSB0 QinHeng CH340"
    assert forbidden.status is Status.WARN
    (none,) = examine_serial_ports([])
    assert is_ok(none)


async def test_a_socket_that_answers_and_one_that_does_not() -> None:
    server = await asyncio.start_server(lambda _, writer: writer.close(), "127.0.0.1", 0)
    async with server:
        number = server.sockets[0].getsockname()[1]
        assert is_ok(await examine_port(f"socket://127.0.0.1:{number}"))
    with socket.socket() as unheard:
        unheard.bind(("127.0.0.1", 0))
        check = await examine_port(f"socket://127.0.0.1:{unheard.getsockname()[1]}")
    assert check.status is Status.FAIL
    assert "cannot be reached" in check.found


async def test_a_socket_that_keeps_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    async def never(*_address: object) -> None:
        await asyncio.Event().wait()

    monkeypatch.setattr(asyncio, "open_connection", never)
    monkeypatch.setattr(doctor_ports, "_REACH_SECONDS", 0.01)
    assert "no answer within" in (await examine_port("socket://192.0.2.1:23")).found


@pytest.mark.parametrize(
    ("port", "said"),
    [
        ("socket://", "has no host and no port number"),
        ("socket://robot", "has no port number"),
        ("socket://robot:many", "has no host and no port number"),
    ],
)
async def test_a_socket_address_that_is_none(port: str, said: str) -> None:
    check = await examine_port(port)
    assert said in check.found
    assert "socket://HOST:PORT" in check.todo


async def test_a_probe_that_works_fails_or_hangs() -> None:
    assert (await run_probe("print('first'); print('last')")).said == "last"
    broken = await run_probe("raise RuntimeError('no display')")
    assert not broken.worked
    assert broken.said == "RuntimeError: no display"
    assert (await run_probe("import os; os.abort()")).said == "exit code -6"
    hanging = await run_probe("input_never = __import__('threading').Event().wait()", seconds=0.3)
    assert hanging.said == "no answer within 0.3 s"
    seen = await run_probe("import os; print(os.environ['MUJOCO_GL'])", MUJOCO_GL="egl")
    assert seen.said == "egl"


async def test_physics_works_here() -> None:
    assert is_ok(await examine_physics())


async def test_broken_physics_fails_with_its_complaint(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor_probe, "_PHYSICS", "import mujoco_that_is_not_there")
    check = await examine_physics()
    assert check.status is Status.FAIL
    assert "No module named 'mujoco_that_is_not_there'" in check.found


async def test_no_gl_is_a_warning_with_each_librarys_complaint() -> None:
    check = await examine_rendering(["nonsense"])
    assert check.status is Status.WARN
    assert "nonsense: " in check.found


async def test_all_of_it_on_this_machine() -> None:
    rows = [row async for row in doctor.examine()]
    names = [row.name for row in rows]
    assert names[:7] == ["Python", "configuration", "calibration", "table", "disk", "disk speed", "robot"]
    assert {"serial port", "engine", "physics", "rendering", "terminal"} <= set(names)
    assert [row for row in rows if row.status is Status.FAIL and row.name != "engine"] == []
    assert all(row.todo for row in rows if row.status is not Status.OK)


async def test_the_camera_is_opened_and_described(tmp_path: Path) -> None:
    picture = tmp_path / "board.png"
    cv2.imwrite(str(picture), np.full((48, 64, 3), 90, np.uint8))
    seen = {"sensor.kind": "camera", "data.dir": str(tmp_path)}
    row = await examine_camera(load_config(None, {**seen, "camera.source": f"picture:{picture},frames=0"}))
    assert (row.status, "colour 64 x 48" in row.found) == (Status.OK, True)
    row = await examine_camera(load_config(None, {**seen, "camera.source": "picture:nowhere.png"}))
    assert row.status is Status.FAIL
    row = await examine_camera(load_config(None, {**seen, "camera.source": "spyglass:0"}))
    assert (row.status, "Cameras:" in row.todo) == (Status.FAIL, True)


async def test_a_machine_without_a_camera_needs_none(tmp_path: Path) -> None:
    machine = {"robot.port": "/dev/ttyUSB0", "data.dir": str(tmp_path)}
    assert (await examine_camera(load_config(None, machine))).status is Status.OK
    wanted = load_config(None, {**machine, "sensor.kind": "camera"})
    assert (await examine_camera(wanted)).status is Status.WARN
    assert check_camera_pose(wanted).todo == "Measure it once: kempelen calibrate --camera"
    wanted.camera_calibration_path.write_text("{}")
    assert check_camera_pose(wanted).status is Status.FAIL


async def test_the_twins_camera_draws_somehow() -> None:
    row = await examine_camera(load_config(None, {"sensor.kind": "camera"}))
    assert (row.status, row.found.startswith("the twin's, drawn by")) == (Status.OK, True)
