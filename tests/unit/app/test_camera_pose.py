"""Where the camera stands, on disk; and a board that slid, without a camera."""

import math
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from kempelen.app.camera_pose import (
    CameraPose,
    as_calibration,
    bumped,
    load_camera_pose,
    save_camera_pose,
    shift_of,
)
from kempelen.core.errors import CalibrationError
from kempelen.core.geometry import Transform

BOARD = Transform.about_z(0.02, (150.0, 25.0, 1.5))
POSE = CameraPose(
    Transform.about_z(1.0, (350.0, -15.0, 1020.0)), "uvc:0", 0.3, datetime(2026, 5, 1, tzinfo=UTC)
)


def test_a_pose_is_read_as_it_was_written(tmp_path: Path) -> None:
    file = tmp_path / "camera.json"
    assert load_camera_pose(file) is None
    save_camera_pose(file, POSE)
    read = load_camera_pose(file)
    assert read is not None
    assert (read.camera, read.spread, read.date) == ("uvc:0", 0.3, POSE.date)
    np.testing.assert_array_equal(read.robot_from_camera.matrix, POSE.robot_from_camera.matrix)


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"version": 99}', "\x00"])
def test_a_damaged_file_is_refused_with_the_next_step(tmp_path: Path, text: str) -> None:
    file = tmp_path / "camera.json"
    file.write_text(text)
    with pytest.raises(CalibrationError, match="kempelen calibrate --camera"):
        load_camera_pose(file)


def test_a_pose_that_is_no_rotation_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "camera.json"
    save_camera_pose(file, POSE)
    file.write_text(file.read_text().replace(str(math.cos(1.0))[:8], "0.999999", 1))
    with pytest.raises(CalibrationError, match="rotation"):
        load_camera_pose(file)


def test_what_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "no").write_text("a file")
    with pytest.raises(CalibrationError, match="cannot be written"):
        save_camera_pose(tmp_path / "no" / "camera.json", POSE)


def test_a_bump_is_taken_in_the_plane_alone() -> None:
    """Place and turn from the camera; height and tilt, which it sees badly, from the touched corners."""
    slid = Transform.about_z(0.05, (12.0, -7.0, 0.0))
    lifted = Transform(np.eye(3), np.array([0.0, 0.0, 8.0]))
    after = bumped(BOARD, BOARD @ slid @ lifted)
    np.testing.assert_allclose(after.matrix, (BOARD @ slid).matrix, atol=1e-9)
    assert shift_of(BOARD, after, 50.0) == pytest.approx(
        max(
            float(np.linalg.norm(BOARD @ (slid @ p) - BOARD @ p))
            for p in np.array([[0, 0, 0], [400, 0, 0], [400, 400, 0], [0, 400, 0.0]])
        )
    )


@pytest.mark.parametrize("how", [Transform(np.eye(3), np.array([0.0, 0.0, 40.0])), "tilted"])
def test_a_board_in_the_air_was_not_bumped(how: "Transform | str") -> None:
    if isinstance(how, str):
        c, s = math.cos(0.1), math.sin(0.1)
        how = Transform(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.zeros(3))
    with pytest.raises(CalibrationError, match="If the camera was moved"):
        bumped(BOARD, BOARD @ how)


def test_a_measured_pose_is_kept_as_corners() -> None:
    found = as_calibration(BOARD, 50.0)
    np.testing.assert_allclose(found.robot_from_board.matrix, BOARD.matrix, atol=1e-9)
    assert (found.square, found.checked) == (50.0, True)
