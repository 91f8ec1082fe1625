"""Joint angles to whole motor steps: the coupling, its inverse, and the remainders."""

import numpy as np
import pytest

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.motion.arm.steps import Gearing

# Shoulder carries elbow, elbow carries pitch.
COUPLING = np.array(
    [[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 1, 1, 0, 0], [0, 1, 1, 1, 0], [0, 0, 0, 0, 1]], dtype=np.float64
)
PER_RAD = np.array([1125.0, 1125.0, -1125.0, 700.0, 560.0])
GEARING = Gearing(COUPLING, PER_RAD)


def random_path(seed: int, length: int) -> Array:
    return np.random.default_rng(seed).normal(size=(length, 5)).cumsum(axis=0) * 0.003


def test_a_shoulder_move_alone_turns_the_elbow_motor_as_well() -> None:
    motors = GEARING.motors([0, 0.2, 0, 0, 0])
    assert motors == pytest.approx([0, 0.2, 0.2, 0.2, 0])


def test_motors_and_back() -> None:
    path = random_path(1, 40).reshape(4, 10, 5)
    assert GEARING.joints(GEARING.motors(path)) == pytest.approx(path, abs=1e-12)


def test_whole_steps_are_never_further_off_than_half_a_step() -> None:
    path = random_path(2, 300)
    off = np.abs(GEARING.angles(GEARING.steps(path)) - path).max(axis=0)
    assert (off <= GEARING.resolution() + 1e-12).all()
    assert (off > 0.3 * GEARING.resolution()).all()


def test_remainders_are_carried_and_never_add_up() -> None:
    path = random_path(3, 4000)
    increments = GEARING.increments(GEARING.steps(np.zeros(5)), path)
    assert increments.dtype == np.int64
    exact = GEARING.motors(path) * PER_RAD
    assert np.abs(increments.cumsum(axis=0) - exact).max() <= 0.5
    naive = np.rint(np.diff(exact, axis=0)).cumsum(axis=0)  # what rounding each segment alone would do
    assert np.abs(naive - exact[1:]).max() > 5


def test_a_path_that_ends_where_it_began_returns_every_step() -> None:
    path = random_path(4, 50)
    there_and_back = np.concatenate((path, path[::-1]))
    assert not GEARING.increments(GEARING.steps(path[0]), there_and_back).sum(axis=0).any()


@pytest.mark.parametrize(
    ("coupling", "per_rad", "words"),
    [
        (np.ones((5, 5)), PER_RAD, "cannot be inverted"),
        (np.full((5, 5), np.nan), PER_RAD, "cannot be inverted"),
        (np.eye(4), PER_RAD, r"\(4, 4\), for 5 motors"),
        (np.eye(5), PER_RAD * [1, 1, 0, 1, 1], "other than 0"),
    ],
)
def test_a_gearing_that_cannot_be(coupling: Array, per_rad: Array, words: str) -> None:
    with pytest.raises(MotionError, match=words):
        Gearing(coupling, per_rad)
