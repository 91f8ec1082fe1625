"""Pictures of a simulation by its own fixed cameras, where OpenGL works: for people and reports."""

from typing import Any

import mujoco
import numpy as np

from kempelen.core.camera import Picture
from kempelen.core.errors import TwinError
from kempelen.twin.physics.opengl import Canvas

_MAX_GEOMS = 4000


def draw(model: Any, data: Any, width: int, height: int, camera: str) -> Picture:
    """(height, width, 3) RGB view of a camera.

    Raises:
        TwinError: no OpenGL here, no such camera, or a picture too large.
    """
    cameras = [model.camera(i).name for i in range(model.ncam)]
    if camera not in cameras:
        raise TwinError(f"The twin has no camera '{camera}'.", hint=f"It has {', '.join(cameras)}.")
    most = (int(model.vis.global_.offwidth), int(model.vis.global_.offheight))
    if not (0 < width <= most[0] and 0 < height <= most[1]):
        raise TwinError(
            f"A picture of {width} x {height} pixels is out of range.",
            hint=f"1 x 1 to {most[0]} x {most[1]}.",
        )
    canvas = Canvas(model)
    try:
        picture, _ = canvas.draw(_scene(model, data, cameras.index(camera)), width, height)
    finally:
        canvas.close()
    return np.ascontiguousarray(picture)


def _scene(model: Any, data: Any, camera: int) -> Any:
    scene, eye = mujoco.MjvScene(model, maxgeom=_MAX_GEOMS), mujoco.MjvCamera()
    eye.type, eye.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, camera
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    every = mujoco.mjtCatBit.mjCAT_ALL.value
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), mujoco.MjvPerturb(), eye, every, scene)
    return scene
