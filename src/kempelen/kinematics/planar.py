"""Arms of the family base, shoulder, elbow, [pitch, [roll]] with parallel shoulder, elbow and pitch axes.

Such an arm is a planar chain in an upright plane that the base turns. With e_r the plane's outward direction
and t the one across it (t = z x e_r), all angles are counted from e_r towards up:

* A, the upper arm's: ``s2 q2 + A0``; B, the forearm's: ``s2 q2 + s3 q3 + B0``;
* T, the tilt of the approach vector from straight down, tip outwards: ``s2 q2 + s3 q3 + s4 q4 + T0``;
* the plane's azimuth ``q1 + F0`` and the roll ``s5 q5 + R0`` (the paper's ψ).

The signs, the angles at zero, the lengths and the lateral shift are read off the chain's own frames at zero,
so that twists of either sign, offsets and unequal links need no cases of their own.
"""

from functools import lru_cache
from math import hypot, pi
from typing import NamedTuple

import numpy as np

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.chain import frames

BASE_SHOULDER_ELBOW = 3
WITH_PITCH = 4
WITH_ROLL = 5
TURN = 2 * pi
_TOLERANCE = 1e-6
_ROUNDING = 1e-12


class Planar(NamedTuple):
    """The numbers of the module's text; lengths mm, angles rad.

    Attributes:
        n: Joints, 3 to 5; with 3 the forearm reaches to the tool point, and the tilt follows.
        shoulder: (radial, up) of the shoulder's axis.
        upper: Shoulder to elbow.
        lower: Elbow to wrist.
        signs: (s2, s3, s4, s5), each 1 or -1.
        zero: (F0, A0, B0, T0, R0).
        tool: (radial, up) from wrist to tool axis' end where the gripper points straight down.
        lateral: Of the roll axis, along t.
        offset: (x, y) of the tool point from the roll axis, in the tool's frame.
    """

    n: int
    shoulder: tuple[float, float]
    upper: float
    lower: float
    signs: tuple[float, float, float, float]
    zero: tuple[float, float, float, float, float]
    tool: tuple[float, float]
    lateral: float
    offset: tuple[float, float]


@lru_cache(maxsize=64)
def planar(arm: Arm) -> Planar | None:
    """The arm as a planar chain on a turning base; None where it is of another family."""
    at = frames(arm, np.zeros(arm.n))
    if not BASE_SHOULDER_ELBOW <= arm.n <= WITH_ROLL or not _of_the_family(arm, at):
        return None
    radial = at[1, :3, 0]
    across = np.cross([0.0, 0.0, 1.0], radial)
    plane = np.array([radial, [0.0, 0.0, 1.0]])
    signs = [-float(np.sign(at[k, :3, 2] @ across)) for k in (1, 2, 3)[: arm.n - 1]]
    points = [plane @ at[k, :3, 3] for k in (1, 2, 3)]
    # Each axis may be shifted along itself at will; only what lies in the plane counts
    tool_end, offset = _roll_axis(arm, at)
    end = plane @ tool_end
    wrist = points[2] if arm.n >= WITH_PITCH else end
    approach = at[-1, :3, 2]
    tilt = float(np.arctan2(approach @ radial, -approach[2]))
    c, s = np.cos(-tilt), np.sin(-tilt)
    tool = np.array([[c, -s], [s, c]]) @ (end - wrist)
    roll_sign = float(np.sign(at[4, :3, 2] @ approach)) if arm.n == WITH_ROLL else 1.0
    upper, lower = points[1] - points[0], wrist - points[1]
    return Planar(
        n=arm.n,
        shoulder=(float(points[0][0]), float(points[0][1])),
        upper=hypot(*upper),
        lower=hypot(*lower),
        signs=(signs[0], signs[1], signs[2] if arm.n >= WITH_PITCH else 1.0, roll_sign),
        zero=(
            float(np.arctan2(radial[1], radial[0])),
            float(np.arctan2(upper[1], upper[0])),
            float(np.arctan2(lower[1], lower[0])),
            tilt,
            _snapped(float(np.arctan2(across @ at[-1, :3, 0], across @ at[-1, :3, 1]))),
        ),
        tool=(_snapped(tool[0]), _snapped(tool[1])),
        lateral=_snapped(float(across @ tool_end)),
        offset=offset,
    )


def planar_or_error(arm: Arm) -> Planar:
    """As `planar`.

    Raises:
        MotionError: the arm is of another family.
    """
    found = planar(arm)
    if found is None:
        raise MotionError(
            f"Arm {arm.name} has no closed form: its shoulder, elbow and pitch are not parallel.",
            hint="Use kinematics.numeric, which needs a starting point and takes longer.",
        )
    return found


def _snapped(value: float) -> float:
    """Without the rounding of right angles, so that what is 0 costs nothing."""
    return 0.0 if abs(value) < _ROUNDING else float(value)


def _roll_axis(arm: Arm, at: Array) -> tuple[Array, tuple[float, float]]:
    """The point of the roll axis at the tool point's height, and how far the tool point is off it."""
    tip = at[-1, :3, 3]
    if arm.n < WITH_ROLL:
        return tip, (0.0, 0.0)
    axis, origin = at[4, :3, 2], at[4, :3, 3]
    foot = origin + axis * (axis @ (tip - origin))
    off = at[-1, :3, :3].T @ (tip - foot)
    if hypot(off[0], off[1]) < _TOLERANCE:
        return tip, (0.0, 0.0)
    return foot, (float(off[0]), float(off[1]))


def _of_the_family(arm: Arm, at: Array) -> bool:
    axes = at[:, :3, 2]
    across = axes[1]
    level = abs(across[2]) < _TOLERANCE and abs(at[1, :3, 0] @ across) < _TOLERANCE
    parallel = all(abs(abs(axes[k] @ across) - 1) < _TOLERANCE for k in range(1, min(arm.n, WITH_PITCH)))
    upright = arm.n < WITH_PITCH or abs(axes[-1] @ across) < _TOLERANCE
    if not (level and parallel and upright):
        return False
    if arm.n == WITH_ROLL and abs(abs(axes[4] @ axes[5]) - 1) > _TOLERANCE:
        return False
    lengths = np.linalg.norm(np.diff(at[1:4, :3, 3], axis=0), axis=-1)
    return bool((lengths > _TOLERANCE).all())
