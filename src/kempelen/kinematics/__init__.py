"""Arms: DH chains from parameter files, forward and inverse kinematics, tilt, drift, fit, dynamics.

Usable alone; millimetres, radians, seconds. Frame "robot": the arm's base, origin on its foot, z up.
"""

from kempelen.kinematics.arm import Arm, Body, Drift, Link, Mass
from kempelen.kinematics.arm_file import arm_names, load_arm
from kempelen.kinematics.batch import Solutions, inverse_batch
from kempelen.kinematics.chain import forward, frames, jacobian
from kempelen.kinematics.closed import BRANCHES, Branch, Solution, branches, inverse, inverse_pose
from kempelen.kinematics.tilt import MOST_TILT, Posture, Tilts, least_tilt, least_tilts, tilt_range, tilts

__all__ = [
    "BRANCHES",
    "MOST_TILT",
    "Arm",
    "Body",
    "Branch",
    "Drift",
    "Link",
    "Mass",
    "Posture",
    "Solution",
    "Solutions",
    "Tilts",
    "arm_names",
    "branches",
    "forward",
    "frames",
    "inverse",
    "inverse_batch",
    "inverse_pose",
    "jacobian",
    "least_tilt",
    "least_tilts",
    "load_arm",
    "tilt_range",
    "tilts",
]
