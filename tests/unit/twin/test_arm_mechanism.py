"""Between motors and joints: what is lost at stops, play, warmth, homing, and the paper's queen."""

import chess
import numpy as np
import pytest

from kempelen.core.geometry import Array
from kempelen.core.places import Place
from kempelen.kinematics import forward, least_tilt
from kempelen.testing.arm_driver import ARM, TABLE
from kempelen.twin.flaws import FLAWLESS, ArmFlaws
from kempelen.twin.physics.mechanism import WARM, Mechanism

TICK = 0.008
_GRASP = 6.0
"""Farther off a queen, the fingers stall on its head or hold nothing, mm."""
REST = 5


def go(mechanism: Mechanism, start: Array, goal: Array, *, homings: int = 1, seconds: float = 0.4) -> Array:
    """From rest to rest, (n,) joint angles; where the joints truly are then."""
    count = max(1, int(seconds / TICK))
    for k in range(1, count + 1):
        mechanism.follow(TICK, ARM.coupling @ (start + (goal - start) * k / count), homings)
    for _ in range(REST):
        true = mechanism.follow(TICK, ARM.coupling @ goal, homings)
    return true


def homed(flaws: ArmFlaws) -> Mechanism:
    mechanism = Mechanism(ARM, flaws)
    mechanism.follow(TICK, ARM.coupling @ ARM.home, 0)
    mechanism.follow(TICK, ARM.coupling @ ARM.home, 1)
    return mechanism


def there_and_back(mechanism: Mechanism, times: int) -> None:
    away = ARM.home + np.array([0.3, -0.2, 0.1, 0.0, 0.0])
    for _ in range(times):
        go(mechanism, ARM.home, away)
        go(mechanism, away, ARM.home)


def test_a_flawless_arm_is_where_its_motors_say() -> None:
    mechanism = homed(FLAWLESS)
    goal = ARM.home + 0.2
    assert np.abs(go(mechanism, ARM.home, goal) - goal).max() < 1e-12


def test_each_stop_costs_those_joints_that_moved() -> None:
    mechanism = homed(ArmFlaws(play=0.0, temperature=0.0, homing=0.0))
    there_and_back(mechanism, 50)
    assert mechanism.stops.tolist() == [100, 100, 100, 0, 0]
    errors = mechanism.errors
    assert not errors[3:].any()
    spread = 4 * ARM.drift.stop_spread[:3] * np.sqrt(100)
    assert (np.abs(errors[:3] - 100 * ARM.drift.stop_bias[:3]) < spread).all()
    assert abs(errors[0]) > abs(errors[1]) > abs(errors[2])


def test_passing_a_place_without_a_stop_costs_nothing() -> None:
    mechanism = homed(ArmFlaws(play=0.0, temperature=0.0, homing=0.0))
    goal = ARM.home + 0.3
    for k in range(1, 101):
        mechanism.follow(TICK, ARM.coupling @ (ARM.home + 0.3 * k / 100), 1)
    assert not mechanism.errors.any()
    mechanism.follow(TICK, ARM.coupling @ goal, 1)
    assert mechanism.errors.any()


def test_single_steps_of_a_slow_motion_are_no_stops_a_hold_is_one() -> None:
    mechanism = homed(ArmFlaws(play=0.0, temperature=0.0, homing=0.0))
    step = np.eye(ARM.n)[0] / ARM.steps_per_rad[0]
    for k in range(1, 21):  # 40 ms between the steps
        for _ in range(5):
            mechanism.follow(TICK, ARM.coupling @ (ARM.home + k * step), 1, idle=False)
    assert not mechanism.stops.any()
    end = ARM.coupling @ (ARM.home + 20 * step)
    for _ in range(20):
        mechanism.follow(TICK, end, 1, idle=False)
    assert mechanism.stops.tolist() == [1, 0, 0, 0, 0]
    mechanism.follow(TICK, end, 1)
    assert mechanism.stops.tolist() == [1, 0, 0, 0, 0]


