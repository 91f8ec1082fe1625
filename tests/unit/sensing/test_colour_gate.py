from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pytest

from kempelen.core.camera import Picture
from kempelen.sensing.colour_gate import ColourGate
from kempelen.sensing.depth.gate import GateReading
from kempelen.testing.depth_scene import SKIN, SQUARE, DepthScene, Post, men, start_men


@lru_cache(maxsize=8)
def shot(posts: tuple[Post, ...], seed: int) -> Picture:
    picture = DepthScene(posts=posts).frame(seed=seed).colour
    assert picture is not None
    return picture


SIGHTING = DepthScene().sighting


def arm(reach: float) -> list[Post]:
    return [
        Post(4.5 * SQUARE, y * SQUARE, 80.0, radius=24.0, colour=SKIN, bottom=50.0)
        for y in np.arange(-2.4, reach, 0.3)
    ]


def see(gate: ColourGate, posts: Sequence[Post], time: float, *, gain: float = 1.0) -> GateReading:
    picture = shot(tuple(posts), round(10 * time) % 2)
    reading = gate.check(np.clip(gain * picture, 0, 255).astype(np.uint8), SIGHTING, time)
    if not reading.hand:
        gate.accept()
    return reading


@pytest.fixture
def gate() -> ColourGate:
    out = ColourGate()
    assert not see(out, start_men(), 0.0).hand
    assert not see(out, start_men(), 0.1).hand
    return out


def test_an_arm_is_seen_and_goes(gate: ColourGate) -> None:
    for k in range(2, 8):
        assert see(gate, [*start_men(), *arm(3)], 0.1 * k).hand
    see(gate, start_men(), 0.9)
    assert not see(gate, start_men(), 1.0).hand


def test_a_moved_piece_is_no_hand(gate: ColourGate) -> None:
    moved = [
        *men({28: 45.0}),
        *(post for post in start_men() if (post.x, post.y) != (4.5 * SQUARE, 1.5 * SQUARE)),
    ]
    assert not see(gate, moved, 2.0).hand


@pytest.mark.parametrize("gain", [0.7, 1.3])
def test_another_light_is_no_hand(gate: ColourGate, gain: float) -> None:
    assert not see(gate, start_men(), 2.0, gain=gain).hand


def test_what_rests_is_accepted_in_the_end(gate: ColourGate) -> None:
    ruler = [*start_men(), *arm(2)]
    sights = [see(gate, ruler, 1.0 + 0.6 * k).hand for k in range(10)]
    assert sights[0]
    assert not sights[-1]


def test_motion_is_a_hand(gate: ColourGate) -> None:
    for k in range(4):
        carried = Post((1.5 + k) * SQUARE, 3.5 * SQUARE, 60.0, radius=22.0, colour=SKIN)
        assert see(gate, [*start_men(), carried], 0.2 + 0.1 * k).hand
