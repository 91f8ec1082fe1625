"""The virtual machine behind the virtual controller, and where that puts its joints."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

from kempelen.core.geometry import Array
from kempelen.core.table import WorkSpace
from kempelen.kinematics import load_arm
from kempelen.twin.grbl import Faults, Machine, VirtualArm, VirtualGrbl
from kempelen.twin.latch import VirtualLatch
from kempelen.twin.physics.mechanism import Mechanism, true_arm
from kempelen.twin.physics.scene import Scene
from kempelen.twin.spec import ArmSpec, TwinSpec

Point = tuple[float, float, float]

_POWER_UP = (0.35, 0.6, 0.8)  # where the carriage happens to be when the power comes on, shares of the box


class Controller(Protocol):
    """A virtual controller: bytes and seconds in, bytes out."""

    @property
    def faults(self) -> Faults:
        """What is broken; may be changed at any time."""
        ...

    @property
    def time_s(self) -> float:
        """Since power-up."""
        ...

    def receive(self, data: bytes) -> None:
        """Bytes from the host."""
        ...

    def take_output(self) -> bytes:
        """What has reached the host since the last call."""
        ...

    def reset_by_dtr(self) -> None:
        """The host has opened the port."""
        ...

    def advance(self, dt: float) -> None:
        """Let ``dt`` seconds pass."""
        ...

    def idle(self) -> bool:
        """Whether nothing happens until somebody says something."""
        ...

    def starving(self) -> bool:
        """Whether it would be slow for want of lines."""
        ...

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`."""
        ...


class Drive(Protocol):
    """A controller and what it drives."""

    @property
    def controller(self) -> Controller:
        """At the end of the wire."""
        ...

    @property
    def closed(self) -> bool:
        """Whether the gripper is without power, so that its spring closes it."""
        ...

    def follow(self, dt: float) -> Sequence[float]:
        """Where the joints truly are ``dt`` seconds after the last time: mm or rad."""
        ...

    def lose(self, joints: Array) -> None:
        """Its joints have stayed behind by (n,), mm or rad: lost steps."""
        ...

    def told(self) -> dict[str, Any]:
        """What is to be known of the machine from the side door."""
        ...

    def snapshot(self) -> dict[str, Any]:
        """JSON-able, the controller's state included."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`."""
        ...


class GantryDrive:
    """A G-code controller and three slides.

    Args:
        spec: Whose work space they have.
    """

    def __init__(self, spec: TwinSpec) -> None:
        self._space = spec.space
        self.controller = make_controller(spec)
        self.snapshot, self.restore = self.controller.snapshot, self.controller.restore

    @property
    def closed(self) -> bool:
        """Whether the coolant output is off."""
        return not self.controller.flood_on

    def follow(self, dt: float) -> Point:
        """(x, y, z) of the carriage, robot frame, mm."""
        del dt
        return tool_point(self._space, self.controller)

    def lose(self, joints: Array) -> None:
        """It is stronger than any piece."""

    def told(self) -> dict[str, Any]:
        """Nothing but the tool point, which everybody knows."""
        return {}


class ArmDrive:
    """A multi-axis controller and an arm with its flaws.

    Args:
        spec: Which arm, and how it truly is.
        baud: Speed of the serial line, bit/s; 0 for one without delay.

    Raises:
        ConfigError: there is no such arm, or the flaws are of another one.
    """

    def __init__(self, spec: ArmSpec, baud: int) -> None:
        arm = load_arm(spec.arm)
        board = VirtualLatch if spec.controller == "latch" else VirtualArm
        self.controller: VirtualLatch | VirtualArm = board(arm, baud=baud)
        self._mechanism = Mechanism(arm, spec.flaws)

    @property
    def closed(self) -> bool:
        """What the controller's outputs say."""
        return self.controller.gripper_closed

    def follow(self, dt: float) -> Sequence[float]:
        """(n,) true joint angles, rad."""
        controller = self.controller
        true = self._mechanism.follow(dt, controller.motors, controller.homings, idle=controller.idle())
        joints: list[float] = true.tolist()
        return joints

    def lose(self, joints: Array) -> None:
        """Until the next homing."""
        if joints.any():
            self._mechanism.lose(joints)

    def told(self) -> dict[str, Any]:
        """How often it was homed, how often each joint has stopped since, and how far each is off, rad."""
        mechanism = self._mechanism
        return {
            "homings": self.controller.homings,
            "stops": mechanism.stops.tolist(),
            "errors": mechanism.errors.tolist(),
        }

    def snapshot(self) -> dict[str, Any]:
        """JSON-able, the controller's state included."""
        return {"controller": self.controller.snapshot(), "mechanism": self._mechanism.snapshot()}

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`."""
        self.controller.restore(state["controller"])
        self._mechanism.restore(state["mechanism"])


def make_drive(spec: TwinSpec) -> Drive:
    """The machine just powered up."""
    return GantryDrive(spec) if spec.arm is None else ArmDrive(spec.arm, spec.baud)


def make_scene(spec: TwinSpec) -> Scene:
    """The table as laid, with the robot as it truly is; an arm stands on the table that the board lies on."""
    scene = Scene.from_layout(spec.table(), spec.standing(), seed=spec.seed, scatter=spec.scatter)
    scene = replace(scene, look=spec.look, person=spec.person)
    if spec.arm is None:
        return scene
    level = float(scene.table.robot_from_board.translation[2])
    thickness = max(scene.board_thickness, level)
    return replace(scene, arm=true_arm(load_arm(spec.arm.arm), spec.arm.flaws), board_thickness=thickness)


def make_controller(spec: TwinSpec) -> VirtualGrbl:
    """A gantry's controller just powered up, its carriage somewhere above the table."""
    space = spec.space
    start = [
        low + share * (high - low) - offset
        for low, high, share, offset in zip(
            space.lower, space.upper, _POWER_UP, space.robot_from_machine, strict=True
        )
    ]
    return VirtualGrbl(Machine(space.travel, (start[0], start[1], start[2])), baud=spec.baud)


def tool_point(space: WorkSpace, controller: VirtualGrbl) -> Point:
    """Where the carriage truly is, robot frame, mm."""
    (x, y, z), (dx, dy, dz) = controller.position_mm, space.robot_from_machine
    return (x + dx, y + dy, z + dz)
