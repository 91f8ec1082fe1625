"""MuJoCo bodies of the hand that every machine has: a palm and two notched fingers.

The fingers are driven by a spring of limited force and coupled to each other, as by a rack and pinion: they
stay symmetric about the tool point. Each pad is a V notch of ±45°, which pulls a round stem to the tool
point because the friction coefficient is below tan 45°: at 1.2 the notch would hold it where it first
touches. Opposite blades are interleaved like combs, so that they may pass each other on a thin stem.

The pads of a hand that tilts hang on pivots along the closing axis, their weight below: they are plumb
whatever the tilt, and so is the piece between them. Rigid notches would lean a stem over to their own tilt.
"""

import math
from dataclasses import dataclass
from typing import Any, Self

import mujoco
import numpy as np

from kempelen.core.errors import FitError
from kempelen.core.table import Gripper
from kempelen.twin.physics.bodies import Touch
from kempelen.twin.physics.units import METRES

FINGERS = ("left", "right")
PIVOTS = ("left_pivot", "right_pivot")
"""Joints of pads that hang: 0 in line with the finger."""
FINGER_MASS = 0.15
"""kg"""
FINGER_GAIN = 400.0
"""Force per lack of speed, up to the grip force, N s/m."""
GRIP_FORCE = 6.0
"""Of each finger, N."""
CLOSE_SPEED = 0.1
"""Of each finger, m/s."""
OPEN_SPEED = 0.2
"""Of each finger, m/s."""
PAD_FRICTION = 0.6
PAD_ABOVE = 3.0
"""How far the pads reach above the tool point, mm: short, to leave room for the head over a pawn's neck."""
BLADE = 2.0
"""Thickness of the notch's blades, mm."""
PALM_HEIGHT = 30.0
SHANK_GAP = 0.7
"""From the open notch's apex back to the shank, mm: room for the head above the grip."""
THINNEST_SHANK = 1.0
PAD_MASS = 0.006
"""Of a pad that hangs, kg."""
PAD_WEIGHT_BELOW = 2.5
"""From the pivot down to its centre of mass, mm."""
PIVOT_DAMPING = 4e-5
"""Of the pivot's grease, N m s/rad: a hanging pawn comes to rest within two swings."""
PIVOT_INERTIA = 1e-6
"""Of a pad about its pivot, kg m²."""
PIVOT_STOP = 60.0
"""A pad turns as far, degrees, as MjSpec wants them."""
TRUNCATION = 2.0
"""The blades begin this far from the notch's centre line, mm."""


@dataclass(frozen=True)
class Jaw:
    """Sizes of the notched fingers, mm.

    The frame of the hand has the tool point for its origin and z towards the palm.

    Attributes:
        apex_open: From the tool point to where the open notch's two faces would meet.
        half_width: Of the notch, across the closing axis.
        outside_open: From the tool point to the outside of the open finger.
        below: The pads' reach below the tool point.
        length: From the tool point to the palm.
        palm_radius: Of the palm.
        angle: Of the closing axis from the x axis of what carries the hand, rad.
    """

    apex_open: float
    half_width: float
    outside_open: float
    below: float
    length: float
    palm_radius: float
    angle: float

    @classmethod
    def of(cls, gripper: Gripper) -> Self:
        """The jaw that lets a round head of the width of the gripper's opening pass.

        Raises:
            FitError: the fingers are too thin to hold a notch of that opening.
        """
        apex = _apex(gripper.opening / 2, gripper.finger_width / 2)
        least = apex - gripper.opening / 2 + SHANK_GAP + THINNEST_SHANK
        if gripper.finger_thickness < least:
            raise FitError(
                f"The gripper's fingers are {gripper.finger_thickness} mm thick; a notch that opens to "
                f"{gripper.opening} mm needs {least:.1f} mm.",
                hint="Set the gripper's finger_thickness in the configuration.",
            )
        return cls(
            apex_open=apex,
            half_width=gripper.finger_width / 2,
            outside_open=gripper.half_length_open,
            below=gripper.below_tool,
            length=gripper.finger_length,
            palm_radius=gripper.palm_radius,
            angle=gripper.closing_axis,
        )

    @property
    def free_radius(self) -> float:
        """Of the round passage between the open fingers, mm."""
        corner = math.hypot(self.apex_open - self.half_width, self.half_width)
        if self.half_width < self.apex_open / 2:
            return corner
        return min(self.apex_open / math.sqrt(2), corner)

    @property
    def stroke(self) -> float:
        """Travel of each finger from open to closed on nothing, mm."""
        return self.apex_open - 4.0


def _apex(radius: float, half_width: float) -> float:
    """From the tool point to the apex of notches that leave a round passage, mm.

    A wide notch leaves it between its faces, a narrow one between its corners.
    """
    if half_width * math.sqrt(2) >= radius:
        return radius * math.sqrt(2)
    return half_width + math.sqrt(radius**2 - half_width**2)


