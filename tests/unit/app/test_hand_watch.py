"""Whose hand it is that is seen over the board."""

from itertools import count

import numpy as np

from kempelen.app.hand_watch import HAND_LOOKS, HandWatch
from kempelen.core.senses import Observation, Sight

FRAME_S = 0.1


class Scene:
    """A watch, and looks at so many frames a second."""

    def __init__(self) -> None:
        self.watch = HandWatch()
        self._times = count()

    def see(self, sight: Sight, looks: int, *, robot: bool = False) -> list[bool]:
        """What is told."""
        told = (
            self.watch.look(Observation(np.zeros((64, 3)), next(self._times) * FRAME_S, sight), robot=robot)
            for _ in range(looks)
        )
        return [hand for hand in told if hand is not None]


def test_a_person_comes_and_goes() -> None:
    scene = Scene()
    assert scene.see(Sight.CLEAR, 5) == []
    assert scene.see(Sight.HAND, HAND_LOOKS - 1) == []
    assert scene.see(Sight.HAND, 10) == [True]
    assert scene.see(Sight.CLEAR, 5) == [False]


def test_the_robot_is_no_hand_nor_are_pictures_of_it_that_come_late() -> None:
    scene = Scene()
    assert scene.see(Sight.HAND, 50, robot=True) == []
    assert scene.see(Sight.HAND, 2 * HAND_LOOKS) == []
    assert scene.see(Sight.CLEAR, 1) == []
    assert scene.see(Sight.HAND, HAND_LOOKS) == [True]


def test_a_hand_that_takes_the_robots_place_is_told_in_the_end() -> None:
    scene = Scene()
    assert scene.see(Sight.HAND, 5, robot=True) == []
    assert scene.see(Sight.HAND, 40) == [True]


def test_a_hand_is_told_to_have_gone_although_the_robot_has_come() -> None:
    scene = Scene()
    assert scene.see(Sight.HAND, 5) == [True]
    assert scene.see(Sight.HAND, 5, robot=True) == []
    assert scene.see(Sight.CLEAR, 2) == [False]
