"""The controller's speed model."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.surfaces import Point
from kempelen.core.table import WorkSpace
from kempelen.motion.profile import Profile
from kempelen.motion.timing import travel_seconds

SPACE = WorkSpace()
LENGTHS = st.floats(0.5, 300.0)


@given(LENGTHS, st.integers(1, 9))
def test_a_straight_line_is_one_trapezoid_however_it_is_cut(length: float, cuts: int) -> None:
    line = np.linspace([0, 0, 0], [length, 0, 0], cuts + 1)
    assert travel_seconds(line, SPACE) == pytest.approx(Profile.over(length, 300, 1500).seconds, rel=1e-6)


@given(LENGTHS)
def test_a_diagonal_uses_both_axes(length: float) -> None:
    line = np.array([[0, 0, 0], [length, length, 0]])
    assert travel_seconds(line, SPACE) == pytest.approx(Profile.over(length, 300, 1500).seconds, rel=1e-6)


@given(LENGTHS, LENGTHS)
def test_a_right_angle_is_nearly_a_stop(a: float, b: float) -> None:
    """At a corner from +z to +x the controller's rate is that of both axes together."""
    bend = np.array([[0, 0, 0], [0, 0, a], [b, 0, a]])
    corner = sqrt(1500 * sqrt(2) * 0.02 * sqrt(0.5) / (1 - sqrt(0.5)))
    stops = Profile.over(a, 300, 1500).seconds + Profile.over(b, 300, 1500).seconds
    saved = stops - travel_seconds(bend, SPACE)
    assert corner == pytest.approx(10.1, abs=0.1)
    assert 0 < saved <= 2 * corner / 1500 + 1e-9


@given(st.lists(st.tuples(*[st.floats(0, 200)] * 3), min_size=2, max_size=12))
def test_there_and_back_take_the_same_time(points: list[Point]) -> None:
    path = np.array(points)
    assert travel_seconds(path[::-1], SPACE) == pytest.approx(travel_seconds(path, SPACE), rel=1e-6)


@given(st.lists(st.tuples(*[st.floats(0, 200)] * 3), min_size=2, max_size=12))
def test_never_faster_than_any_axis_alone(points: list[Point]) -> None:
    path = np.array(points)
    ways = np.abs(np.diff(path, axis=0)).sum(axis=0)
    assert travel_seconds(path, SPACE) >= max(ways) / 300 - 1e-9


def test_a_reversal_is_a_full_stop() -> None:
    path = np.array([[0, 0, 0], [100, 0, 0], [0, 0, 0]])
    assert travel_seconds(path, SPACE) == pytest.approx(2 * Profile.over(100, 300, 1500).seconds, rel=1e-3)


def test_standing_still_takes_no_time() -> None:
    assert travel_seconds(np.array([[1.0, 2, 3], [1, 2, 3]]), SPACE) == 0.0
    assert travel_seconds(np.array([[1.0, 2, 3]]), SPACE) == 0.0


def test_a_finely_cut_quarter_circle_runs_at_the_speed_of_its_radius() -> None:
    """v² = a R when the chords are as far from the arc as the junction deviation."""
    radius, deviation = 60.0, SPACE.junction_deviation
    step = 2 * np.arccos(1 - deviation / radius)
    angles = np.linspace(0, np.pi / 2, int(np.pi / 2 / step) + 1)
    arc = np.stack([radius * (1 - np.cos(angles)), np.zeros_like(angles), radius * np.sin(angles)], axis=1)
    run_up = np.array([[0.0, 0, -400]])
    run_out = np.array([[460.0, 0, 60]])
    seconds = travel_seconds(np.concatenate([run_up, arc, run_out]), SPACE)
    straight = 2 * (Profile.over(800, 300, 1500).seconds / 2)
    turning = radius * np.pi / 2 / sqrt(1500 * radius)
    assert seconds == pytest.approx(straight + turning, rel=0.06)
