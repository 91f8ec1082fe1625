import json
import os
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kempelen.app.calibration_file import load_calibration, save_calibration
from kempelen.core.calibration import Calibration, calibrate
from kempelen.core.errors import CalibrationError

WHEN = datetime(2026, 5, 1, 12, 30, tzinfo=UTC)
CORNERS = {
    "a1": (100.0, 50.0, 1.0),
    "h1": (499.8, 53.1, 1.5),
    "h8": (497.0, 453.2, 1.0),
    "a8": (97.1, 450.0, 1.2),
}


def measured() -> Calibration:
    return calibrate(CORNERS, date=WHEN, square=50.0, weights={"h8": 2.0})


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "deep" / "calibration.json"


def test_what_is_saved_is_loaded(path: Path) -> None:
    save_calibration(path, measured())
    found = load_calibration(path)
    assert found is not None
    np.testing.assert_array_equal(found.robot_from_board.matrix, measured().robot_from_board.matrix)
    assert found.square == 50.0
    assert found.date == WHEN
    assert found.corners == CORNERS
    assert found.residuals == measured().residuals
    assert found.rms == measured().rms > 0
    assert found.weights["h8"] == 2.0


def test_the_file_says_its_date_and_residual_to_people(path: Path) -> None:
    save_calibration(path, measured())
    content = json.loads(path.read_text())
    assert content["version"] == 1
    assert content["date"] == "2026-05-01T12:30:00Z"
    assert content["rms"] == pytest.approx(measured().rms)


def test_no_file_is_no_calibration(path: Path) -> None:
    assert load_calibration(path) is None


def test_a_failed_write_leaves_the_old_file_whole(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_calibration(path, measured())
    before = path.read_bytes()

    def full(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(CalibrationError, match=r"cannot be written to .*calibration.json: No space left"):
        save_calibration(path, calibrate(CORNERS, date=WHEN))
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def _drop_corner(content: dict[str, Any]) -> None:
    content["corners"] = {"a1": content["corners"]["a1"]}


def _swap(content: dict[str, Any]) -> None:
    corners = content["corners"]
    corners["a1"], corners["h1"] = corners["h1"], corners["a1"]


def _move_pose(content: dict[str, Any]) -> None:
    content["robot_from_board"][0][3] += 3.0


def _set(key: str, value: object) -> Callable[[dict[str, Any]], None]:
    return lambda content: content.__setitem__(key, value)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (_drop_corner, "1 corner.*two to four"),
        (_swap, "a1 and h1.*look swapped"),
        (_move_pose, "its pose is 3 mm off"),
        (_set("square", 51.0), "its pose is 1 mm off"),
        (_set("version", 2), "of version 2, this program reads up to 1"),
        (_set("version", 0), "damaged at 'version'"),
        (_set("rms", "small"), "damaged at 'rms'"),
        (_set("date", "2026-05-01T12:30:00"), "damaged at 'date'.*timezone"),
        (_set("colour", "red"), "damaged at 'colour'"),
        (lambda content: content.pop("corners"), "damaged at 'corners'"),
    ],
)
def test_a_damaged_file_is_told(path: Path, damage: Callable[[dict[str, Any]], None], said: str) -> None:
    save_calibration(path, measured())
    content = json.loads(path.read_text())
    damage(content)
    path.write_text(json.dumps(content))
    with pytest.raises(CalibrationError, match=said) as caught:
        load_calibration(path)
    assert str(path) in caught.value.message
    assert caught.value.hint


@pytest.mark.parametrize("content", [b"", b"[1, 2]", b"null", b"{", b"\xff\xfe\x00", b"[" * 100_000])
def test_rubbish_is_told(path: Path, content: bytes) -> None:
    path.parent.mkdir()
    path.write_bytes(content)
    with pytest.raises(CalibrationError, match="is damaged"):
        load_calibration(path)


def test_a_directory_in_its_place_is_told(path: Path) -> None:
    path.mkdir(parents=True)
    with pytest.raises(CalibrationError, match="cannot be read: Is a directory"):
        load_calibration(path)
    with pytest.raises(CalibrationError, match="cannot be written"):
        save_calibration(path, measured())


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0, 900), junk=st.binary(min_size=1, max_size=4))
def test_no_damage_gives_another_pose(tmp_path: Path, at: int, junk: bytes) -> None:
    path = tmp_path / "calibration.json"
    save_calibration(path, measured())
    whole = path.read_bytes()
    path.write_bytes(whole[:at] + junk + whole[at + len(junk) :])
    try:
        found = load_calibration(path)
    except CalibrationError:
        return
    assert found is not None
    np.testing.assert_allclose(found.robot_from_board.matrix, measured().robot_from_board.matrix, atol=1e-5)
