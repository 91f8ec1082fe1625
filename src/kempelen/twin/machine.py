"""The virtual machine behind the virtual controller, and where that puts the tool point."""

from dataclasses import replace

from kempelen.core.table import WorkSpace
from kempelen.twin.grbl import Machine, VirtualGrbl
from kempelen.twin.physics.scene import Scene
from kempelen.twin.spec import TwinSpec

Point = tuple[float, float, float]

_POWER_UP = (0.35, 0.6, 0.8)  # where the carriage happens to be when the power comes on, shares of the box


def make_scene(spec: TwinSpec) -> Scene:
    """The table as laid."""
    scene = Scene.from_layout(spec.table(), spec.standing(), seed=spec.seed, scatter=spec.scatter)
    return replace(scene, look=spec.look, person=spec.person)


def make_controller(spec: TwinSpec) -> VirtualGrbl:
    """A controller just powered up, its carriage somewhere above the table."""
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
