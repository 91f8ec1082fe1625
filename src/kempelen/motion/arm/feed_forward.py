"""Feed-forward for belts that give: the motors run ahead by what weight and inertia are going to stretch.

A stepper goes where it is told; the joint behind its belt does not. With a belt of stiffness k that passes on
the torque T, the joint is T/k behind its motor. T follows from the planned motion (recursive Newton-Euler),
so the motor is told the joint angle and e ahead of it, where k e + d e' = T with the belt's damping d.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm, Mass
from kempelen.kinematics.dynamics import mass_matrix, torques
from kempelen.motion.arm.synchrony import TimedPath


@dataclass(frozen=True, slots=True, eq=False)
class Belts:
    """What is between motors and joints.

    Attributes:
        stiffness: (n,) N m/rad.
        damping: (n,) N m s/rad.
    """

    stiffness: Array
    damping: Array

    @classmethod
    def ringing_at(cls, arm: Arm, hertz: Array, share: float) -> "Belts":
        """Belts with which each joint alone, the arm stretched out level, would ring at so many hertz.

        Args:
            arm: With masses.
            hertz: (n,) of each joint.
            share: Of critical damping.
        """
        stretched = np.clip(0.0, arm.ranges[:, 0], arm.ranges[:, 1])
        inertia = np.diag(mass_matrix(arm, stretched))
        circular = 2.0 * np.pi * np.asarray(hertz, dtype=np.float64)
        return cls(inertia * circular**2, 2.0 * share * inertia * circular)


def smooth(path: TimedPath) -> CubicSpline:
    """The planned motion between its vertices: twice differentiable, at rest at both ends."""
    return CubicSpline(path.times, path.joints, bc_type="clamped")


def run_ahead(
    arm: Arm, path: TimedPath, belts: Belts, *, load: Mass | None = None, moving: bool = True
) -> TimedPath:
    """What to tell the motors, as joint angles, for the joints to follow a path.

    Args:
        arm: With masses.
        path: Wanted, of the joints.
        belts: Between motors and joints.
        load: In the gripper, in the tool's frame.
        moving: Also against inertia; otherwise against weight alone.

    Returns:
        The same times, other angles. At rest they differ from the wanted ones by what weight stretches.

    Raises:
        MotionError: the arm's parameter file gives no masses.
    """
    motion = smooth(path)
    lag = belts.damping / belts.stiffness
    speeds, rates = motion(path.times, 1), motion(path.times, 2)
    share = 1.0 if moving else 0.0
    torque = torques(arm, path.joints, share * speeds, share * rates, load=load)
    stretch = CubicSpline(path.times, torque / belts.stiffness)
    ahead = stretch(path.times) - lag * stretch(path.times, 1) * share
    return TimedPath(path.joints + ahead, path.times)
