"""A table on which nothing moves by itself: for cameras that need no physics."""

from typing import Any

import mujoco
import numpy as np

from kempelen.core.table import Table
from kempelen.twin.physics.model import build_model
from kempelen.twin.physics.scene import Scene
from kempelen.twin.physics.units import METRES


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
            _park(self.data, scene.table, len(scene.pieces))


def _park(data: Any, table: Table, pieces: int) -> None:
    """The robot's hand where it is between two moves; its joints come after the pieces'."""
    start = 7 * pieces
    data.qpos[start : start + 3] = table.park_point(np.array(table.space.upper)) * METRES
