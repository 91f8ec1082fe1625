"""A table on which nothing moves by itself: for cameras that need no physics."""

from typing import Any

import mujoco

from kempelen.twin.physics.model import build_model
from kempelen.twin.physics.robot import machine_of
from kempelen.twin.physics.scene import Scene


class Still:
    """A stage with everything where the scene puts it.

    Args:
        scene: What there is.
        machine: Whether the robot, parked, and the person, at rest, are there.
    """

    def __init__(self, scene: Scene, *, machine: bool = True) -> None:
        self.scene = scene
        self.model: Any = build_model(scene, machine=machine)
        self.data: Any = mujoco.MjData(self.model)
        if machine:
            _park(self.data, scene)


def _park(data: Any, scene: Scene) -> None:
    """The robot where it is between two moves; its joints come after the pieces'."""
    machine, start = machine_of(scene), 7 * len(scene.pieces)
    data.qpos[start : start + len(machine.joints)] = machine.parked * machine.scale
