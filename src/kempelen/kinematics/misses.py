"""What is said of a pose that an arm cannot take: by how many millimetres or degrees it misses it."""

from collections.abc import Sequence
from math import cos, degrees, hypot, sin, sqrt

from kempelen.core.errors import ReachError
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.planar import TURN, WITH_PITCH, Planar

_NEARER = "Allow more tilt, or move the place; kempelen arm place tells where a board fits."
_TURNS = (0.0, TURN, -TURN)


def unreached(
    arm: Arm,
    planar: Planar,
    position: tuple[float, float, float],
    tilt: float,
    known: Sequence[tuple[object, Sequence[float]]],
) -> ReachError:
    """By how much.

    Args:
        arm: The arm.
        planar: Its numbers.
        position: mm.
        tilt: rad.
        known: Branches with angles that would do, were it not for the ranges.

    Returns:
        An error that tells the mm of reach that lack, else the degrees of the joint nearest to allowing it.
    """
    x, y, z = position
    told = f"Arm {arm.name} cannot take the tool point to ({x:.1f}, {y:.1f}, {z:.1f}) mm"
    if arm.n >= WITH_PITCH:
        told += f" with the gripper tilted {degrees(tilt):.1f}°"
    if not known:
        return ReachError(f"{told}: {_missed(planar, position, tilt)}.", hint=_NEARER)
    (excess, joint, angle), branch = min(
        ((_worst(arm, angles), branch) for branch, angles in known), key=lambda one: one[0]
    )
    low, high = (degrees(one) for one in arm.ranges[joint])
    return ReachError(
        f"{told}: its {arm.joint_names[joint]} would have to stand at {degrees(angle):.1f}°, "
        f"{degrees(excess):.1f}° outside its range {low:.0f}° to {high:.0f}° ({branch}).",
        hint=_NEARER,
    )


def _worst(arm: Arm, angles: Sequence[float]) -> tuple[float, int, float]:
    """The joint farthest outside its range: by how much, which, its angle in the turn that is least so."""
    worst = (-1.0, 0, 0.0)
    for joint, (angle, (low, high)) in enumerate(zip(angles, arm.ranges.tolist(), strict=False)):
        excess, best = min((max(low - one, one - high, 0.0), one) for one in (angle + k for k in _TURNS))
        worst = max(worst, (excess, joint, best))
    return worst


def _missed(planar: Planar, position: tuple[float, float, float], tilt: float) -> str:
    """How far the wrist would be from where links can bring it."""
    x, y, z = position
    square = x * x + y * y - planar.lateral**2
    if square < 0:
        return f"it is {abs(planar.lateral) - hypot(x, y):.1f} mm too near to the base's axis"
    (tool_r, tool_z), c, s = planar.tool, cos(tilt), sin(tilt)
    r = sqrt(square) - planar.shoulder[0] - c * tool_r + s * tool_z
    up = z - planar.shoulder[1] - s * tool_r - c * tool_z
    distance, most, least = hypot(r, up), planar.upper + planar.lower, abs(planar.upper - planar.lower)
    if distance > most:
        return f"the wrist would be {distance - most:.1f} mm beyond the {most:.0f} mm that the links reach"
    return f"the wrist would be {least - distance:.1f} mm nearer to the shoulder than the links allow"
