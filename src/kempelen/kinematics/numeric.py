"""Inverse kinematics of any chain by damped least squares: for arms without a closed form, and as an oracle.

Levenberg and Marquardt on the pose error, joints kept within their ranges, begun again from seeded places
while it does not meet the pose.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import ReachError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.chain import forward, jacobian
from kempelen.kinematics.differential import pose_error

_LENGTH = 100.0  # mm that weigh as much as 1 rad
_STEPS = 100
_WORST_DAMPING = 1e8


@dataclass(frozen=True, slots=True)
class Search:
    """How hard to look.

    Attributes:
        starts: Places to begin from, the given one first.
        seed: Of the other ones.
        near_mm: A pose so near is met, mm.
        near_rad: And its direction, rad.
    """

    starts: int = 20
    seed: int = 0
    near_mm: float = 1e-6
    near_rad: float = 1e-8


def inverse_numeric(
    arm: Arm,
    pose: npt.ArrayLike,
    near: npt.ArrayLike | None = None,
    *,
    orientation: bool = True,
    search: Search | None = None,
) -> Array:
    """Joint angles within the ranges for a pose.

    Args:
        arm: Of any number of joints.
        pose: (4, 4) robot_from_tool.
        near: (n,) rad, where to begin; the middle of the ranges by default.
        orientation: Whether the tool's direction counts, too.
        search: How hard to look.

    Returns:
        (n,) rad.

    Raises:
        ReachError: it was not met from any start; the message says how near it came.
    """
    wanted, search = np.asarray(pose, dtype=np.float64), search or Search()
    rng = np.random.default_rng(search.seed)
    low, high = arm.ranges.T
    begin = arm.ranges.mean(axis=1) if near is None else np.asarray(near, dtype=np.float64)
    nearest = (np.inf, np.inf)
    for _ in range(search.starts):
        joints = _descend(arm, wanted, np.clip(begin, low, high), search, orientation=orientation)
        off = pose_error(wanted, forward(arm, joints))
        missed = float(np.linalg.norm(off[:3])), float(np.linalg.norm(off[3:])) if orientation else 0.0
        if missed[0] <= search.near_mm and missed[1] <= search.near_rad:
            return joints
        nearest = min(nearest, missed)
        begin = rng.uniform(low, high)
    x, y, z = wanted[:3, 3]
    raise ReachError(
        f"Arm {arm.name}: no joint angles within the ranges were found for ({x:.1f}, {y:.1f}, {z:.1f}) mm; "
        f"the nearest of {search.starts} tries misses it by {nearest[0]:.3g} mm and "
        f"{np.degrees(nearest[1]):.3g}°.",
        hint="Move the place, allow another direction of the gripper, or begin nearer to it.",
    )


def _descend(arm: Arm, wanted: Array, joints: Array, search: Search, *, orientation: bool) -> Array:
    rows = 6 if orientation else 3
    weight = np.array([1 / _LENGTH] * 3 + [1.0] * 3)[:rows]
    aim = min(search.near_mm / _LENGTH, search.near_rad) * 0.1
    damping = 1e-2
    off = pose_error(wanted, forward(arm, joints))[:rows] * weight
    for _ in range(_STEPS):
        if np.linalg.norm(off) <= aim or damping > _WORST_DAMPING:
            break
        lever = jacobian(arm, joints)[:rows] * weight[:, None]
        normal = lever.T @ lever
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), lever.T @ off)
        trial = np.clip(joints + step, *arm.ranges.T)
        missed = pose_error(wanted, forward(arm, trial))[:rows] * weight
        better = missed @ missed < off @ off
        if better:
            joints, off = trial, missed
        damping = max(damping * (0.1 if better else 10.0), 1e-14)
    return joints