def add_gripper(spec: Any, parent: Any, jaw: Jaw, *, plumb: bool = False) -> None:
    """Palm and fingers.

    Args:
        spec: MjSpec to add to.
        parent: Body whose frame has the tool point for its origin and z towards the palm.
        jaw: Sizes.
        plumb: Whether the pads hang on pivots.
    """
    hand = parent.add_body(name="hand", quat=(math.cos(jaw.angle / 2), 0, 0, math.sin(jaw.angle / 2)))
    hand.add_geom(
        name="palm", type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=np.array([jaw.palm_radius, PALM_HEIGHT / 2, 0]) * METRES,
        pos=np.array([0, 0, jaw.length + PALM_HEIGHT / 2]) * METRES, **_metal(),
    )  # fmt: skip
    for name, side in zip(FINGERS, (-1, 1), strict=True):
        finger = _add_finger(spec, hand, name, side, jaw)
        _add_notch(_hung(finger, name) if plumb else finger, side, jaw)
    spec.add_equality(
        name="rack", type=mujoco.mjtEq.mjEQ_JOINT, name1="left", name2="right",
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        data=[0, 1] + [0] * 10, solref=(0.004, 1.0), solimp=(0.98, 0.999, 0.001, 0.5, 2),
    )  # fmt: skip


def _servo(spec: Any, joint: str, gain: float, force: float = 0.0) -> None:
    actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    actuator.gainprm = [gain] + [0] * 9
    actuator.biasprm = [0, 0, -gain] + [0] * 7
    if force:
        actuator.forcelimited = True
        actuator.forcerange = (-force, force)


def _metal() -> dict[str, Any]:
    return {
        "contype": int(Touch.GRIPPER), "conaffinity": 0, "rgba": (0.75, 0.76, 0.78, 1.0), "mass": 0.0,
        "friction": (0.2, 0.005, 0.0001), "condim": 3,
    }  # fmt: skip


def _add_finger(spec: Any, hand: Any, name: str, side: int, jaw: Jaw) -> Any:
    """A finger on the -x (side -1) or +x side of the hand; its joint is 0 when open and grows in closing."""
    finger = hand.add_body(name=name, gravcomp=1.0)
    finger.explicitinertial = True
    finger.mass = FINGER_MASS
    finger.inertia = (1e-5, 1e-5, 1e-5)
    finger.add_joint(
        name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(-float(side), 0, 0), limited=True,
        range=(0.0, jaw.stroke * METRES), solref_limit=(0.004, 1.0),
    )  # fmt: skip
    _servo(spec, name, FINGER_GAIN, GRIP_FORCE)
    inner = jaw.apex_open + SHANK_GAP
    middle, half = (inner + jaw.outside_open) / 2, (jaw.outside_open - inner) / 2
    finger.add_geom(
        name=f"{name}_shank", type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=np.array([side * middle, 0, (jaw.length - jaw.below) / 2]) * METRES,
        size=np.array([half, 5.0, (jaw.length + jaw.below) / 2]) * METRES, **_metal(),
    )  # fmt: skip

    return finger


def _hung(finger: Any, name: str) -> Any:
    """A body for the pad that turns about the closing axis at the tool point's height."""
    pad = finger.add_body(name=f"{name}_pad")
    pad.explicitinertial = True
    pad.mass = PAD_MASS
    pad.ipos = (0.0, 0.0, -PAD_WEIGHT_BELOW * METRES)
    pad.inertia = (1e-7, 1e-7, 1e-7)
    pad.add_joint(
        name=f"{name}_pivot", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(1, 0, 0), damping=PIVOT_DAMPING,
        armature=PIVOT_INERTIA, limited=True, range=(-PIVOT_STOP, PIVOT_STOP),
    )  # fmt: skip
    return pad


def _add_notch(pad: Any, side: int, jaw: Jaw) -> None:
    for across in (-1, 1):
        _add_blade(pad, side, across, jaw)


def _add_blade(finger: Any, side: int, across: int, jaw: Jaw) -> None:
    """One face of a notch: from the truncated apex to the finger's edge, at 45° to the closing axis."""
    length = (jaw.half_width - TRUNCATION) * math.sqrt(2)
    y = (jaw.half_width + TRUNCATION) / 2
    # Behind the middle of the face by half the blade's thickness, along the face's normal (-1, -1)/sqrt 2.
    back = BLADE / 2 / math.sqrt(2)
    position = np.array([side * (jaw.apex_open - y + back), across * (y + back), (PAD_ABOVE - jaw.below) / 2])
    turn = -side * across * math.pi / 4
    finger.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=position * METRES,
        quat=(math.cos(turn / 2), 0, 0, math.sin(turn / 2)),
        size=np.array([length / 2, BLADE / 2, (PAD_ABOVE + jaw.below) / 2]) * METRES,
        contype=Touch.GRIPPER, conaffinity=0, priority=1, condim=3, rgba=(0.15, 0.15, 0.17, 1.0), mass=0.0,
        friction=(PAD_FRICTION, 0.005, 0.0001), solref=(0.004, 1.0), solimp=(0.98, 0.995, 0.001, 0.5, 2),
    )  # fmt: skip
