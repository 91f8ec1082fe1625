"""MuJoCo bodies of the gantry: three slides that carry the hand.

The slides, like steppers, go where they are told: they are so heavy that no piece holds them up, and their
speed is set from outside.
"""

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceShape
from kempelen.core.table import Table
from kempelen.twin.physics.appearance import add_frame
from kempelen.twin.physics.clearance import Clearance
from kempelen.twin.physics.gripper import PALM_HEIGHT, Jaw, add_gripper
from kempelen.twin.physics.scene import Scene
from kempelen.twin.physics.units import METRES

SLIDE_MASS = 100.0
"""With the motors' reflected inertia, kg: what a piece pushes back does not move the machine."""


class Gantry:
    """Slides named x, y, z; joint values are the tool point's coordinates, robot frame, mm.

    Args:
        table: Whose gripper and work space it has.
    """

    joints: tuple[str, ...] = ("x", "y", "z")
    scale = METRES
    fastest = 5000.0
    standstill = 1e-3
    stall = math.inf
    unit = "mm"

    def __init__(self, table: Table) -> None:
        self._table, self._space = table, table.space
        self._jaw = Jaw.of(table.gripper)

    @property
    def start(self) -> Array:
        """(3,) mm: the work space's corner, up."""
        return np.array([*self._space.lower[:2], self._space.upper[2]])

    @property
    def parked(self) -> Array:
        """(3,) mm: between two moves."""
        return self._table.park_point(np.array(self._space.upper))

    def tool(self, joints: Array) -> Array:
        """(3,) mm: the tool point, robot frame."""
        return joints

    def pads(self, joints: Array) -> float:
        """rad: they are rigid."""
        del joints
        return 0.0

    def sweep(self, way: Array) -> float:
        """mm: what no point of the machine goes farther than when its joints go by ``way``."""
        return float(np.abs(way).max()) * math.sqrt(3)

    def clearance(self, shapes: Sequence[PieceShape]) -> Clearance:
        """How far the hand is from such pieces."""
        return Clearance(self._jaw, shapes)

    def build(self, spec: Any, scene: Scene) -> None:
        """Add slides, hand and frame to an MjSpec."""
        body, slides = spec.worldbody, {}
        for index, axis in enumerate(self.joints):
            body = slides[axis] = body.add_body(name=f"slide_{axis}", gravcomp=1.0)
            body.explicitinertial = True
            body.mass = SLIDE_MASS
            body.inertia = (1e-2, 1e-2, 1e-2)
            unit = tuple(float(i == index) for i in range(3))
            body.add_joint(name=axis, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=unit)
        add_gripper(spec, body, self._jaw)
        palm_top = self._jaw.length + PALM_HEIGHT
        add_frame(spec, slides, self._space, palm_top=palm_top, table_top=scene.table_top)
