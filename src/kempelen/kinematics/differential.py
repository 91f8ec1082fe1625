"""Small motions: joint speeds for a motion of the tool point, how well the arm can move, where it cannot."""

from math import degrees, hypot
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.chain import checked_joints, forward, frames, jacobian
from kempelen.kinematics.planar import WITH_PITCH, WITH_ROLL, planar

POSITION = 3
"""Rows of the Jacobian that move the tool point; the other three turn it."""

NEAR_AXIS = 5.0
"""So near to the base's axis the arm cannot move sideways any more, mm."""

NEAR_STRETCH = float(np.radians(2.0))
"""So near to straight or folded the elbow cannot move the wrist to and fro any more, rad."""

NEAR_UPRIGHT = float(np.radians(0.1))
"""So near to the upright base and roll axis are one direction, rad."""

_LENGTH = 100.0  # mm that weigh as much as 1 rad
_DAMPING = 0.05
_ENOUGH = 0.1


class Singularity(NamedTuple):
    """A posture in which some motion is lost.

    Attributes:
        name: shoulder, elbow, wrist, or chain where the arm is of no family with names.
        told: What is lost, and how near it is.
        blocks: Whether the tool point itself cannot move some way; else only turning it is ambiguous.
    """

    name: str
    told: str
    blocks: bool


def manipulability(arm: Arm, joints: npt.ArrayLike) -> Array:
    """Yoshikawa's measure for the tool point: volume of the velocities that unit joint speeds can reach.

    Args:
        arm: The arm.
        joints: (..., n) rad.

    Returns:
        (...) mm³, sqrt(det(J Jᵀ)) of the Jacobian's position rows; 0 where a direction is lost.
    """
    lever = jacobian(arm, joints)[..., :POSITION, :]
    return np.asarray(np.sqrt(np.maximum(np.linalg.det(lever @ lever.swapaxes(-1, -2)), 0.0)))


def singularities(arm: Arm, joints: npt.ArrayLike) -> list[Singularity]:
    """Which singularities a posture (n,) rad is at or near; none for an ordinary one."""
    joints = checked_joints(arm, joints).reshape(arm.n)
    shape = planar(arm)
    if shape is None:
        return _chain(arm, joints)
    at = frames(arm, joints)
    found = []
    x, y = at[-1, :2, 3]
    away = hypot(x, y)
    if away - abs(shape.lateral) < NEAR_AXIS:
        told = f"the tool point is {away:.1f} mm from the base's axis: turning the base does not move it"
        found.append(Singularity("shoulder", told, blocks=True))
    s3, (_, a0, b0, _, _) = shape.signs[1], shape.zero
    bend = abs(np.remainder(s3 * joints[2] + b0 - a0 + np.pi, 2 * np.pi) - np.pi)
    if min(bend, np.pi - bend) < NEAR_STRETCH:
        how = "straight" if bend < 1 else "folded"
        off = degrees(min(bend, np.pi - bend))
        told = f"the elbow is {off:.2f}° from {how}: the wrist cannot move along the line to the shoulder"
        found.append(Singularity("elbow", told, blocks=True))
    if arm.n == WITH_ROLL and hypot(*at[-1, :2, 2]) < NEAR_UPRIGHT:
        told = "the gripper is upright: base and roll turn it about the same direction (the paper's Φ and ψ)"
        found.append(Singularity("wrist", told, blocks=False))
    return found


def joint_speeds(
    arm: Arm,
    joints: npt.ArrayLike,
    twist: npt.ArrayLike,
    *,
    damping: float = _DAMPING,
    weights: npt.ArrayLike | None = None,
) -> Array:
    """Joint speeds for a wanted motion of the tool, least squares, damped near singular postures.

    Nakamura and Hanafusa: the damping grows as the smallest singular value of the weighted Jacobian falls
    below a tenth of a radian's worth, so that joint speeds stay bounded and what cannot be done is left
    undone.

    Args:
        arm: The arm.
        joints: (n,) rad.
        twist: (6,) mm/s of the tool point and rad/s, or (3,) for the tool point alone, in the robot's frame.
        damping: At a singularity; 0 for the plain pseudo-inverse.
        weights: (n,) relative cost of moving each joint; 1 each by default.

    Returns:
        (n,) rad/s.
    """
    wanted = np.asarray(twist, dtype=np.float64)
    lever = jacobian(arm, checked_joints(arm, joints).reshape(arm.n))[: len(wanted)].copy()
    lever[:POSITION] /= _LENGTH
    scaled = wanted.copy()
    scaled[:POSITION] /= _LENGTH
    cost = np.ones(arm.n) if weights is None else np.asarray(weights, dtype=np.float64)
    left, sizes, right = np.linalg.svd(lever / cost, full_matrices=False)
    # A five-joint arm has no sixth direction at all: only the directions it could have count as lost
    able = sizes[: min(len(sizes), arm.n, len(wanted))]
    square = damping**2 * max(0.0, 1 - (float(able[-1]) / _ENOUGH) ** 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        gains = np.where(sizes > _NOTHING, sizes / (sizes**2 + square), 0.0)
    return np.asarray(right.T @ (gains * (left.T @ scaled)) / cost)


_NOTHING = 1e-12


def pose_error(wanted: Array, found: Array) -> Array:
    """(..., 6) from one pose (..., 4, 4) to another: mm, and the rotation vector in rad."""
    turn = wanted[..., :3, :3] @ found[..., :3, :3].swapaxes(-1, -2)
    axis = 0.5 * np.stack(
        [
            turn[..., 2, 1] - turn[..., 1, 2],
            turn[..., 0, 2] - turn[..., 2, 0],
            turn[..., 1, 0] - turn[..., 0, 1],
        ],
        axis=-1,
    )
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    angle = np.arctan2(sine, 0.5 * (np.trace(turn, axis1=-2, axis2=-1)[..., None] - 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.where(sine > _NOTHING, axis * (angle / sine), axis)
    return np.concatenate([wanted[..., :3, 3] - found[..., :3, 3], turned], axis=-1)


def tilt_of(arm: Arm, joints: npt.ArrayLike) -> Array:
    """Tilt of the gripper from straight down, rad, tip outwards positive, of joints (..., n)."""
    shape = planar(arm)
    joints = checked_joints(arm, joints)
    if shape is not None and arm.n >= WITH_PITCH:
        s2, s3, s4, _ = shape.signs
        total = s2 * joints[..., 1] + s3 * joints[..., 2] + s4 * joints[..., 3] + shape.zero[3]
        return np.asarray(np.remainder(total + np.pi, 2 * np.pi) - np.pi)
    approach = forward(arm, joints)[..., :3, 2]
    return np.asarray(np.arccos(np.clip(-approach[..., 2], -1.0, 1.0)))


def _chain(arm: Arm, joints: Array) -> list[Singularity]:
    lever = jacobian(arm, joints)
    lever[:POSITION] /= _LENGTH
    sizes = np.linalg.svd(lever, compute_uv=False)
    if sizes[min(arm.n, 6) - 1] > np.sin(NEAR_STRETCH):
        return []
    blocked = np.linalg.svd(lever[:POSITION], compute_uv=False)[-1] <= np.sin(NEAR_STRETCH)
    return [Singularity("chain", f"one direction is lost (singular value {sizes[-1]:.2g})", bool(blocked))]
