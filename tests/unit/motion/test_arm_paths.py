"""Guided lines cut into few pieces, corners rounded, and the pace along them."""

import numpy as np
import pytest
from tests.unit.motion.arm_cases import ARM, rates

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.kinematics import forward
from kempelen.motion.arm.guidance import Pose, arc, bow_of, pose_of, posture, straight
from kempelen.motion.arm.pacing import paced, rounded
from kempelen.motion.arm.synchrony import least_seconds

LINES = [
    (Pose(0.3, 200, 90), Pose(0.3, 200, 170)),
    (Pose(-0.4, 200, 170), Pose(0.4, 350, 170)),
    (Pose(0.3, 350, 90, 0.1), Pose(0.32, 340, 170, 0.1)),
    (Pose(0.0, 122, 90), Pose(0.0, 130, 190)),
]


@pytest.mark.parametrize("ends", LINES)
@pytest.mark.parametrize("bow", [0.2, 2.0])
def test_a_guided_line_bows_no_more_than_allowed(ends: tuple[Pose, Pose], bow: float) -> None:
    start, end = ends
    knots = straight(ARM, start, end, "Lifting", bow)
    assert bow_of(ARM, knots, start.point, end.point, looks=500) <= bow
    for joints, pose in ((knots[0], start), (knots[-1], end)):
        assert pose_of(ARM, joints).row == pytest.approx(pose.row, abs=1e-9)


@pytest.mark.parametrize("ends", LINES)
def test_no_cut_into_fewer_pieces_would_do(ends: tuple[Pose, Pose]) -> None:
    knots = straight(ARM, *ends, "Lifting", 2.0)
    assert len(knots) == 1 + fewest(*ends, 2.0)


def fewest(start: Pose, end: Pose, bow: float) -> int:
    """By trying all ways between 33 stations."""
    rows = start.row + np.linspace(0, 1, 33)[:, None] * (end.row - start.row)
    points = start.point + np.linspace(0, 1, 33)[:, None] * (end.point - start.point)
    rows[:, 0], rows[:, 1] = np.arctan2(points[:, 1], points[:, 0]), np.hypot(points[:, 0], points[:, 1])
    stations = [posture(ARM, Pose(*row.tolist()), "x") for row in rows]
    best = [0] + [99] * 32
    for j in range(1, 33):
        for i in range(j):
            if best[i] + 1 < best[j]:
                off = bow_of(ARM, np.stack((stations[i], stations[j])), start.point, end.point, looks=9)
                if off <= bow:
                    best[j] = best[i] + 1
    return best[-1]


def test_a_pose_and_back() -> None:
    pose = Pose(-0.7, 250, 120, 0.2, -1.1)
    assert pose_of(ARM, posture(ARM, pose, "x")).row == pytest.approx(pose.row, abs=1e-9)


def test_one_joint_move_would_bow_much_more() -> None:
    start, end = LINES[1]
    one = np.stack([posture(ARM, pose, "x") for pose in (start, end)])
    assert bow_of(ARM, one, start.point, end.point) > 10


def test_an_arc_keeps_radius_and_height_while_the_base_turns() -> None:
    knots = arc(ARM, Pose(-0.5, 250, 170), Pose(0.5, 250, 170), "Across", 3.0)
    assert len(knots) == 2
    tool = forward(ARM, np.linspace(knots[0], knots[1], 20))[:, :3, 3]
    assert np.hypot(tool[:, 0], tool[:, 1]) == pytest.approx(np.full(20, 250), abs=1e-6)


def test_a_line_through_a_joints_limit_tells_where_and_which() -> None:
    with pytest.raises(
        MotionError, match=r"Lowering, \d+ % of the way.* elbow .*outside its range.*Nothing was sent"
    ):
        straight(ARM, Pose(0, 160, 140), Pose(0, 100, 140), "Lowering")


def test_a_line_beyond_reach_tells_by_how_much() -> None:
    with pytest.raises(MotionError, match=r"Lifting, 0 % of the way.*3\.3 mm beyond the 380 mm"):
        straight(ARM, Pose(0.3, 380, 90), Pose(0.3, 390, 160), "Lifting")


def test_a_singular_pose_on_the_way_is_told() -> None:
    """Straight through the base's axis, all azimuths are one."""
    start, end = Pose(0, 1.0, 330), Pose(3.0, 1.0, 330)
    with pytest.raises(MotionError, match="Sliding"):
        straight(ARM, start, end, "Sliding", 0.01)


# --- pace -------------------------------------------------------------------------------------------------


def knots() -> Array:
    start, end = np.radians([-20, 60, -120, 60, 0]), np.radians([30, 40, -60, 20, 30])
    up = np.radians([5, 20, 10, -30, 0])
    return np.stack([start, start + up, end + np.radians([-5, 20, 10, -30, 0]), end])


@pytest.mark.parametrize("share", [0.2, 0.6, 1.0])
def test_a_path_is_driven_in_one_go_within_all_limits(share: float) -> None:
    path = rounded(ARM, knots(), share)
    timed = paced(ARM, path)
    speed, rate = rates(timed.joints, timed.times)
    assert speed <= 1 + 1e-9
    assert rate <= 1 + 1e-9
    assert timed.seconds >= least_seconds(ARM, path[0], path[-1])
    moving = np.abs(np.diff(timed.joints[5:-5], axis=0)).max(axis=1)
    assert (moving > 1e-4).all()  # no stop between
    assert (timed.joints[[0, -1]] == path[[0, -1]]).all()


def test_rounder_corners_are_faster() -> None:
    times = [paced(ARM, rounded(ARM, knots(), share)).seconds for share in (0.05, 0.2, 0.8)]
    assert times == sorted(times, reverse=True)


def test_corners_are_cut_where_asked_and_the_rest_is_kept() -> None:
    path = rounded(ARM, knots(), [0.1, 1.0])
    first = knots()[1]
    assert np.abs(path - first).max(axis=1).min() < np.radians(2)
    assert np.abs(path - knots()[2]).max(axis=1).min() > np.radians(2)


def test_a_path_of_one_piece_nearly_meets_the_bound() -> None:
    ends = knots()[[0, 3]]
    assert paced(ARM, ends).seconds == pytest.approx(least_seconds(ARM, *ends), abs=0.15)
