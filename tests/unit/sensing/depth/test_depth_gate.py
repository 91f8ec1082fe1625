from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pytest

from kempelen.core.camera import Frame
from kempelen.sensing.depth.gate import DepthGate, GateReading
from kempelen.sensing.depth.reader import DepthReader
from kempelen.testing.depth_scene import SKIN, SQUARE, DepthScene, Post, men, start_men

RATE = 30


@lru_cache(maxsize=16)
def shot(posts: tuple[Post, ...], seed: int) -> Frame:
    return DepthScene(posts=posts).frame(noise=1.5, seed=seed)


class Watch:
    """A gate over one camera, a frame after the other."""

    def __init__(self) -> None:
        self.scene = DepthScene(posts=start_men())
        self.reader, self.gate = DepthReader(), DepthGate()
        self.reader.place(self.scene.frame(noise=1.5), self.scene.sighting)
        self.count = 0

    def see(self, posts: Sequence[Post], seconds: float = 1 / RATE) -> GateReading:
        self.count += 1
        time = self.count * seconds
        look = self.reader.look(shot(tuple(posts), self.count % 3))
        reading = self.gate.check(look.map, look.contrast, look.noise, time)
        if not reading.hand:
            self.gate.accept(look.map, look.contrast, look.noise, time)
        return reading


def arm(reach: float, height: float) -> list[Post]:
    """From beyond rank 1 to so many squares up the e file, at a height."""
    steps = np.arange(-2.4, reach, 0.3)
    return [
        Post(4.5 * SQUARE, y * SQUARE, height, radius=22.0, colour=SKIN, bottom=height - 30) for y in steps
    ]


@pytest.fixture
def watch() -> Watch:
    out = Watch()
    for _ in range(3):
        assert not out.see(start_men()).hand  # kings of 95 mm among them
    return out


def test_a_high_hand_is_seen_at_once(watch: Watch) -> None:
    reading = watch.see([*start_men(), *arm(3, 150)])
    assert reading.hand
    assert "above the board" in reading.reason
    assert reading.mask.any()
    assert watch.see(start_men()).hand in {True, False}  # a frame for the motion to end
    assert not watch.see(start_men()).hand


def test_a_low_hand_between_the_pieces_is_seen_and_stays_one_while_it_rests(watch: Watch) -> None:
    low = [*start_men(), *arm(3, 60)]
    for _ in range(40):
        assert watch.see(low).hand
    watch.see(start_men())
    assert not watch.see(start_men()).hand


def test_a_new_piece_is_no_hand(watch: Watch) -> None:
    moved = [*start_men()[:-1], *men({35: 95.0, 36: 55.0})]
    watch.see(moved, 1.0)  # so long after the last frame that nothing moves
    assert not watch.see(moved, 1.0).hand


def test_a_piece_that_moves_is_a_hand(watch: Watch) -> None:
    for step in range(6):
        carried = Post((1.5 + 0.5 * step) * SQUARE, 3.5 * SQUARE, 60.0)
        assert watch.see([*start_men(), carried]).hand


def test_what_rests_beside_the_board_belongs_there(watch: Watch) -> None:
    beside = [Post(9.0 * SQUARE, y * SQUARE, 40.0, radius=25.0) for y in np.arange(-2, 3, 0.4)]
    for _ in range(40):
        assert not watch.see([*start_men(), *beside]).hand
    assert watch.see([*start_men(), *beside, *arm(3, 60)]).hand


def test_a_board_that_vanishes_behind_something_black_is_hidden(watch: Watch) -> None:
    look = watch.reader.look(watch.scene.frame(noise=1.5, holes=[Post(200.0, 200.0, 5.0, radius=120.0)]))
    reading = watch.gate.check(look.map, look.contrast, look.noise, 9.0)
    assert reading.hand
    assert "hidden" in reading.reason


def test_the_limit_rises_with_taller_pieces() -> None:
    gate = DepthGate()
    gate.expect_tallest(120.0)
    assert gate.parameters["hand.above"] == 140.0
    gate.expect_tallest(60.0)
    assert gate.parameters["hand.above"] == 118.0
