"""Jacobians against finite differences, singular postures by name, damped speeds, Euler angles, torques."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from tests.unit.kinematics.arms_for_tests import FOUR, SCARA, SIX, THREE, TWISTED

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.kinematics import (
    Arm,
    Mass,
    forward,
    frames,
    jacobian,
    joint_speeds,
    load_arm,
    manipulability,
    matrix_from_zyz,
    singularities,
    torques,
    zyz_from_matrix,
)
from kempelen.kinematics.differential import pose_error
from kempelen.kinematics.dynamics import accelerations_of, mass_matrix

LABVOLT = load_arm("labvolt-5150")


def _joints(arm: Arm, count: int, seed: int = 0) -> Array:
    low, high = arm.ranges.T
    return np.random.default_rng(seed).uniform(low, high, (count, arm.n))


@pytest.mark.parametrize("arm", [LABVOLT, TWISTED, FOUR, THREE, SIX, SCARA], ids=lambda arm: arm.name)
def test_the_jacobian_is_the_slope_of_the_pose(arm: Arm) -> None:
    step = 1e-6
    for joints in _joints(arm, 10):
        found = jacobian(arm, joints)
        for k, unit in enumerate(np.eye(arm.n)):
            ahead, behind = forward(arm, joints + step * unit), forward(arm, joints - step * unit)
            assert pose_error(ahead, behind) / (2 * step) == pytest.approx(found[:, k], abs=1e-4)


def test_many_at_once() -> None:
    joints = _joints(LABVOLT, 12).reshape(3, 4, 5)
    assert frames(LABVOLT, joints).shape == (3, 4, 6, 4, 4)
    assert jacobian(LABVOLT, joints)[1, 2] == pytest.approx(jacobian(LABVOLT, joints[1, 2]))
    assert manipulability(LABVOLT, joints).shape == (3, 4)


def test_frames_are_rigid() -> None:
    turns = frames(LABVOLT, _joints(LABVOLT, 20))[..., :3, :3]
    assert turns @ turns.swapaxes(-1, -2) == pytest.approx(np.broadcast_to(np.eye(3), turns.shape))
    assert np.linalg.det(turns) == pytest.approx(np.ones(turns.shape[:2]))


@pytest.mark.parametrize(
    ("joints", "name", "blocks"),
    [
        ((0.3, 0.4, 0, 1.0, 0), "elbow", True),
        ((0, np.pi / 2, 0, np.pi / 2, 0), "shoulder", True),
        ((0.2, np.pi / 2, -np.pi / 2, 0, 0), "wrist", False),
    ],
)
def test_singular_postures_have_names(joints: tuple[float, ...], name: str, blocks: bool) -> None:
    found = {one.name: one for one in singularities(LABVOLT, joints)}
    assert name in found
    assert found[name].blocks is blocks


def test_the_shoulder_singularity_loses_a_direction() -> None:
    assert float(manipulability(LABVOLT, (0, np.pi / 2, 0, np.pi / 2, 0))) == pytest.approx(0, abs=1)
    assert float(manipulability(LABVOLT, LABVOLT.home)) > 1e6


def test_an_ordinary_posture_is_none_of_them() -> None:
    assert singularities(LABVOLT, (0.3, 0.8, -1.2, 0.8, 0.1)) == []
    assert singularities(SIX, (0.1, 0.2, -0.3, 0.4, 0.5, 0.6)) == []
    assert [one.name for one in singularities(SIX, (0.1, 0.2, -0.3, 0.4, 0.0, 0.6))] == ["chain"]


@given(seed=st.integers(0, 500))
@settings(max_examples=30, deadline=None, derandomize=True)
def test_joint_speeds_do_what_is_wanted_where_it_can_be(seed: int) -> None:
    joints = _joints(LABVOLT, 1, seed)[0]
    if singularities(LABVOLT, joints) or float(manipulability(LABVOLT, joints)) < 2e6:
        return
    wanted = np.random.default_rng(seed).normal(0, 50, 3)
    assert jacobian(LABVOLT, joints)[:3] @ joint_speeds(
        LABVOLT, joints, wanted, damping=0.0
    ) == pytest.approx(wanted)


def test_joint_speeds_stay_bounded_at_a_singularity() -> None:
    straight = np.array([0.0, 0.3, 0.0, np.pi / 2 - 0.3 + 1e-9, 0.0])
    outwards = np.array([100 * np.cos(0.0), 0, 0, 0, 0, 0])
    assert np.abs(joint_speeds(LABVOLT, straight, outwards)).max() < 30
    costly = joint_speeds(LABVOLT, LABVOLT.home, (0, 50, 0), weights=[10, 1, 1, 1, 1])
    assert np.isfinite(costly).all()


@given(angles=st.tuples(st.floats(-3.1, 3.1), st.floats(0.01, 3.13), st.floats(-3.1, 3.1)))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_euler_angles_go_there_and_back(angles: tuple[float, float, float]) -> None:
    assert zyz_from_matrix(matrix_from_zyz(angles)) == pytest.approx(angles, abs=1e-9)


@pytest.mark.parametrize("pitch", [0.0, np.pi])
def test_upright_euler_angles_keep_the_turn(pitch: float) -> None:
    turn = matrix_from_zyz([0.4, pitch, 0.9])
    azimuth, _, _ = zyz_from_matrix(turn)
    assert azimuth == 0
    assert matrix_from_zyz(zyz_from_matrix(turn)) == pytest.approx(turn)


def _chain_in_mujoco(arm: Arm) -> mujoco.MjModel:
    """Bodies in the chain's own frames at zero; lengths in metres."""
    at = frames(arm, np.zeros(arm.n))
    opened = ""
    for k, mass in enumerate(arm.masses):
        rel = np.linalg.inv(at[k]) @ at[k + 1]
        back = np.linalg.inv(rel)
        w = np.roll(Rotation.from_matrix(rel[:3, :3]).as_quat(), 1)
        i = mass.inertia * 1e-6
        opened += (
            f'<body pos="{_words(rel[:3, 3] / 1e3)}" quat="{_words(w)}"><joint type="hinge" '
            f'axis="{_words(back[:3, 2])}" pos="{_words(back[:3, 3] / 1e3)}"/><inertial mass="{mass.kg}" '
            f'pos="{_words(np.asarray(mass.centre) / 1e3)}" '
            f'fullinertia="{_words((i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]))}"/>'
        )
    bodies = opened + "</body>" * arm.n
    text = f'<mujoco><option gravity="0 0 -9.81"/><worldbody>{bodies}</worldbody></mujoco>'
    return mujoco.MjModel.from_xml_string(text)


