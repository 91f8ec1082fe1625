"""The eyes of a station: opened while nobody plays, set by hand, recorded, asked where the board is."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Self

import numpy as np
import pytest
import pytest_asyncio

from kempelen.app.calibration_file import load_calibration
from kempelen.app.camera_pose import BoardPose, CameraPose, save_camera_pose
from kempelen.app.config import Config
from kempelen.app.station_types import Change
from kempelen.core.errors import CalibrationError, GameError, SensorError
from kempelen.core.events import SensorChanged
from kempelen.core.geometry import Transform
from kempelen.core.places import Layout
from kempelen.core.senses import Sight
from kempelen.frames.host import CameraProcess
from kempelen.frames.recording import Recording
from kempelen.testing.cameras import SCRIPTED
from kempelen.testing.stations import MemoryStation

CAMERA = Transform.about_z(0.3, (400.0, 200.0, 900.0))
"""Of the robot's frame: any place will do."""


@dataclass
class FakeEyes:
    """In the place of `kempelen.app.eyes.GameEyes`: sees the board where ``board`` says."""

    config: Config
    tell: Any
    board: Transform = field(default_factory=lambda: Transform.about_z(0.0, (160.0, 25.0, 0.0)))
    ring: str = ""
    trouble: str = ""
    expected: Layout | None = None

    def __post_init__(self) -> None:
        self.values: dict[str, float | None] = {}
        self.eye = SimpleNamespace(set=self._set)

    async def _set(self, name: str, value: float | None) -> None:
        if name != "grain":
            raise SensorError(f"There is no parameter '{name}'.", hint="See them all.")
        self.values[name] = value

    async def open(self, _session: object) -> Self:
        return self

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        pass

    def expect(self, layout: Layout) -> None:
        self.expected = layout

    async def pose(self) -> BoardPose:
        return BoardPose(CAMERA.inverse() @ self.board, 0.1)


@pytest_asyncio.fixture
async def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[MemoryStation]:
    monkeypatch.setattr("kempelen.app.eyes.GameEyes", FakeEyes)
    async with MemoryStation(tmp_path, monkeypatch, camera__source="uvc:0") as table:
        await table.station.connect("gantry", "memory")
        yield table


def eyes(table: MemoryStation) -> FakeEyes:
    found: Any = table.station.eyes
    assert isinstance(found, FakeEyes)
    return found


async def test_opened_and_closed(table: MemoryStation) -> None:
    station = table.station
    assert station.eyes is None
    await station.set_eyes(on=True)
    assert eyes(table).expected == station.standing
    first = station.eyes
    await station.set_eyes(on=True)
    assert station.eyes is first
    await station.set_eyes(on=False)
    assert station.eyes is None


async def test_who_does_not_watch_is_a_fault_until_it_does(table: MemoryStation) -> None:
    station = table.station
    await station.set_eyes(on=True)
    await station.home()
    for trouble, titles in (("It has stumbled.", ["The board is not being watched"]), ("", [])):
        table.changes.clear()
        eyes(table).trouble = trouble
        eyes(table).tell(SensorChanged(Sight.CLEAR))
        assert [fault.title for fault in station.faults] == titles
        assert Change.STATION in table.changes


async def test_a_parameter_is_kept_for_the_next_time(table: MemoryStation) -> None:
    station = table.station
    await station.set_eyes(on=True)
    await station.set_eye_parameter("grain", 2.0)
    assert (eyes(table).values, dict(station.config.sensor.parameters)) == ({"grain": 2.0}, {"grain": 2.0})
    await station.set_eye_parameter("grain", None)
    assert (eyes(table).values, dict(station.config.sensor.parameters)) == ({"grain": None}, {})
    with pytest.raises(SensorError):
        await station.set_eye_parameter("taste", 1.0)
    assert dict(station.config.sensor.parameters) == {}


async def test_what_the_camera_sees_is_recorded(table: MemoryStation) -> None:
    station = table.station
    await station.set_eyes(on=True)
    async with CameraProcess(SCRIPTED) as camera:
        await camera.newest(-1, 10.0)
        eyes(table).ring = camera.ring
        name = await station.record(on=True)
        assert (station.recording, await station.record(on=True)) == (name, name)
        folder = station.config.data_dir / "recordings" / name
        async with asyncio.timeout(30):
            while not (folder / "000002.json").exists():  # noqa: ASYNC110 - a recording tells nobody
                await asyncio.sleep(0.005)
        assert await station.record(on=False) == name
    with Recording(folder) as recording:
        assert recording.complete
        assert len(recording) >= 2
    assert (station.recording, Change.EYES in table.changes) == ("", True)


async def test_the_board_is_found_by_camera(table: MemoryStation) -> None:
    station = table.station
    await station.set_eyes(on=True)
    await station.home()
    await station.calibration_begin()
    with pytest.raises(GameError, match="not known where the camera stands"):
        await station.calibration_by_camera()
    pose = CameraPose(CAMERA, "uvc:0", 0.1, date=datetime.now(UTC))
    save_camera_pose(station.config.camera_calibration_path, pose)
    await station.calibration_by_camera()
    assert [name for name, _ in station.calibration.touched] == ["a1", "h1", "h8", "a8"]
    assert station.calibration.problem == ""
    assert station.calibration.square == pytest.approx(50)
    await station.calibration_apply()
    kept = load_calibration(station.config.calibration_path)
    assert kept is not None
    assert np.allclose(kept.robot_from_board.translation, (160, 25, 0), atol=0.01)
    eyes(table).board = Transform.about_z(0.0, (160.0, 25.0, 99.0))
    await station.calibration_begin()
    with pytest.raises(CalibrationError, match="higher or lower"):
        await station.calibration_by_camera()
    assert station.calibration.touched == ()
