"""The race of the axes: its schedule keeps the hurdles, its bound is beaten by nobody."""

import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.unit.motion.motion_tables import placed, random_board, random_transfer

from kempelen.core.table import Table, WorkSpace, start_layout
from kempelen.motion import race
from kempelen.motion.cutting import cut
from kempelen.motion.leg import Hurdle, Leg
from kempelen.motion.plan import propose_carry
from kempelen.motion.profile import Profile
from kempelen.motion.scene import Scene

SCENE = Scene(Table(), placed())
CEILING = SCENE.table.space.upper[2]
SEEDS = st.integers(0, 2**32 - 1)


def random_leg(seed: int) -> Leg:
    """Any hurdles at all, in any order, overlapping or not; none that is impossible."""
    rng = random.Random(seed)
    length = rng.choice([rng.uniform(0.5, 20), rng.uniform(20, 400)])
    start, end = (100.0, 100.0, rng.uniform(0, 120)), (100.0 + length, 100.0, rng.uniform(0, 120))
    hurdles = []
    for _ in range(rng.randrange(7)):
        enter, leave = sorted(rng.uniform(0, length) for _ in range(2))
        hurdles.append(Hurdle(enter, leave, rng.uniform(min(start[2], end[2]), CEILING), "a hurdle"))
    rise = max([start[2], end[2], *(hurdle.height for hurdle in hurdles)])
    return Leg("test", SCENE, start, end, None, length, (1.0, 0.0), tuple(hurdles), rise)


def position(profile: Profile, time: float) -> float:
    """Distance driven, from the definition of a trapezoid."""
    if time <= 0:
        return 0.0
    if time >= profile.seconds:
        return profile.distance
    if time > profile.seconds / 2:
        return profile.distance - position(profile, profile.seconds - time)
    ramp = min(time, profile.ramp)
    return profile.acceleration * ramp * ramp / 2 + profile.speed * max(time - profile.ramp, 0.0)


def shortfall(leg: Leg, wait: float, up: Profile, down: Profile, seconds: float) -> float:
    """By how much, at worst, z is below a hurdle while the point is within it."""
    travel, worst = leg.travel(), 0.0
    for time in np.linspace(0, seconds, 1000):
        s = position(travel, time - wait)
        falling = position(down, time - (seconds - down.seconds))
        z = leg.start[2] + position(up, time) - falling
        for hurdle in leg.hurdles:
            if hurdle.enter + 1e-6 < s < hurdle.leave - 1e-6:
                worst = max(worst, hurdle.height - z)
    return worst


@settings(max_examples=150)
@given(SEEDS)
def test_the_schedule_keeps_every_hurdle(seed: int) -> None:
    leg = random_leg(seed)
    run = race.run(leg)
    assert shortfall(leg, run.wait, run.up, run.down, run.seconds) < 1e-6
    assert run.peak <= CEILING + 1e-9
    assert run.seconds >= run.wait + run.travel.seconds - 1e-12


@settings(max_examples=80)
@given(SEEDS)
def test_no_admissible_schedule_beats_the_bound(seed: int) -> None:
    """Random peaks, starts and durations: those that keep the hurdles all take at least the bound."""
    leg, rng = random_leg(seed), random.Random(seed + 1)
    bound, travel = race.run(leg).bound, leg.travel()
    for _ in range(6):
        peak = rng.uniform(leg.rise, min(leg.rise + 60, CEILING))
        up, down = leg.lift(peak - leg.start[2]), leg.lift(peak - leg.end[2])
        least = max(up.seconds + down.seconds, travel.seconds)
        seconds = least * rng.choice([1.0, rng.uniform(1.0, 1.3), rng.uniform(1.0, 2.5)])
        wait = rng.uniform(0, seconds - travel.seconds)
        if shortfall(leg, wait, up, down, seconds) < 1e-9:
            assert seconds >= bound - 2e-3  # the check looks at 1,000 instants


