"""Drawing by OpenGL, through MuJoCo's own renderer."""

from typing import Any

import mujoco
import numpy as np

from kempelen.core.camera import Depth, Picture
from kempelen.core.geometry import Array
from kempelen.twin.cameras.region import Region
from kempelen.twin.cameras.render import (
    AMBIENT_SHARE,
    FAR,
    NEAR,
    SPECULAR_SHARE,
    Ids,
    View,
    lamp_and_board,
)
from kempelen.twin.cameras.settings import Lighting
from kempelen.twin.physics.opengl import Canvas
from kempelen.twin.physics.scene import Scene
from kempelen.twin.physics.units import METRES

BUFFER = (2048, 1536)
"""Of the off-screen buffer, pixels; larger regions are drawn in tiles."""
_SLICES, _STACKS = 32, 16
_SHADOW_MAP = 2048
_MAX_GEOMS = 4000
_SKY = 3000.0


class GlRenderer:
    """MuJoCo's renderer on an off-screen OpenGL context, which belongs to the thread that made it.

    Args:
        model: MuJoCo's, which is given a larger off-screen buffer.
    """

    name = "gl"

    def __init__(self, model: Any) -> None:
        visual = model.vis
        visual.global_.offwidth, visual.global_.offheight = BUFFER
        visual.quality.numslices, visual.quality.numstacks = _SLICES, _STACKS
        visual.quality.shadowsize = _SHADOW_MAP
        self._model = model
        self._canvas = Canvas(model)
        self._scene = mujoco.MjvScene(model, maxgeom=_MAX_GEOMS)
        self._option = mujoco.MjvOption()
        self._perturb, self._camera = mujoco.MjvPerturb(), mujoco.MjvCamera()
        self._lighting = Lighting()

    def look(self, data: Any, scene: Scene, lighting: Lighting) -> None:
        """Take in where everything is now."""
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(
            self._model, data, self._option, self._perturb, self._camera, everything, self._scene
        )
        for geom in self._scene.geoms[: self._scene.ngeom]:
            geom.segid = geom.objid
        self._place_lamp(scene, lighting)

    def _place_lamp(self, scene: Scene, lighting: Lighting) -> None:
        """The lamp, and a sky that throws no shadow: MuJoCo's shadows are black where a lamp is alone."""
        (lamp, middle), (first, second) = lamp_and_board(scene, lighting), self._scene.lights[:2]
        self._scene.nlight = 2
        _shine(first, lamp, middle - lamp, lighting.brightness * lighting.on)
        first.castshadow, first.ambient = int(lighting.shadows), np.zeros(3)
        _shine(second, middle + np.array([0.0, 0.0, _SKY]), np.array([0.0, 0.0, -1.0]), 0.0)
        second.castshadow = 0
        second.ambient = np.full(3, AMBIENT_SHARE * lighting.ambient * lighting.on)
        second.diffuse = np.full(3, (1 - AMBIENT_SHARE) * lighting.ambient * lighting.on)

    def colour(self, view: View, region: Region) -> Picture:
        """(h, w, 3) blue, green, red of a part of the picture."""
        rgb, _ = self._draw(view, region, ids=False)
        return np.ascontiguousarray(rgb[..., ::-1])

    def geometry(self, view: View, region: Region) -> tuple[Depth, Ids]:
        """(h, w) depth along the view, mm, 0 for nothing, and number of the geom, -1 for nothing."""
        code, z = self._draw(view, region, ids=True)
        near, far = np.float32(NEAR), np.float32(FAR)
        # Undo the reversed, hyperbolic depth buffer: 1 at the near plane, 0 at the far one.
        depth = (near * far / (far - near)) / (z + near / (far - near))
        ids = code[..., 0].astype(np.int16) + (code[..., 1].astype(np.int16) << 8) - 1
        depth[ids < 0] = 0
        return depth, ids

    def _draw(self, view: View, region: Region, *, ids: bool) -> tuple[Picture, Depth]:
        flags = self._scene.flags
        flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = ids
        flags[mujoco.mjtRndFlag.mjRND_SHADOW] = not ids and bool(self._scene.lights[0].castshadow)
        flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = not ids
        flags[mujoco.mjtRndFlag.mjRND_HAZE] = flags[mujoco.mjtRndFlag.mjRND_FOG] = False
        for camera in self._scene.camera:
            _aim(camera, view, region)
        return self._canvas.draw(self._scene, region.width, region.height)

    def close(self) -> None:
        """Give back the context."""
        self._canvas.close()


def _shine(light: Any, where: Array, way: Array, strength: float) -> None:
    """A lamp at ``where`` (3,) mm that points ``way`` (3,)."""
    light.type = mujoco.mjtLightType.mjLIGHT_SPOT
    light.pos, light.dir = where * METRES, way / np.linalg.norm(way)
    light.attenuation, light.cutoff, light.exponent, light.headlight = (1.0, 0.0, 0.0), 75.0, 0.0, 0
    light.diffuse, light.specular = np.full(3, strength), np.full(3, SPECULAR_SHARE * strength)


def _aim(camera: Any, view: View, region: Region) -> None:
    """A frustum that is the region's part of the view: at the near plane, in metres."""
    lens, pose = view.intrinsics, view.robot_from_camera
    near = NEAR * METRES

    def window(pixel: float, centre: float) -> float:
        return (pixel - 0.5 - centre) / lens.fx * near

    left, right = window(region.left, lens.cx), window(region.right, lens.cx)
    camera.frustum_center = (left + right) / 2
    camera.frustum_width = (right - left) / 2
    camera.frustum_top = -window(region.top, lens.cy)
    camera.frustum_bottom = -window(region.bottom, lens.cy)
    camera.frustum_near, camera.frustum_far = near, FAR * METRES
    camera.orthographic = 0
    camera.pos = pose.translation * METRES
    forward: Array = pose.rotation[:, 2]
    camera.forward, camera.up = forward, -pose.rotation[:, 1]
