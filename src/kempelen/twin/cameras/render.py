"""One interface to three ways of drawing the same scene: OpenGL, Embree's rays, MuJoCo's rays."""

from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Protocol

import mujoco
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Depth, Intrinsics, Picture
from kempelen.core.errors import TwinError
from kempelen.core.geometry import Array, Transform
from kempelen.twin.cameras.region import Region
from kempelen.twin.cameras.settings import Lighting
from kempelen.twin.physics.appearance import HIDDEN
from kempelen.twin.physics.opengl import opengl_library
from kempelen.twin.physics.scene import Scene

Ids = npt.NDArray[np.int16]

NEAR, FAR = 50.0, 12_000.0
"""Nothing nearer or farther is drawn, mm."""


AMBIENT_SHARE = 0.5
"""Of the room's light that comes from everywhere alike; the rest comes from above."""
SPECULAR_SHARE = 0.5
"""Of the lamp's strength, in highlights."""


@dataclass(frozen=True, slots=True)
class View:
    """A pinhole camera without distortion, and with square pixels, in the robot's frame."""

    intrinsics: Intrinsics
    robot_from_camera: Transform


class Stage(Protocol):
    """What can be seen: a world, a simulation, a studio."""

    @property
    def scene(self) -> Scene:
        """What it was built from."""
        ...

    @property
    def model(self) -> Any:
        """MuJoCo's."""
        ...

    @property
    def data(self) -> Any:
        """MuJoCo's."""
        ...


class Renderer(Protocol):
    """Draws a model. Both pictures are of the geometry that is drawn, not of that which is touched."""

    name: str

    def look(self, data: Any, scene: Scene, lighting: Lighting) -> None:
        """Take in where everything is now, as MuJoCo's kinematics has it."""
        ...

    def colour(self, view: View, region: Region) -> Picture:
        """(h, w, 3) blue, green, red of a part of the picture."""
        ...

    def geometry(self, view: View, region: Region) -> tuple[Depth, Ids]:
        """(h, w) depth along the view, mm, 0 for nothing, and number of the geom, -1 for nothing."""
        ...

    def close(self) -> None:
        """Give back what it holds."""
        ...


def drawn_geoms(model: Any) -> npt.NDArray[np.intp]:
    """Numbers of the geoms that are seen."""
    return np.flatnonzero((model.geom_group < HIDDEN) & (model.geom_rgba[:, 3] > 0))


def geom_colours(model: Any) -> Array:
    """(ngeom, 3) red, green, blue from 0 to 1: the material's where there is one."""
    out, material = np.array(model.geom_rgba[:, :3], dtype=np.float64), np.array(model.geom_matid)
    painted = material >= 0
    out[painted] = model.mat_rgba[material[painted], :3]
    return out


def make_renderer(model: Any, backend: str = "auto") -> Renderer:
    """The back end of that name; ``auto``: OpenGL, else Embree, else MuJoCo's rays.

    Raises:
        TwinError: it does not work here.
    """
    from kempelen.twin.cameras.render_gl import GlRenderer  # noqa: PLC0415 - they import this module
    from kempelen.twin.cameras.render_rays import EmbreeTracer, MujocoTracer, RayRenderer  # noqa: PLC0415

    if backend == "gl" or (backend == "auto" and opengl_library() is not None):
        return GlRenderer(model)
    if backend == "rays" or (backend == "auto" and find_spec("embreex") is None):
        return RayRenderer(model, MujocoTracer(model))
    try:
        return RayRenderer(model, EmbreeTracer(model))
    except ImportError as error:
        raise TwinError(
            f"The twin's camera cannot draw by Embree: {error}.", hint="Install embreex, or choose 'auto'."
        ) from None


def kinematics(stage: Stage, data: Any) -> None:
    """Bring (own) ``data`` of the stage's model to where the stage is now, without touching the stage's."""
    data.qpos[:] = stage.data.qpos
    data.mocap_pos[:] = stage.data.mocap_pos
    data.mocap_quat[:] = stage.data.mocap_quat
    mujoco.mj_kinematics(stage.model, data)


def mocap_poses(data: Any) -> Array:
    """(n, 7) metres and w x y z of what is moved from outside."""
    return np.concatenate([data.mocap_pos, data.mocap_quat], axis=1)


def lamp_and_board(scene: Scene, lighting: Lighting) -> tuple[Array, Array]:
    """(3,) the lamp and (3,) the board's middle, robot frame, mm."""
    middle = np.array([4 * scene.table.square, 4 * scene.table.square, 0.0])
    robot_from_board = scene.table.robot_from_board
    return robot_from_board @ np.array(lighting.lamp), robot_from_board @ middle
