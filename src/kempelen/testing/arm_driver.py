"""Drives an arm in physics without wire or controller: straight up, across by joints, straight down."""

from collections.abc import Iterator
from math import atan2, ceil, pi

import chess
import numpy as np

from kempelen.core.arm_table import arm_table
from kempelen.core.geometry import Array
from kempelen.core.places import Layout, Place
from kempelen.kinematics import Arm, forward, inverse, load_arm
from kempelen.twin.physics import Scene, World
from kempelen.twin.physics.scene import StandingArm

TICK = 0.008
SPEED = 150.0
"""Of the hand in a straight line, mm/s, on average less by a third."""
TURNING = 1.0
"""Of the fastest joint, rad/s, likewise."""
ROOM = 20.0
TABLE = arm_table()
ARM: Arm = load_arm("labvolt-5150")


def arm_world(men: dict[str, str], *, scatter: float = 1.0, arm: StandingArm | None = None) -> World:
    """The usual arm at its usual table; ``men`` holds place names and FEN letters."""
    layout = Layout({Place(name): chess.Piece.from_symbol(letter) for name, letter in men.items()})
    scene = Scene.from_layout(TABLE, layout, seed=3, scatter=scatter)
    level = float(TABLE.robot_from_board.translation[2])
    return World(Scene(TABLE, scene.pieces, board_thickness=level, arm=arm or StandingArm(ARM)))


class ArmDriver:
    """Carries pieces by a safe height.

    Args:
        world: To drive.
    """

    def __init__(self, world: World) -> None:
        self.world = world

    @property
    def tilt(self) -> float:
        """Of the gripper from straight down, rad, tip outwards positive."""
        joints = self.world.joints
        x, y, z = forward(ARM, joints)[:3, 2].tolist()
        return atan2(x * np.cos(joints[0]) + y * np.sin(joints[0]), -z)

    def joints(self, point: Array, tilt: float) -> Array:
        """Angles at a point, near to the present ones."""
        return inverse(ARM, point, pi - tilt, 0.0, near=np.array(self.world.joints)).joints

    def line(self, point: Array, tilt: float, *, closed: bool) -> None:
        """The hand in a straight line."""
        start = np.array(self.world.tool_mm)
        for share in _gently(float(np.linalg.norm(point - start)) / SPEED):
            self.world.step(TICK, self.joints(start + (point - start) * share, tilt).tolist(), closed)

    def swing(self, joints: Array, *, closed: bool) -> None:
        """All joints together."""
        start = np.array(self.world.joints)
        for share in _gently(float(np.abs(joints - start).max()) / TURNING):
            self.world.step(TICK, (start + (joints - start) * share).tolist(), closed)

    def wait(self, seconds: float, *, closed: bool) -> None:
        """Stand still."""
        here = self.world.joints
        for _ in range(ceil(seconds / TICK)):
            self.world.step(TICK, here, closed)

    def go(self, point: Array, tilt: float, top: float, *, closed: bool) -> None:
        """Up to ``top`` mm, across, down."""
        x, y, z = self.world.tool_mm
        self.line(np.array([x, y, max(z, top)]), self.tilt, closed=closed)
        self.swing(self.joints(np.array([point[0], point[1], top]), tilt), closed=closed)
        self.line(point, tilt, closed=closed)

    def transfer(
        self, kind: chess.PieceType, source: str, target: str, tilts: tuple[float, float] = (0.0, 0.0)
    ) -> str | None:
        """Fetch and deliver at a tilt each; returns what was held before it was let go."""
        over = float(TABLE.robot_from_board.translation[2]) + TABLE.pieces.tallest + ROOM
        self.go(TABLE.grip_point(Place(source), kind), tilts[0], over, closed=False)
        self.wait(TABLE.gripper.close_seconds, closed=True)
        hang = TABLE.pieces[kind].grip_height
        self.go(TABLE.release_point(Place(target), kind), tilts[1], over + hang, closed=True)
        held = self.world.held()
        self.wait(TABLE.gripper.open_seconds, closed=False)
        x, y, z = self.world.tool_mm
        self.line(np.array([x, y, z + 60.0]), self.tilt, closed=False)
        return held

    def settle(self, at_most: float = 3.0) -> None:
        """Stand still until nothing moves.

        Raises:
            TimeoutError: something moves for longer than ``at_most`` simulated seconds.
        """
        end = self.world.time + at_most
        self.wait(TICK, closed=False)
        while not self.world.settled():
            if self.world.time > end:
                raise TimeoutError(f"still moving after {at_most} s")
            self.wait(TICK, closed=False)


def _gently(seconds: float) -> Iterator[float]:
    count = max(1, ceil(1.5 * seconds / TICK))
    for k in range(1, count + 1):
        share = k / count
        yield share * share * (3 - 2 * share)
