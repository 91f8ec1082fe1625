"""An arm whose joints hang on belts or on torques, in MuJoCo: for studies of how well it follows a motion.

The twin of a game moves its joints where the steppers tell (`arm`); here links have their true masses, and
what turns a joint is a torque.
"""

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from kempelen.core.geometry import Array, Transform
from kempelen.kinematics import Arm, Mass
from kempelen.twin.physics.arm import frame_after
from kempelen.twin.physics.bodies import quaternion
from kempelen.twin.physics.units import METRES

STEP = 0.0005
"""Of the physics, s."""

Law = Callable[[float, Array, Array], Array]
"""From time s, joint angles (n,) rad and speeds (n,) rad/s to torques (n,) N m."""


class FreeArm:
    """An arm under gravity whose joints nothing holds but the torques of a law.

    Args:
        arm: With masses.
        load: In the gripper, in the tool's frame.
    """

    def __init__(self, arm: Arm, load: Mass | None = None) -> None:
        spec = mujoco.MjSpec()
        spec.option.timestep = STEP
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        parent, after = spec.worldbody, Transform.identity()
        for name, link, mass in zip(arm.joint_names, arm.links, arm.masses, strict=True):
            parent = _link(parent, name, after @ Transform.about_z(link.offset), frame_after(link), mass)
            after = frame_after(link)
        if load is not None:
            _weight(parent.add_body(name="load"), after, load)
        self._model: Any = spec.compile()

    def follow(self, start: Array, law: Law, seconds: float) -> Array:
        """Joint angles (m, n) rad at every step of a motion from rest at ``start`` (n,) under a law."""
        data = mujoco.MjData(self._model)
        data.qpos[:] = start
        steps = int(np.ceil(seconds / STEP))
        out = np.empty((steps + 1, len(start)))
        for i in range(steps + 1):
            out[i] = data.qpos
            data.qfrc_applied[:] = law(i * STEP, data.qpos.copy(), data.qvel.copy())
            mujoco.mj_step(self._model, data)
        return out


def _link(parent: Any, name: str, where: Transform, after: Transform, mass: Mass) -> Any:
    body = parent.add_body(name=name, pos=where.translation * METRES, quat=quaternion(where))
    body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0, 0, 1))
    _weight(body, after, mass)
    return body


def _weight(body: Any, frame: Transform, mass: Mass) -> None:
    """Mass and inertia, given in a frame of the body; the axes of the inertia are that frame's."""
    body.explicitinertial = True
    body.mass = mass.kg
    body.ipos = frame @ np.asarray(mass.centre) * METRES
    body.iquat = quaternion(frame)
    body.inertia = np.maximum(np.diag(mass.inertia) * METRES**2, _LEAST_INERTIA)


_LEAST_INERTIA = 1e-9  # kg m²: MuJoCo needs some
