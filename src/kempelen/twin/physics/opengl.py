"""OpenGL without a window, by whatever library works here.

A missing or broken OpenGL can abort the process that asks for it, so another process tries first.
"""

import importlib
import os
import subprocess
import sys
from functools import cache
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Picture
from kempelen.core.errors import TwinError

_PROBE = """
import importlib, mujoco, sys
context = importlib.import_module("mujoco." + sys.argv[1]).GLContext(8, 8)
context.make_current()
mujoco.MjrContext(mujoco.MjModel.from_xml_string("<mujoco/>"), 100)
"""
_PROBE_SECONDS = 60.0
_LIBRARIES = ("egl", "osmesa", "glfw")


@cache
def opengl_library() -> str | None:
    """Name of MuJoCo's module that draws here: MUJOCO_GL's if that is set, else the first that works."""
    asked = os.environ.get("MUJOCO_GL", "").strip().lower()
    if asked in {"disable", "disabled", "off", "false", "0"}:
        return None
    candidates = (asked,) if asked in _LIBRARIES else _LIBRARIES
    return next((name for name in candidates if _draws(name)), None)


def _draws(library: str) -> bool:
    try:
        found = subprocess.run(
            [sys.executable, "-c", _PROBE, library], capture_output=True, timeout=_PROBE_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return found.returncode == 0


class Canvas:
    """An off-screen OpenGL context with a model's meshes and textures; belongs to the thread that made it.

    Args:
        model: MuJoCo's; says how large the buffer is (``vis.global_.offwidth`` and ``offheight``).

    Raises:
        TwinError: OpenGL does not work here.
    """

    def __init__(self, model: Any) -> None:
        library = opengl_library()
        if library is None:
            raise TwinError(
                "The twin cannot draw: OpenGL does not work here.",
                hint="Set MUJOCO_GL to egl or osmesa before the start, and install that library.",
            )
        size = (int(model.vis.global_.offwidth), int(model.vis.global_.offheight))
        self._gl = importlib.import_module(f"mujoco.{library}").GLContext(*size)
        self._gl.make_current()
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR

    def draw(self, scene: Any, width: int, height: int) -> tuple[Picture, npt.NDArray[np.float32]]:
        """Render an MjvScene.

        Returns:
            (height, width, 3) RGB, and (height, width) what the depth buffer holds: 1 at the near plane, 0 at
            the far one.
        """
        rect = mujoco.MjrRect(0, 0, width, height)
        self._gl.make_current()
        mujoco.mjr_render(rect, scene, self._context)
        rgb = np.empty((height, width, 3), dtype=np.uint8)
        depth = np.empty((height, width), dtype=np.float32)
        mujoco.mjr_readPixels(rgb, depth, rect, self._context)
        return rgb[::-1], depth[::-1]

    def close(self) -> None:
        """Give back the context."""
        self._gl.make_current()
        self._context.free()
        self._gl.free()
