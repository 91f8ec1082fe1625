"""From joint angles to poses: forward kinematics and the geometric Jacobian of any chain."""

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm, Link


def forward(arm: Arm, joints: npt.ArrayLike) -> Array:
    """Where the tool point is.

    Args:
        arm: The arm.
        joints: (..., n) rad.

    Returns:
        (..., 4, 4) robot_from_tool, mm; the third column is the approach vector.

    Raises:
        MotionError: the last axis has not n numbers, or one is not finite.
    """
    return frames(arm, joints)[..., -1, :, :]


def frames(arm: Arm, joints: npt.ArrayLike) -> Array:
    """Where every link is.

    Args:
        arm: The arm.
        joints: (..., n) rad.

    Returns:
        (..., n + 1, 4, 4): robot_from_link, mm: the base's own frame (identity), then the one after each
        joint (standard DH; paper, forward kinematics); the last one is the tool's.

    Raises:
        MotionError: the last axis has not n numbers, or one is not finite.
    """
    joints = checked_joints(arm, joints)
    out = np.empty((*joints.shape[:-1], arm.n + 1, 4, 4))
    out[..., 0, :, :] = np.eye(4)
    for number, link in enumerate(arm.links):
        out[..., number + 1, :, :] = out[..., number, :, :] @ _link_matrix(link, joints[..., number])
    if arm.tool is not None:
        out[..., -1, :, :] = out[..., -1, :, :] @ _link_matrix(arm.tool, np.zeros(()))
    return out


def jacobian(arm: Arm, joints: npt.ArrayLike) -> Array:
    """How fast the tool point moves and turns with each joint, in the robot's frame.

    Args:
        arm: The arm.
        joints: (..., n) rad.

    Returns:
        (..., 6, n): rows 0 to 2 mm/rad of the tool point, rows 3 to 5 rad/rad (column i: z_i x (p - o_i)
        over z_i).

    Raises:
        MotionError: the last axis has not n numbers, or one is not finite.
    """
    at = frames(arm, joints)
    axes = at[..., :-1, :3, 2]
    arms = at[..., -1:, :3, 3] - at[..., :-1, :3, 3]
    return np.concatenate([np.cross(axes, arms), axes], axis=-1).swapaxes(-1, -2)


def checked_joints(arm: Arm, joints: npt.ArrayLike) -> Array:
    """Joint angles as an array (..., n).

    Raises:
        MotionError: the last axis has not n numbers, or one is not finite.
    """
    array = np.asarray(joints, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != arm.n:
        raise MotionError(
            f"Arm {arm.name} has {arm.n} joints; angles of shape {array.shape} were given.",
            hint=f"The last axis needs {arm.n} numbers, rad.",
        )
    if not np.isfinite(array).all():
        raise MotionError(f"Arm {arm.name}: a joint angle is not finite.", hint="Check where it comes from.")
    return array


def _link_matrix(link: Link, angle: Array) -> Array:
    """(..., 4, 4) of one row of the DH table."""
    c, s = np.cos(angle + link.offset), np.sin(angle + link.offset)
    ca, sa = float(np.cos(link.alpha)), float(np.sin(link.alpha))
    out = np.zeros((*angle.shape, 4, 4))
    out[..., 0, 0], out[..., 0, 1], out[..., 0, 2], out[..., 0, 3] = c, -s * ca, s * sa, link.a * c
    out[..., 1, 0], out[..., 1, 1], out[..., 1, 2], out[..., 1, 3] = s, c * ca, -c * sa, link.a * s
    out[..., 2, 1], out[..., 2, 2], out[..., 2, 3] = sa, ca, link.d
    out[..., 3, 3] = 1.0
    return out
