"""The closed form undoes the forward kinematics, in every branch, one at a time and many at once."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.unit.kinematics.arms_for_tests import FOUR, SCARA, SIX, THREE, TWISTED

from kempelen.core.errors import MotionError, ReachError
from kempelen.core.geometry import Array
from kempelen.kinematics import (
    BRANCHES,
    Arm,
    Search,
    arm_names,
    branches,
    forward,
    inverse,
    inverse_batch,
    inverse_numeric,
    inverse_pose,
    load_arm,
    tilt_of,
)
from kempelen.kinematics.closed import closed

LABVOLT = load_arm("labvolt-5150")
ARMS = [*(load_arm(name) for name in arm_names()), TWISTED, FOUR]


def _joints(arm: Arm, count: int, seed: int = 0) -> Array:
    low, high = arm.ranges.T
    return np.random.default_rng(seed).uniform(low, high, (count, arm.n))


def _off(one: Array, other: Array) -> float:
    return float(np.abs(one - other).max())


def test_forward_is_the_papers() -> None:
    for joints in _joints(LABVOLT, 20):
        t1, t2, t3, t4, _ = joints
        out = 190 * np.cos(t2) + 190 * np.cos(t2 + t3) + 115 * np.sin(t2 + t3 + t4)
        z = 255 + 190 * np.sin(t2) + 190 * np.sin(t2 + t3) - 115 * np.cos(t2 + t3 + t4)
        pose = forward(LABVOLT, joints)
        assert pose[:3, 3] == pytest.approx([np.cos(t1) * out, np.sin(t1) * out, z])
        sine = np.sin(t2 + t3 + t4)
        assert pose[:3, 2] == pytest.approx([np.cos(t1) * sine, np.sin(t1) * sine, -np.cos(t2 + t3 + t4)])


def test_the_papers_rest_point() -> None:
    assert forward(LABVOLT, LABVOLT.home)[:3, 3] == pytest.approx([190, 0, 330])


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
def test_every_pose_is_found_again_as_it_was(arm: Arm) -> None:
    for joints in _joints(arm, 60):
        pose = forward(arm, joints)
        found = inverse_pose(arm, pose, near=joints)
        assert found.joints == pytest.approx(joints, abs=1e-6)
        fast = closed(arm).solve_pose(pose)
        assert fast is not None
        assert arm.within(fast)
        first = 0 if arm.n == 5 else 2  # four joints keep position and approach
        assert _off(forward(arm, fast)[:, first:], pose[:, first:]) < 1e-6


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
@given(seed=st.integers(0, 10_000), pitch=st.floats(2.2, 4.0), roll=st.floats(-2.5, 2.5))
@settings(max_examples=25, deadline=None, derandomize=True)
def test_all_branches_stand_where_they_should(arm: Arm, seed: int, pitch: float, roll: float) -> None:
    point = forward(arm, _joints(arm, 1, seed)[0])[:3, 3]
    for one in branches(arm, point, pitch, roll):
        assert arm.within(one.joints)
        assert forward(arm, one.joints)[:3, 3] == pytest.approx(point, abs=1e-6)
        wanted = pi - pitch if not one.branch.flipped else pitch - pi
        assert float(tilt_of(arm, one.joints)) == pytest.approx(wanted, abs=1e-9)


def test_pitch_and_roll_are_the_papers_euler_angles() -> None:
    joints = inverse(LABVOLT, (210, 80, 150), pitch=2.7, roll=0.4).joints
    azimuth = np.arctan2(80, 210)
    assert forward(LABVOLT, joints)[:3, :3] == pytest.approx(
        _turn(azimuth, 2) @ _turn(2.7, 1) @ _turn(0.4, 2), abs=1e-12
    )


def _turn(angle: float, axis: int) -> Array:
    out = np.eye(3)
    i, j = [k for k in range(3) if k != axis]
    sign = -1 if axis == 1 else 1
    out[i, i] = out[j, j] = np.cos(angle)
    out[i, j], out[j, i] = -sign * np.sin(angle), sign * np.sin(angle)
    return out


def test_both_elbows_and_both_ways_of_the_base() -> None:
    wide = LABVOLT.__class__(
        **{name: getattr(LABVOLT, name) for name in LABVOLT.__dataclass_fields__ if name != "ranges"},
        ranges=np.radians([[-180, 180]] * 5),
    )
    found = branches(wide, (120, 60, 300))
    assert {one.branch for one in found} == set(BRANCHES)
    assert str(found[0].branch) == "base ahead, elbow up"


def test_whole_turns_count_where_the_range_allows_them() -> None:
    scorbot = load_arm("scorbot-er-v-plus")
    rolls = sorted(np.degrees(one.joints[4]) for one in branches(scorbot, (300, 0, 200), roll=0.5))
    assert len(rolls) == 3
    assert np.diff(rolls) == pytest.approx(360)


def test_nearest_to_where_it_stands() -> None:
    scorbot = load_arm("scorbot-er-v-plus")
    here = inverse(scorbot, (300, 0, 200), roll=0.5).joints
    for turn in (-2 * pi, 0, 2 * pi):
        near = here + np.array([0, 0, 0, 0, turn])
        if scorbot.within(near):
            assert inverse(scorbot, (300, 1, 200), roll=0.5, near=near).joints == pytest.approx(
                near, abs=0.02
            )


@pytest.mark.parametrize("arm", [*ARMS, THREE], ids=lambda arm: arm.name)
def test_many_at_once_are_the_same_as_one_by_one(arm: Arm) -> None:
    rng = np.random.default_rng(5)
    points = forward(arm, _joints(arm, 80, 3))[:, :3, 3]
    points[:5] += [900, 0, 0]
    pitches, rolls = pi + rng.uniform(-1, 1, 80), rng.uniform(-3, 3, 80)
    many = inverse_batch(arm, points, pitches, rolls)
    for point, pitch, roll, joints, within in zip(points, pitches, rolls, *many, strict=True):
        one = branches(arm, point, pitch, roll)
        assert {BRANCHES[k] for k in np.flatnonzero(within)} == {solution.branch for solution in one}
        for solution in one:
            off = joints[BRANCHES.index(solution.branch)] - solution.joints
            assert np.abs(np.remainder(off + pi, 2 * pi) - pi).max() < 1e-9


def test_a_batch_longer_than_its_blocks() -> None:
    points = np.tile([200.0, 50, 100], (20_000, 1))
    found = inverse_batch(LABVOLT, points, flipped=False)
    assert found.joints.shape == (20_000, 2, 5)
    assert np.ptp(found.joints, axis=0).max() == 0
    assert inverse_batch(LABVOLT, np.zeros((0, 3))).within.shape == (0, 4)


@pytest.mark.parametrize("joints", _joints(THREE, 20).tolist())
def test_three_joints_reach_points(joints: list[float]) -> None:
    point = forward(THREE, joints)[:3, 3]
    assert inverse(THREE, point, near=joints).joints == pytest.approx(joints, abs=1e-6)


@pytest.mark.parametrize(
    ("point", "pitch", "told"),
    [
        ((600, 0, 140), pi, r"the wrist would be 220\.0 mm beyond the 380 mm that the links reach"),
        ((20, 0, 66), pi, r"its elbow would have to stand at -156\.7°, 9\.7° outside its range -147° to 51°"),
        ((-200, 60, 66), pi, r"its base would have to stand at 163\.3°, 10\.3° outside its range"),
    ],
)
def test_out_of_reach_tells_by_how_much(point: tuple[float, ...], pitch: float, told: str) -> None:
    with pytest.raises(ReachError, match=told):
        inverse(LABVOLT, point, pitch)


def test_a_lateral_shift_keeps_the_axis_out_of_reach() -> None:
    with pytest.raises(ReachError, match="too near to the base's axis|mm nearer|outside its range"):
        inverse(TWISTED, (0, 0, 200))


def test_a_gripper_leaning_sideways_is_refused() -> None:
    pose = forward(LABVOLT, LABVOLT.home)
    pose[:3, :3] = pose[:3, :3] @ _turn(0.1, 0)
    with pytest.raises(ReachError, match=r"cannot lean the gripper 5\.7.*° sideways"):
        inverse_pose(LABVOLT, pose)


def test_numbers_that_are_none() -> None:
    with pytest.raises(MotionError, match="not finite"):
        inverse(LABVOLT, (np.nan, 0, 0))
    with pytest.raises(MotionError, match=r"has 5 joints; angles of shape \(4,\)"):
        forward(LABVOLT, np.zeros(4))


@pytest.mark.parametrize("arm", [SIX, SCARA], ids=lambda arm: arm.name)
def test_other_families_say_so(arm: Arm) -> None:
    with pytest.raises(MotionError, match="has no closed form"):
        inverse(arm, (100, 0, 0))


def test_on_the_bases_axis() -> None:
    found = inverse(LABVOLT, (0, 0, 600), pitch=1.0)
    assert forward(LABVOLT, found.joints)[:3, 3] == pytest.approx([0, 0, 600], abs=1e-6)


@pytest.mark.parametrize("arm", [SIX, LABVOLT], ids=lambda arm: arm.name)
def test_damped_least_squares_meet_the_pose(arm: Arm) -> None:
    for joints in _joints(arm, 6, 2):
        pose = forward(arm, joints)
        found = inverse_numeric(arm, pose)
        assert arm.within(found)
        assert _off(forward(arm, found), pose) < 1e-5


def test_damped_least_squares_agree_with_the_closed_form() -> None:
    for joints in _joints(LABVOLT, 10, 4):
        pose = forward(LABVOLT, joints)
        assert inverse_numeric(LABVOLT, pose, near=joints + 0.01) == pytest.approx(
            inverse_pose(LABVOLT, pose, near=joints).joints, abs=1e-6
        )


def test_damped_least_squares_say_how_near_they_came() -> None:
    pose = forward(SIX, SIX.home)
    pose[0, 3] += 2000
    with pytest.raises(ReachError, match=r"the nearest of 3 tries misses it by .* mm"):
        inverse_numeric(SIX, pose, search=Search(starts=3))
