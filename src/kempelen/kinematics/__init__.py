"""Arms: DH chains from parameter files, forward and inverse kinematics, tilt, drift, fit, dynamics.

Usable alone; millimetres, radians, seconds. Frame "robot": the arm's base, origin on its foot, z up.
"""

from kempelen.kinematics.arm import Arm, Body, Drift, Link, Mass
from kempelen.kinematics.arm_file import arm_names, load_arm
from kempelen.kinematics.batch import Solutions, inverse_batch
from kempelen.kinematics.chain import forward, frames, jacobian
from kempelen.kinematics.closed import BRANCHES, Branch, Solution, branches, inverse, inverse_pose
from kempelen.kinematics.drift import Budget, JointErrors, Uncertainty, drift_budget, stop_loss
from kempelen.kinematics.fit import ArmFit, Priors, fit_arm
from kempelen.kinematics.tilt import MOST_TILT, Posture, Tilts, least_tilt, least_tilts, tilt_range, tilts

__all__ = [
    "BRANCHES",
    "MOST_TILT",
    "Arm",
    "ArmFit",
    "Body",
    "Branch",
    "Budget",
    "Drift",
    "JointErrors",
    "Link",
    "Mass",
    "Posture",
    "Priors",
    "Solution",
    "Solutions",
    "Tilts",
    "Uncertainty",
    "arm_names",
    "branches",
    "drift_budget",
    "fit_arm",
    "forward",
    "frames",
    "inverse",
    "inverse_batch",
    "inverse_pose",
    "jacobian",
    "least_tilt",
    "least_tilts",
    "load_arm",
    "stop_loss",
    "tilt_range",
    "tilts",
]
