"""Pictures of a simulation, where OpenGL works.

A missing or broken OpenGL can abort the process that asks for it, so another process tries first.
"""

import subprocess
import sys
from functools import cache
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from kempelen.core.errors import TwinError

Picture = npt.NDArray[np.uint8]

_PROBE = """
import mujoco
with mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8) as renderer:
    renderer.render()
"""
_PROBE_SECONDS = 60.0
_HINT = "Set MUJOCO_GL to egl or osmesa before the start, and install that library."


@cache
def opengl_works() -> bool:
    """Whether pictures can be drawn here, as another process with the same environment found."""
    try:
        found = subprocess.run(
            [sys.executable, "-c", _PROBE], capture_output=True, timeout=_PROBE_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return found.returncode == 0


def draw(model: Any, data: Any, width: int, height: int, camera: str) -> Picture:
    """(height, width, 3) RGB view of a camera.

    Raises:
        TwinError: no OpenGL here, no such camera, or a picture too large.
    """
    if not opengl_works():
        raise TwinError("The twin cannot draw: OpenGL does not work here.", hint=_HINT)
    cameras = [model.camera(i).name for i in range(model.ncam)]
    if camera not in cameras:
        raise TwinError(f"The twin has no camera '{camera}'.", hint=f"It has {', '.join(cameras)}.")
    most = (int(model.vis.global_.offwidth), int(model.vis.global_.offheight))
    if not (0 < width <= most[0] and 0 < height <= most[1]):
        raise TwinError(
            f"A picture of {width} x {height} pixels is out of range.",
            hint=f"1 x 1 to {most[0]} x {most[1]}.",
        )
    with mujoco.Renderer(model, height, width) as renderer:
        mujoco.mj_kinematics(model, data)
        renderer.update_scene(data, camera)
        return np.asarray(renderer.render(), dtype=np.uint8)
