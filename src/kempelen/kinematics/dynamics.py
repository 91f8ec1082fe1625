"""Torques for a motion: the recursive Newton-Euler method (Luh, Walker, Paul) on all samples at once.

Inside the recursion lengths are metres, so that torques come out in newton metres.
"""

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm, Mass
from kempelen.kinematics.chain import checked_joints, frames

GRAVITY = 9.81
"""m/s², downwards."""

_M = 1e-3  # metres in a millimetre


def torques(
    arm: Arm,
    joints: npt.ArrayLike,
    speeds: npt.ArrayLike | None = None,
    accelerations: npt.ArrayLike | None = None,
    *,
    gravity: float = GRAVITY,
    load: Mass | None = None,
) -> Array:
    """Torque of each joint for a motion (inverse dynamics).

    Args:
        arm: With masses.
        joints: (..., n) rad.
        speeds: (..., n) rad/s; at rest by default.
        accelerations: (..., n) rad/s²; none by default.
        gravity: m/s².
        load: What the gripper holds, in the tool's frame.

    Returns:
        (..., n) N m about each joint's axis.

    Raises:
        MotionError: the arm's parameter file gives no masses, or shapes are wrong.
    """
    masses = _masses(arm, load)
    joints = checked_joints(arm, joints)
    still = np.zeros_like(joints)
    speeds = still if speeds is None else checked_joints(arm, speeds) + still
    pushes = still if accelerations is None else checked_joints(arm, accelerations) + still
    at = frames(arm, joints)
    forces, moments = _outwards(at, masses, speeds, pushes, gravity)
    return _inwards(at, forces, moments)


def mass_matrix(arm: Arm, joints: npt.ArrayLike) -> Array:
    """(n, n) kg m² at (n,) rad: torque of each joint per acceleration of each joint."""
    joints = checked_joints(arm, joints).reshape(arm.n)
    every = np.tile(joints, (arm.n, 1))
    return torques(arm, every, None, np.eye(arm.n), gravity=0.0).T


def accelerations_of(
    arm: Arm, joints: npt.ArrayLike, speeds: npt.ArrayLike, torque: npt.ArrayLike, *, gravity: float = GRAVITY
) -> Array:
    """Forward dynamics at one instant: (n,) rad/s² from (n,) rad, rad/s and N m."""
    bias = torques(arm, joints, speeds, gravity=gravity)
    return np.asarray(np.linalg.solve(mass_matrix(arm, joints), np.asarray(torque, dtype=np.float64) - bias))


def _masses(arm: Arm, load: Mass | None) -> list[Mass]:
    if not arm.masses:
        raise MotionError(
            f"Arm {arm.name} has no masses in its parameter file, so that no torques are known.",
            hint="Give every joint a mass: { kg, centre_mm, inertia_kg_mm2 }.",
        )
    masses = list(arm.masses)
    if load is not None:
        masses[-1] = _together(masses[-1], load)
    return masses


def _together(one: Mass, other: Mass) -> Mass:
    """Two bodies in the same frame as one (parallel axes)."""
    kg = one.kg + other.kg
    centre = (one.kg * np.asarray(one.centre) + other.kg * np.asarray(other.centre)) / kg
    inertia = np.zeros((3, 3))
    for part in (one, other):
        arm = np.asarray(part.centre) - centre
        inertia += part.inertia + part.kg * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Mass(kg, centre, inertia)


def _outwards(
    at: Array, masses: list[Mass], speeds: Array, pushes: Array, gravity: float
) -> tuple[list[tuple[Array, Array]], list[Array]]:
    """Base to tip: of each link the force on its centre with that centre, m, and the moment."""
    shape = (*speeds.shape[:-1], 3)
    turn, spin = np.zeros(shape), np.zeros(shape)
    lift = np.zeros(shape)
    lift[..., 2] = gravity  # as if the base rose: gravity for all links at once
    forces, moments = [], []
    for number, mass in enumerate(masses):
        axis, origin = at[..., number, :3, 2], at[..., number, :3, 3] * _M
        link, rotation = at[..., number + 1, :3, 3] * _M, at[..., number + 1, :3, :3]
        speed, push = speeds[..., number, None] * axis, pushes[..., number, None] * axis
        spin = spin + push + np.cross(turn, speed)
        turn = turn + speed
        centre = link + rotation @ (np.asarray(mass.centre) * _M)
        along = lift + _swung(turn, spin, centre - origin)
        inertia = rotation @ (mass.inertia * _M**2) @ rotation.swapaxes(-1, -2)
        forces.append((mass.kg * along, centre))
        moments.append(_times(inertia, spin) + np.cross(turn, _times(inertia, turn)))
        lift = lift + _swung(turn, spin, link - origin)
    return forces, moments


def _inwards(at: Array, forces: list[tuple[Array, Array]], moments: list[Array]) -> Array:
    """Tip to base: what each joint has to hold, about its axis."""
    torque = np.empty((*at.shape[:-3], len(forces)))
    force, moment = np.zeros_like(moments[0]), np.zeros_like(moments[0])
    below = at[..., -1, :3, 3] * _M
    for number in reversed(range(len(forces))):
        origin = at[..., number, :3, 3] * _M
        mine, centre = forces[number]
        moment = moment + np.cross(below - origin, force) + np.cross(centre - origin, mine) + moments[number]
        force, below = force + mine, origin
        torque[..., number] = (moment * at[..., number, :3, 2]).sum(axis=-1)
    return torque


def _swung(turn: Array, spin: Array, arm: Array) -> Array:
    return np.cross(spin, arm) + np.cross(turn, np.cross(turn, arm))


def _times(matrix: Array, vector: Array) -> Array:
    return (matrix @ vector[..., None])[..., 0]
