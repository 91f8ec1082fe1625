"""MuJoCo bodies of an arm: a chain of hinges by Denavit and Hartenberg that carries the hand.

The hinges, like geared steppers, go where they are told: their rotors are so heavy that no piece holds them
up, and their speed is set from outside. Links strike pieces as the capsules of the arm's parameter file.
"""

import math
from collections.abc import Sequence
from itertools import accumulate
from typing import Any

import mujoco
import numpy as np

from kempelen.core.geometry import Array, Transform
from kempelen.core.pieces import PieceShape
from kempelen.core.table import Gripper
from kempelen.kinematics import Arm, Link, forward
from kempelen.twin.physics.appearance import HIDDEN
from kempelen.twin.physics.arm_clearance import ArmClearance
from kempelen.twin.physics.arm_look import paint_arm
from kempelen.twin.physics.bodies import Touch, quaternion
from kempelen.twin.physics.gripper import PALM_HEIGHT, Jaw, add_gripper
from kempelen.twin.physics.scene import Scene, StandingArm
from kempelen.twin.physics.units import METRES

ROTOR = 1000.0
"""Inertia of each motor behind its gear, kg m²: what a piece pushes back does not move the machine."""
TOOL = "tool"
"""Site at the tool point, z the approach vector."""
_LINK_MASS = 0.5
"""kg: it only has to be there, the rotors outweigh it."""
_HAND_FROM_TOOL = np.diag([-1.0, 1.0, -1.0])
"""The hand's z runs from the tool point to the palm, against the approach vector."""


class ArmBody:
    """Hinges named as the arm's joints; joint values are its angles, rad.

    Args:
        standing: The arm as it truly is, and where it stands.
        gripper: What it holds pieces with; ``closing_axis`` counts from the tool frame's y axis.
    """

    scale = 1.0
    fastest = 20.0
    standstill = 1e-6
    stall = 25.0
    unit = "rad"

    def __init__(self, standing: StandingArm, gripper: Gripper) -> None:
        self.joints = standing.arm.joint_names
        self._arm, self._base = standing.arm, standing.robot_from_base
        self._jaw = Jaw.of(gripper.model_copy(update={"closing_axis": gripper.closing_axis + math.pi / 2}))
        self._plumb = gripper.plumb
        self._hand_from_tool = _HAND_FROM_TOOL @ Transform.about_z(self._jaw.angle).rotation
        self._levers = _levers(self._arm, self._jaw)

    @property
    def start(self) -> Array:
        """(n,) rad: where homing ends."""
        return self._arm.home

    @property
    def parked(self) -> Array:
        """(n,) rad: the same, turned aside."""
        aside = np.clip(self._arm.home[0] - math.pi / 2, *self._arm.ranges[0])
        return np.array([aside, *self._arm.home[1:]])

    def tool(self, joints: Array) -> Array:
        """(3,) mm: the tool point, robot frame."""
        return self._base @ forward(self._arm, joints)[:3, 3]

    def pads(self, joints: Array) -> float:
        """rad: how far the pads hang from the fingers' line."""
        if not self._plumb:
            return 0.0
        tool = self._base.rotation @ forward(self._arm, joints)[:3, :3]
        _, across, along = (tool @ self._hand_from_tool).T @ np.array([0.0, 0.0, 1.0])
        return math.atan2(-across, along)

    def sweep(self, way: Array) -> float:
        """mm: what no point of the arm goes farther than when its joints go by ``way``."""
        return float(np.abs(way) @ self._levers)

    def clearance(self, shapes: Sequence[PieceShape]) -> ArmClearance:
        """How far the whole arm is from such pieces."""
        return ArmClearance(self._arm, self._base, self._jaw, shapes)

    def build(self, spec: Any, scene: Scene) -> None:
        """Add base, links and hand to an MjSpec."""
        del scene  # it needs nothing of the table
        base = spec.worldbody.add_body(
            name="arm", pos=self._base.translation * METRES, quat=quaternion(self._base)
        )
        bodies, after = [base], [Transform.identity()]
        for name, link in zip(self.joints, self._arm.links, strict=True):
            bodies.append(_add_link(bodies[-1], name, after[-1] @ Transform.about_z(link.offset)))
            after.append(frame_after(link))
        self._add_capsules(bodies, after)
        paint_arm(self._arm, bodies, after)
        hand = Transform(after[-1].rotation @ _HAND_FROM_TOOL, after[-1].translation)
        bodies[-1].add_site(name=TOOL, pos=after[-1].translation * METRES, quat=quaternion(after[-1]))
        wrist = bodies[-1].add_body(name="wrist", pos=hand.translation * METRES, quat=quaternion(hand))
        add_gripper(spec, wrist, self._jaw, plumb=self._plumb)

    def _add_capsules(self, bodies: Sequence[Any], after: Sequence[Transform]) -> None:
        for body in self._arm.bodies:
            ends = after[body.link] @ np.array([body.start, body.end])
            bodies[body.link].add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=ends.ravel() * METRES, mass=0.0,
                size=(body.radius * METRES, 0, 0), contype=Touch.GRIPPER, conaffinity=0, group=HIDDEN,
                friction=(0.2, 0.005, 0.0001), condim=3,
            )  # fmt: skip


def _add_link(parent: Any, name: str, where: Transform) -> Any:
    """A body that turns about its z axis; the link's own frame lies at its other end."""
    body = parent.add_body(
        name=f"link_{name}", pos=where.translation * METRES, quat=quaternion(where), gravcomp=1.0
    )
    body.explicitinertial = True
    body.mass = _LINK_MASS
    body.inertia = (1e-3, 1e-3, 1e-3)
    body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0, 0, 1), armature=ROTOR)
    return body


def frame_after(link: Link) -> Transform:
    """The link's frame in that of the body that turns: Trans(z, d) Trans(x, a) Rot(x, alpha)."""
    c, s = math.cos(link.alpha), math.sin(link.alpha)
    return Transform(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.array([link.a, 0.0, link.d]))


def _levers(arm: Arm, jaw: Jaw) -> Array:
    """(n,) mm: no point that a joint moves is farther from its axis."""
    lengths = [math.hypot(link.a, link.d) for link in arm.links]
    lengths[0] = abs(arm.links[0].a)  # along its own axis the first link has no lever
    width = max([jaw.palm_radius, jaw.outside_open, *(body.radius for body in arm.bodies)])
    beyond = list(accumulate(reversed(lengths)))[::-1]
    beyond[-1] = 0.0
    return np.array(beyond) + math.hypot(width, max(jaw.below, PALM_HEIGHT))
