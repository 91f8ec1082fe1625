"""Arms: DH chains from parameter files, forward and inverse kinematics, tilt, drift, fit, dynamics.

Usable alone; millimetres, radians, seconds. Frame "robot": the arm's base, origin on its foot, z up. `fit` is
imported by name where an arm is calibrated: its optimiser takes longer to load than all the rest together.
"""

from kempelen.kinematics.arm import Arm, Body, Drift, Link, Mass
from kempelen.kinematics.arm_file import arm_names, load_arm
from kempelen.kinematics.batch import Solutions, inverse_batch
from kempelen.kinematics.chain import forward, frames, jacobian
from kempelen.kinematics.closed import BRANCHES, Branch, Solution, branches, inverse, inverse_pose
from kempelen.kinematics.differential import Singularity, joint_speeds, manipulability, singularities, tilt_of
from kempelen.kinematics.drift import Budget, JointErrors, Slack, Uncertainty, drift_budget, stop_loss
from kempelen.kinematics.dynamics import torques
from kempelen.kinematics.euler import matrix_from_zyz, zyz_from_matrix
from kempelen.kinematics.numeric import Search, inverse_numeric
from kempelen.kinematics.tilt import MOST_TILT, Posture, Tilts, least_tilt, least_tilts, tilt_range, tilts

__all__ = [
    "BRANCHES",
    "MOST_TILT",
    "Arm",
    "Body",
    "Branch",
    "Budget",
    "Drift",
    "JointErrors",
    "Link",
    "Mass",
    "Posture",
    "Search",
    "Singularity",
    "Slack",
    "Solution",
    "Solutions",
    "Tilts",
    "Uncertainty",
    "arm_names",
    "branches",
    "drift_budget",
    "forward",
    "frames",
    "inverse",
    "inverse_batch",
    "inverse_numeric",
    "inverse_pose",
    "jacobian",
    "joint_speeds",
    "least_tilt",
    "least_tilts",
    "load_arm",
    "manipulability",
    "matrix_from_zyz",
    "singularities",
    "stop_loss",
    "tilt_of",
    "tilt_range",
    "tilts",
    "torques",
    "zyz_from_matrix",
]