def test_homing_finds_all_again_to_a_step() -> None:
    mechanism = homed(ArmFlaws(play=0.0, temperature=0.0))
    there_and_back(mechanism, 30)
    assert np.degrees(np.abs(mechanism.errors).max()) > 0.5
    mechanism.follow(TICK, ARM.coupling @ ARM.home, 2)
    step = np.abs(ARM.joint_from_motor / ARM.steps_per_rad)
    assert (np.abs(mechanism.errors) <= step.sum(axis=1) / 2).all()
    assert not mechanism.stops.any()


def moves_until_missed(seed: int) -> int:
    """Moves of two transfers, with two stops each, until the pads come down on the queen's head."""
    mechanism = homed(ArmFlaws(seed=seed))
    here = least_tilt(ARM, TABLE.grip_point(Place("e5"), chess.QUEEN)).joints
    placed = forward(ARM, go(mechanism, ARM.home, here))[:2, 3]
    for move in range(1, 30):
        for _ in range(2):
            go(mechanism, here, here + 0.1, seconds=0.05)
            go(mechanism, here + 0.1, here, seconds=0.05)
        now = forward(ARM, here + mechanism.errors)[:2, 3]
        if np.linalg.norm(now - placed) > _GRASP:
            return move
    return 30


def test_a_queen_set_down_is_missed_about_four_moves_later() -> None:
    moves = sorted(moves_until_missed(seed) for seed in range(15))
    assert 3 <= moves[7] <= 5
    assert moves[0] >= 2


def test_steps_lost_by_force_are_found_again_by_homing() -> None:
    mechanism = homed(FLAWLESS)
    mechanism.lose(np.array([0.0, 0.1, 0.0, 0.0, 0.0]))
    assert mechanism.follow(TICK, ARM.coupling @ ARM.home, 1) - ARM.home == pytest.approx([0, 0.1, 0, 0, 0])
    assert mechanism.follow(TICK, ARM.coupling @ ARM.home, 2) == pytest.approx(ARM.home)


def test_play_leaves_a_joint_behind_on_the_side_it_came_from() -> None:
    mechanism = homed(ArmFlaws(drift=0.0, temperature=0.0, homing=0.0))
    half = ARM.drift.play / 2
    up = ARM.home + 0.1
    assert np.allclose(go(mechanism, ARM.home, up), up - half)
    assert np.allclose(go(mechanism, up, ARM.home), ARM.home + half)


def test_warmth_grows_with_work_until_the_next_homing() -> None:
    mechanism = homed(ArmFlaws(drift=0.0, play=0.0, homing=0.0))
    for k in range(2400):
        mechanism.follow(0.5, ARM.coupling @ (ARM.home + 0.01 * (k % 2)), 1)
    grown = WARM * (1 - np.exp(-1.0)) * ARM.drift.temperature
    assert mechanism.errors == pytest.approx(grown, rel=0.02)
    mechanism.follow(0.008, ARM.coupling @ ARM.home, 2)
    assert not mechanism.errors.any()


def test_another_coupling_and_offsets_show_in_the_joints() -> None:
    coupling = np.eye(5)
    mechanism = homed(
        FLAWLESS.model_copy(update={"coupling": tuple(map(tuple, coupling)), "offsets": (0.01,) * 5})
    )
    goal = ARM.home + 0.2
    assert np.allclose(go(mechanism, ARM.home, goal), ARM.coupling @ goal + 0.01)


def test_the_same_seed_loses_the_same_and_a_copy_goes_on_alike() -> None:
    one, two, other = homed(ArmFlaws(seed=4)), homed(ArmFlaws(seed=4)), homed(ArmFlaws(seed=5))
    for mechanism in (one, two, other):
        there_and_back(mechanism, 3)
    assert (one.errors == two.errors).all()
    assert (one.errors != other.errors).any()
    again = Mechanism(ARM, ArmFlaws(seed=9))
    again.restore(one.snapshot())
    for mechanism in (one, again):
        there_and_back(mechanism, 2)
    assert (one.errors == again.errors).all()


def test_bad_couplings_are_refused() -> None:
    with pytest.raises(ValueError, match="cannot be inverted"):
        ArmFlaws(coupling=((1.0, 1.0), (1.0, 1.0)))
    with pytest.raises(ValueError, match="2 rows need 2 numbers each"):
        ArmFlaws(coupling=((1.0,), (1.0, 1.0)))
