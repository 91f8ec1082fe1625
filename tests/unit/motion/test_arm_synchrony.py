"""Joints that move together: in proportion, within every limit, and never by asking somebody else."""

import io
import tokenize
from importlib.resources import files

import numpy as np
import pytest
from tests.unit.motion.arm_cases import ARM, rates

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.motion.arm.synchrony import least_seconds, synchronise

PAIRS = [
    (np.radians([-20, 60, -120, 60, 0]), np.radians([30, 40, -60, 20, 30])),
    (np.radians([0, 90, -90, 0, 0]), np.radians([0, 90, -90, 0, 170])),
    (np.radians([100, 90, -90, 0, 0]), np.radians([-100, 80, -91, 1, 0.01])),
]


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("jerk_limited", [True, False])
def test_all_joints_start_and_arrive_together_on_a_straight_line(
    pair: tuple[Array, Array], jerk_limited: bool
) -> None:
    start, end = pair
    path = synchronise(ARM, start, end, jerk_limited=jerk_limited)
    share = ((path.joints - start) @ (end - start)) / ((end - start) @ (end - start))
    assert path.joints == pytest.approx(start + np.outer(share, end - start), abs=1e-9)
    assert share[0] == 0
    assert share[-1] == pytest.approx(1, abs=1e-12)
    assert (np.diff(share) > 0).all()


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("jerk_limited", [True, False])
def test_every_joint_keeps_its_limits_and_one_is_at_its_own(
    pair: tuple[Array, Array], jerk_limited: bool
) -> None:
    path = synchronise(ARM, *pair, jerk_limited=jerk_limited, tick=0.002)
    speed, rate = rates(path.joints, path.times)
    assert max(speed, rate) <= 1 + 1e-6
    assert max(speed, rate) > 0.97
    if jerk_limited:
        step = path.times[1]
        jerk = np.diff(path.joints, 3, axis=0) / step**3
        assert (np.abs(jerk) / ARM.jerk).max() <= 1 + 1e-3


@pytest.mark.parametrize("pair", PAIRS)
def test_trapezoids_meet_the_bound_and_jerk_costs_time(pair: tuple[Array, Array]) -> None:
    bound = least_seconds(ARM, *pair)
    trapezoid = synchronise(ARM, *pair, jerk_limited=False).seconds
    smooth = synchronise(ARM, *pair).seconds
    assert bound <= trapezoid + 1e-9
    assert trapezoid < smooth < trapezoid + 0.3


def test_standing_still_takes_no_time_worth_the_name() -> None:
    path = synchronise(ARM, ARM.home, ARM.home)
    assert path.seconds < 0.05
    assert (path.joints == ARM.home).all()


def test_a_joint_beyond_its_range_is_named_with_the_amount() -> None:
    beyond = ARM.home + np.radians([0, 0, -60, 0, 0])
    with pytest.raises(
        MotionError, match=r"elbow would have to turn to -150.0°, 3.0° beyond its range of -147"
    ):
        synchronise(ARM, ARM.home, beyond)


def test_our_code_never_gives_ruckig_points_between() -> None:
    """With intermediate positions ruckig asks a service on the internet."""
    told = []
    for file in files("kempelen").joinpath("motion", "arm").iterdir():
        if file.name.endswith(".py"):
            names = tokenize.generate_tokens(io.StringIO(file.read_text(encoding="utf-8")).readline)
            told += [token.string for token in names if token.type in {tokenize.NAME, tokenize.STRING}]
    assert any(name == "ruckig" for name in told)
    assert not [name for name in told if "intermediate_positions" in name]
