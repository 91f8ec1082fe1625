"""What the physics asks of a robot, be it a gantry or an arm."""

from collections.abc import Sequence
from typing import Any, Protocol

from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceShape
from kempelen.twin.physics.arm import ArmBody
from kempelen.twin.physics.gantry import Gantry
from kempelen.twin.physics.scene import Scene


class Slack(Protocol):
    """Knows where pieces rest, and how far the robot may move before it can touch one."""

    def __len__(self) -> int: ...

    def update(self, positions: Array, axes: Array) -> None:
        """Take note of the pieces: (n, 3) bases' centres, mm, and (n, 3) unit vectors from base to head."""
        ...

    def slack(self, joints: Array, *, opened: bool) -> float:
        """How far every point of the robot may go in any direction without a touch, mm."""
        ...


class Machine(Protocol):
    """A robot whose joints go where they are told.

    Attributes:
        joints: Names of the MuJoCo joints, in order.
        scale: MuJoCo's unit in one of ours: metres or radians.
        unit: Ours, for messages.
        fastest: No joint moves faster than this: a jump is an error of the caller's.
        standstill: A joint that is asked to go less than this in a step stands.
        stall: Pressing harder than this on a piece, N, its motors lose their steps.
    """

    joints: tuple[str, ...]
    scale: float
    unit: str
    fastest: float
    standstill: float
    stall: float

    @property
    def start(self) -> Array:
        """(n,) joints at first."""
        ...

    @property
    def parked(self) -> Array:
        """(n,) joints where it hides nothing of the board from a camera."""
        ...

    def tool(self, joints: Array) -> Array:
        """(3,) tool point, robot frame, mm."""
        ...

    def pads(self, joints: Array) -> float:
        """How far pads that hang on pivots turn from the fingers' line, rad."""
        ...

    def sweep(self, way: Array) -> float:
        """What no point of the machine goes farther than when its joints go by ``way`` (n,), mm."""
        ...

    def clearance(self, shapes: Sequence[PieceShape]) -> Slack:
        """How far the machine is from such pieces."""
        ...

    def build(self, spec: Any, scene: Scene) -> None:
        """Add its bodies to an MjSpec."""
        ...


def machine_of(scene: Scene) -> Machine:
    """The robot that works at a table."""
    return Gantry(scene.table) if scene.arm is None else ArmBody(scene.arm, scene.table.gripper)
