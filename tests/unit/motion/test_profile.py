"""Rest-to-rest profiles: limits kept, ends met, nothing faster."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.motion.profile import Profile

DISTANCES = st.floats(0.01, 600.0)
SPEEDS = st.floats(10.0, 500.0)
RATES = st.floats(100.0, 5000.0)


def driven(profile: Profile, time: float) -> tuple[float, float]:
    """Position and speed at a time, integrated from the switches of acceleration alone."""
    position = speed = rate = last = 0.0
    for when, change in [*profile.switches(0.0), (float("inf"), 0.0)]:
        span = min(when, time) - last
        if span > 0:
            position += speed * span + rate * span * span / 2
            speed += rate * span
            last = min(when, time)
        rate += change
    return position, speed


@given(DISTANCES, SPEEDS, RATES)
def test_it_ends_at_rest_where_it_should(distance: float, speed: float, rate: float) -> None:
    profile = Profile.over(distance, speed, rate)
    end, last = driven(profile, profile.seconds)
    assert end == pytest.approx(distance, rel=1e-9, abs=1e-9)
    assert last == pytest.approx(0.0, abs=1e-6)


@given(DISTANCES, SPEEDS, RATES, st.floats(0, 1))
def test_passing_times_agree_with_the_driven_motion(
    distance: float, speed: float, rate: float, share: float
) -> None:
    profile = Profile.over(distance, speed, rate)
    position, now = driven(profile, profile.passing(share * distance))
    assert position == pytest.approx(share * distance, rel=1e-6, abs=1e-6)
    assert now <= min(speed, profile.speed) * (1 + 1e-9)


@given(DISTANCES, SPEEDS, RATES)
def test_no_faster_than_the_limits_allow(distance: float, speed: float, rate: float) -> None:
    seconds = Profile.over(distance, speed, rate).seconds
    assert seconds >= distance / speed
    assert seconds >= 2 * (distance / rate) ** 0.5 * (1 - 1e-12)
    assert seconds <= distance / speed + speed / rate + 1e-9 or distance < speed * speed / rate


@given(DISTANCES, SPEEDS, RATES, st.floats(0, 1))
def test_seen_backwards_it_is_the_same(distance: float, speed: float, rate: float, share: float) -> None:
    profile = Profile.over(distance, speed, rate)
    there, back = profile.passing(share * distance), profile.passing((1 - share) * distance)
    assert there + back == pytest.approx(profile.seconds, rel=1e-6, abs=1e-7)


@given(DISTANCES, st.floats(1, 300), st.floats(0, 1))
def test_a_farther_goal_is_never_passed_later_on_the_way(distance: float, more: float, share: float) -> None:
    near, far = Profile.over(distance, 300, 1500), Profile.over(distance + more, 300, 1500)
    assert far.passing(share * distance) <= near.passing(share * distance) + 1e-9


def test_no_distance_no_motion() -> None:
    profile = Profile.over(0.0, 300, 1500)
    assert (profile.seconds, profile.switches(1.0), profile.passing(5.0)) == (0.0, [], 0.0)


def test_by_hand() -> None:
    profile = Profile.over(90.0, 300.0, 1500.0)  # 0.2 s up, 0.1 s at speed, 0.2 s down
    assert profile.seconds == pytest.approx(0.5)
    assert [profile.passing(d) for d in (-1.0, 30.0, 45.0, 60.0, 90.0, 99.0)] == pytest.approx(
        [0.0, 0.2, 0.25, 0.3, 0.5, 0.5]
    )