def _words(numbers: Array | tuple[float, ...]) -> str:
    return " ".join(f"{number:.17g}" for number in numbers)


def test_torques_are_mujocos() -> None:
    model = _chain_in_mujoco(LABVOLT)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(3)
    joints, speeds, pushes = _joints(LABVOLT, 20), rng.normal(0, 1, (20, 5)), rng.normal(0, 4, (20, 5))
    ours = torques(LABVOLT, joints, speeds, pushes)
    for row in range(20):
        data.qpos[:], data.qvel[:], data.qacc[:] = joints[row], speeds[row], pushes[row]
        mujoco.mj_inverse(model, data)
        assert ours[row] == pytest.approx(data.qfrc_inverse, abs=1e-9)


def test_forward_dynamics_undo_the_inverse() -> None:
    joints, speeds, pushes = _joints(LABVOLT, 3, 9)
    torque = torques(LABVOLT, joints, speeds, pushes)
    assert accelerations_of(LABVOLT, joints, speeds, torque) == pytest.approx(pushes)
    inertia = mass_matrix(LABVOLT, joints)
    assert inertia == pytest.approx(inertia.T)
    assert np.linalg.eigvalsh(inertia).min() > 0


def test_a_load_weighs_at_the_tool_point() -> None:
    held = Mass(0.05, np.zeros(3), np.zeros((3, 3)))
    more = torques(LABVOLT, LABVOLT.home, load=held) - torques(LABVOLT, LABVOLT.home)
    assert more[1] == pytest.approx(0.05 * 9.81 * 0.19)
    assert more[0] == pytest.approx(0, abs=1e-12)


def test_without_masses_there_are_no_torques() -> None:
    with pytest.raises(MotionError, match="so-101 has no masses"):
        torques(load_arm("so-101"), np.zeros(5))
