"""An arm measured by touching the board: `kempelen calibrate --arm`."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from kempelen.app.arm_calibration import (
    TOUCHED,
    TouchedPoint,
    board_from,
    calibrated_arm,
    fit_touched,
    read_points,
    save_arm,
)
from kempelen.core.arm_table import arm_table
from kempelen.core.errors import CalibrationError
from kempelen.core.geometry import Transform
from kempelen.kinematics import Arm, Link, forward, least_tilt, load_arm

ARM = load_arm("labvolt-5150")
TABLE = arm_table()
NOW = datetime(2026, 5, 1, 12, 0, tzinfo=UTC)
BOARD = Transform.about_z(np.radians(91.0), (388.0, -143.0, 67.0))
"""Where the board truly is."""


def longer(arm: Arm, by: float) -> Arm:
    *others, last = arm.links
    return arm.with_links((*others, last._replace(d=last.d + by)))


def true_arm() -> Arm:
    offsets = np.radians([0.0, 0.6, -0.8, 0.5, 0.0])
    rows = zip(ARM.links, offsets.tolist(), strict=True)
    return ARM.with_links(tuple(Link(k.a, k.alpha, k.d, k.offset + off) for k, off in rows))


def touched(noise: float = 0.0) -> list[TouchedPoint]:
    fingertips = longer(true_arm(), TABLE.gripper.below_tool)
    rng = np.random.default_rng(1)
    out = []
    for file, rank in TOUCHED.values():
        point = np.array([file * 35.0, rank * 35.0, 0.0])
        joints = least_tilt(fingertips, BOARD @ point + rng.normal(0, noise, 3), most=1.0).joints
        out.append(TouchedPoint(tuple(point.tolist()), tuple(joints.tolist())))
    return out


def worst_miss(arm: Arm, board: Transform) -> float:
    """Of grips all over the board, planned with what was measured, mm: where the arm truly is."""
    wanted = [np.array([x, y, 20.0]) for x in (20.0, 140.0, 260.0) for y in (20.0, 140.0, 260.0)]
    joints = np.array([least_tilt(arm, board @ point).joints for point in wanted])
    there = forward(true_arm(), joints)[:, :3, 3]
    return float(np.linalg.norm(there - np.array([BOARD @ point for point in wanted]), axis=1).max())


def test_touched_points_tell_arm_and_board() -> None:
    fit = fit_touched(ARM, TABLE, touched())
    board = board_from(fit, 35.0, NOW).robot_from_board
    assert fit.rms < 0.1
    assert worst_miss(ARM, TABLE.robot_from_board) > 3.0
    assert worst_miss(fit.arm, board) < 0.6


def test_a_trembling_hand_is_evened_out() -> None:
    fit = fit_touched(ARM, TABLE, touched(noise=0.3))
    assert 0.05 < fit.rms < 0.8
    assert worst_miss(fit.arm, board_from(fit, 35.0, NOW).robot_from_board) < 1.2


def test_what_was_found_is_kept(tmp_path: Path) -> None:
    file = tmp_path / "joints.json"
    assert calibrated_arm(file, ARM) is ARM
    fit = fit_touched(ARM, TABLE, touched())
    save_arm(file, ARM, fit, NOW)
    assert calibrated_arm(file, ARM).links == fit.arm.links


def test_a_damaged_file_and_another_arms_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "joints.json"
    file.write_text("{")
    with pytest.raises(CalibrationError, match="is damaged"):
        calibrated_arm(file, ARM)
    save_arm(file, ARM, fit_touched(ARM, TABLE, touched()), NOW)
    with pytest.raises(CalibrationError, match=r"is that of the arm labvolt-5150, configured is other"):
        calibrated_arm(file, replace(ARM, name="other"))


def test_points_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "points.csv"
    points = touched()
    rows = [(*one.point[:2], float("nan"), *np.degrees(one.joints)) for one in points]
    file.write_text("# x, y, z, joints\n" + "\n".join(", ".join(map(str, row)) for row in rows) + "\n")
    read = read_points(file, ARM)
    np.testing.assert_allclose([one.joints for one in read], [one.joints for one in points])
    assert all(np.isnan(one.point[2]) for one in read)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("1,2,3", "points.csv:1: '1,2,3' is no point"),
        ("1,2,3,a,b,c,d,e", "is no point"),
        ("0,0,0,0,200,-90,0,0", r"the shoulder at 200° is 51.0° outside of its range, -32° to 149°"),
    ],
)
def test_a_line_that_is_no_point_is_named(tmp_path: Path, line: str, said: str) -> None:
    file = tmp_path / "points.csv"
    file.write_text(line + "\n")
    with pytest.raises(CalibrationError, match=said):
        read_points(file, ARM)


def test_too_few_points_are_refused() -> None:
    with pytest.raises(CalibrationError, match="at least 10 are needed"):
        fit_touched(ARM, TABLE, touched()[:9])