@given(SEEDS)
def test_the_schedule_is_the_bound_itself(seed: int) -> None:
    run = race.run(random_leg(seed))
    assert 0 < run.bound <= run.seconds + 1e-12
    assert run.seconds <= run.bound + 5e-4


@given(SEEDS)
def test_another_hurdle_never_lowers_the_bound(seed: int) -> None:
    leg = random_leg(seed)
    less = Leg(
        leg.title, leg.scene, leg.start, leg.end, None, leg.length, leg.direction, leg.hurdles[1:],
        max([leg.start[2], leg.end[2], *(hurdle.height for hurdle in leg.hurdles[1:])]),
    )  # fmt: skip
    assert race.run(less).bound <= race.run(leg).bound + 3e-4


def test_without_hurdles_the_slowest_axis_decides() -> None:
    leg = Leg("test", SCENE, (0, 0, 50), (300, 0, 50), None, 300.0, (1.0, 0.0), (), 50.0)
    assert race.run(leg).seconds == pytest.approx(1.2)
    assert race.run(leg).bound == pytest.approx(1.2)
    tall = Leg("test", SCENE, (0, 0, 0), (30, 0, 180), None, 30.0, (1.0, 0.0), (), 180.0)
    assert race.least_seconds(tall) == pytest.approx(0.8)


def test_each_axis_has_its_own_limits() -> None:
    space = WorkSpace(velocity=(300, 100, 50), acceleration=(1500, 1000, 200))
    scene = Scene(Table(space=space), placed())
    across = Leg.between(scene, (50, 50, 100), (350, 350, 100), None, "test")
    assert across.travel().seconds == pytest.approx(Profile.over(300, 100, 1000).seconds)
    assert across.lift(40).seconds == pytest.approx(Profile.over(40, 50, 200).seconds)


# --- the polyline ----------------------------------------------------------------------------------------


def curve(leg: Leg) -> np.ndarray:
    run = race.run(leg)
    times = np.linspace(0, run.seconds, 4000)
    s = [position(run.travel, t - run.wait) for t in times]
    z = [
        leg.start[2] + position(run.up, t) - position(run.down, t - (run.seconds - run.down.seconds))
        for t in times
    ]
    return np.stack([s, z], axis=1)


def cut_off(leg: Leg) -> float:
    """Greatest distance of the curve from its polyline."""
    points = np.array(cut(leg, race.run(leg)))
    steps = np.diff(points, axis=0)
    square = np.maximum((steps**2).sum(axis=1), 1e-12)
    away = curve(leg)[:, None, :] - points[None, :-1, :]
    share = np.clip((away * steps).sum(axis=2) / square, 0, 1)
    return float(np.linalg.norm(away - share[:, :, None] * steps, axis=2).min(axis=1).max())


@settings(max_examples=40)
@given(SEEDS)
def test_the_polyline_of_a_carry_is_within_the_junction_deviation_of_the_curve(seed: int) -> None:
    rng = random.Random(seed)
    layout = start_layout(SCENE.table, random_board(rng))
    transfer = random_transfer(layout, SCENE.table, rng)
    leg, _ = propose_carry(Scene(SCENE.table, layout), transfer)
    assert cut_off(leg) <= 1.05 * SCENE.table.space.junction_deviation


@settings(max_examples=60)
@given(SEEDS)
def test_even_where_it_turns_on_the_spot_little_is_cut_off(seed: int) -> None:
    leg = random_leg(seed)
    points = cut(leg, race.run(leg))
    assert cut_off(leg) <= 2 * SCENE.table.space.junction_deviation
    assert (points[0], points[-1]) == ((0.0, leg.start[2]), (leg.length, leg.end[2]))


@settings(max_examples=60)
@given(SEEDS)
def test_no_crumbs_and_no_going_back(seed: int) -> None:
    leg = random_leg(seed)
    points = np.array(cut(leg, race.run(leg)))
    assert (np.diff(points[:, 0]) >= -1e-9).all()
    assert len(points) == 2 or np.abs(np.diff(points, axis=0)).sum(axis=1).min() > 0.02
