"""What hangs on a controller's axes: the part of a driver that knows a gantry from an arm."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from kempelen.core.protocols import Action
from kempelen.core.table import WorkSpace
from kempelen.robots.grbl.codec import Axes
from kempelen.robots.grbl.gcode import (
    BARRIER,
    MEMORY_MARK,
    PREAMBLE,
    GripperWiring,
    Program,
    compile_group,
    number,
    words,
)
from kempelen.robots.grbl.jog import JogWay, StraightWay
from kempelen.robots.grbl.settings import Misfit, check


class Pose(NamedTuple):
    """Where a machine is.

    Attributes:
        tool: (x, y, z) mm of the tool point, robot frame.
        joints: (n,) rad; None for a machine of straight axes.
    """

    tool: tuple[float, float, float]
    joints: tuple[float, ...] | None = None


class Mechanics(Protocol):
    """A machine's geometry in terms of its controller's axes.

    Attributes:
        name: In messages: "The gantry is busy".
        axes: Letters of the axes.
        axis_names: What they are called in messages.
        unit: Of the axes, for messages.
        arrived: How far an axis may be from its target at the end of a motion.
        mark: Modal words to begin with, and the mark by which memory is known later.
        unlock: What ends an alarm.
        space: The box that the tool point keeps to.
    """

    name: str
    axes: str
    axis_names: Sequence[str]
    unit: str
    arrived: float
    mark: str
    unlock: str
    space: WorkSpace

    def pose(self, position: Axes) -> Pose:
        """Where the machine is when its axes are at ``position``, work coordinates."""
        ...

    def misfits(self, settings: Mapping[int, float]) -> list[Misfit]:
        """Which of the controller's settings do not fit."""
        ...

    def remembers(self, modal: Sequence[str]) -> bool:
        """Whether the words of ``$G`` prove that there was no reset since a driver last drove it."""
        ...

    def offset(self, machine: Axes, settings: Mapping[int, float]) -> Axes:
        """The work offset G54 that is right when the axes stand at ``machine`` after homing."""
        ...

    def entry(self, position: Axes) -> Program | None:
        """From where homing ends into the work space; None when it is there already."""
        ...

    def compile(self, group: Sequence[Action], position: Axes, wiring: GripperWiring) -> Program:
        """Lines for an atomic group that begins at ``position``, checked as a whole.

        Raises:
            MotionError: a path leaves what the machine reaches, or begins elsewhere.
        """
        ...

    def retract(self, position: Axes) -> Program:
        """Straight up to the top of the work space."""
        ...

    def jog(self, position: Axes) -> JogWay:
        """A jog that begins at ``position``."""
        ...


class Straight:
    """Three straight axes: the gantry. The robot frame is the work coordinate system G54.

    Args:
        space: The work space.
    """

    name = "gantry"
    axes = "XYZ"
    axis_names: Sequence[str] = ("x", "y", "z")
    unit = "mm"
    arrived = 0.06  # a coarse step and its rounding
    mark = PREAMBLE + MEMORY_MARK
    unlock = "$X"

    def __init__(self, space: WorkSpace) -> None:
        self.space = space

    def pose(self, position: Axes) -> Pose:
        """The axes are the tool point."""
        x, y, z = position
        return Pose((x, y, z))

    def misfits(self, settings: Mapping[int, float]) -> list[Misfit]:
        """Which of the controller's settings do not fit the work space."""
        return check(settings, self.space)

    def remembers(self, modal: Sequence[str]) -> bool:
        """Whether the mark is still there."""
        return MEMORY_MARK in modal

    def offset(self, machine: Axes, settings: Mapping[int, float]) -> Axes:  # noqa: ARG002 - the same for all
        """Machine space is [-travel, 0] whatever the switches say."""
        return tuple(-value for value in self.space.robot_from_machine)

    def entry(self, position: Axes) -> Program | None:
        """Straight to the nearest point of the work space."""
        x, y, z = np.clip(position, self.space.lower, self.space.upper).tolist()
        if (x, y, z) == tuple(position):
            return None
        return Program((f"{PREAMBLE}G0{words((x, y, z))}\n".encode(), BARRIER), (x, y, z))

    def compile(self, group: Sequence[Action], position: Axes, wiring: GripperWiring) -> Program:
        """See `compile_group`."""
        return compile_group(group, self.pose(position).tool, self.space, wiring)

    def retract(self, position: Axes) -> Program:
        """In machine coordinates: right with any work offset."""
        x, y, _ = position
        top = self.space.upper[2]
        line = f"{PREAMBLE}G53G0Z{number(top - self.space.robot_from_machine[2])}\n".encode()
        return Program((line, BARRIER), (x, y, top))

    def jog(self, position: Axes) -> JogWay:
        """Along straight lines."""
        return StraightWay(position, self.space)
