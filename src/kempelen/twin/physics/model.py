"""From a scene to a compiled MuJoCo model."""

from typing import Any

import mujoco
import numpy as np

from kempelen.core.geometry import Transform
from kempelen.twin.physics.bodies import add_piece, add_surfaces
from kempelen.twin.physics.gantry import Jaw, add_gantry
from kempelen.twin.physics.scene import Scene


def build_model(scene: Scene) -> Any:
    """The compiled model of a scene: metres, kilograms and seconds inside."""
    spec = mujoco.MjSpec()
    option = spec.option
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 10.0
    option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    option.sleep_tolerance = 2e-3
    add_surfaces(spec, scene)
    up = Transform(scene.table.robot_from_board.rotation, np.zeros(3))
    for piece in scene.pieces:
        add_piece(spec, piece, scene.shape(piece), up)
    add_gantry(spec, Jaw.of(scene.table.gripper))
    return spec.compile()
