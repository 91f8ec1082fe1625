"""From a scene to a compiled MuJoCo model."""

import math
from typing import Any

import mujoco
import numpy as np

from kempelen.core.geometry import Array, Transform
from kempelen.core.pieces import KINDS
from kempelen.twin.physics.appearance import add_materials, add_meshes, paint_textures
from kempelen.twin.physics.bodies import add_piece, add_surfaces, quaternion
from kempelen.twin.physics.hand import add_hand
from kempelen.twin.physics.robot import machine_of
from kempelen.twin.physics.scene import Scene
from kempelen.twin.physics.units import METRES

MAX_VIEW = (1920, 1080)
"""Largest picture, pixels."""


def build_model(scene: Scene, *, machine: bool = True) -> Any:
    """The compiled model of a scene, to be painted before it is drawn: metres, kilograms, seconds inside.

    Args:
        scene: What there is.
        machine: Whether the robot and the person's hand are there, too.
    """
    spec = mujoco.MjSpec()
    option = spec.option
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 10.0
    option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    option.sleep_tolerance = 2e-3
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # a world that breaks must not start anew
    add_materials(spec, scene.look)
    add_surfaces(spec, scene)
    add_meshes(spec, {kind: scene.table.pieces[kind] for kind in KINDS}, scene.look)
    up = Transform(scene.table.robot_from_board.rotation, np.zeros(3))
    for piece in scene.pieces:
        add_piece(spec, piece, scene.shape(piece), up)
    if machine:
        machine_of(scene).build(spec, scene)
        add_hand(spec, scene)
    _add_light_and_camera(spec, scene)
    return spec.compile()


def paint(model: Any, scene: Scene) -> None:
    """Fill the textures of a scene's model; until then they are blank, which physics does not mind."""
    paint_textures(model, scene.look, scene.table.square)


def _add_light_and_camera(spec: Any, scene: Scene) -> None:
    """For views: one lamp, and a camera named ``overview`` that sees board and trays from White's side."""
    visual = spec.visual
    visual.quality.offsamples, visual.quality.shadowsize = 0, 1024
    visual.quality.numslices, visual.quality.numstacks = 16, 8
    visual.global_.offwidth, visual.global_.offheight = MAX_VIEW
    side = 8 * scene.table.square
    robot_from_board = scene.table.robot_from_board
    lamp = robot_from_board @ np.array([side / 2, side / 2, 1500.0])
    spec.worldbody.add_light(pos=lamp * METRES, dir=(0.0, 0.0, -1.0))
    back, up = 1.7 * side, 1.6 * side
    camera = robot_from_board @ _looking_down(math.atan2(back, up), np.array([side / 2, side / 2 - back, up]))
    spec.worldbody.add_camera(
        name="overview", pos=camera.translation * METRES, quat=quaternion(camera), fovy=40.0
    )

    corner = robot_from_board @ _aside(np.array([side / 2, side / 2, 40.0]), 2.6 * side)
    spec.worldbody.add_camera(
        name="portrait", pos=corner.translation * METRES, quat=quaternion(corner), fovy=34.0
    )


def _aside(target: Array, distance: float) -> Transform:
    """Of a camera at White's right hand, half-way up, that looks at ``target`` (3,) from ``distance`` mm."""
    turned = Transform.about_z(math.radians(32.0)) @ _looking_down(math.radians(58.0), np.zeros(3))
    return Transform(turned.rotation, target + distance * turned.rotation[:, 2])


def _looking_down(nod: float, where: Array) -> Transform:
    """Of a camera (x right, y up, looking along -z): from straight down raised by ``nod`` rad towards +y."""
    c, s = math.cos(nod), math.sin(nod)
    return Transform(np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]), where)
