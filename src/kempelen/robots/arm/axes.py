"""What the mechanics of all arms are, whatever a controller counts in: paths become groups of lines."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.protocols import Action, GripperState, SetGripper
from kempelen.core.table import WorkSpace
from kempelen.motion.arm.motors import Motors
from kempelen.motion.arm.synchrony import TimedPath
from kempelen.robots.arm.paths import ArmPaths
from kempelen.robots.grbl.codec import Axes
from kempelen.robots.grbl.gcode import GripperWiring, Program
from kempelen.robots.grbl.mechanics import Pose

Grips = tuple[tuple[int, GripperState], ...]
"""After how many lines the gripper is in which state."""
_OUTSIDE = 0.5  # mm


class JointAxes(ABC):
    """The part of `kempelen.robots.grbl.mechanics.Mechanics` that is the same for all arms.

    Args:
        motors: Of the arm.
        space: The box that the tool point keeps to, robot frame.
    """

    name = "arm"

    def __init__(self, motors: Motors, space: WorkSpace) -> None:
        self.motors = motors
        self.paths = ArmPaths(motors, space)
        self.space = space
        self.axes = motors.axes
        self.axis_names: Sequence[str] = motors.arm.joint_names

    # --- what the controller counts in ----------------------------------------------------------------------

    @abstractmethod
    def joints(self, position: Axes) -> Array:
        """(n,) rad at what the controller reports."""

    @abstractmethod
    def _begun(self, position: Axes) -> tuple[list[bytes], Array]:
        """The lines that open a group, and (n,) the reported position to the step."""

    @abstractmethod
    def _along(self, path: TimedPath, here: Array) -> tuple[list[bytes], Array]:
        """The lines that follow a path from ``here``, and where that leads."""

    @abstractmethod
    def _wait(self, seconds: float) -> bytes:
        """The line that waits."""

    @abstractmethod
    def _ended(self, lines: Sequence[bytes], end: Array, gripper: Grips = (), dwell: float = 0.0) -> Program:
        """A whole group; ``dwell`` is the longest wait in it, s."""

    # --- what follows from it -------------------------------------------------------------------------------

    def pose(self, position: Axes) -> Pose:
        """Joints from motors, the tool point from joints."""
        joints = self.joints(position)
        return Pose(self.paths.tool(joints), tuple(joints.tolist()))

    def entry(self, position: Axes) -> Program | None:
        """Along a straight line to the nearest point of the work space."""
        joints = self.joints(position)
        tool = np.array(self.paths.tool(joints))
        inside = np.clip(tool, self.space.lower, self.space.upper)
        if float(np.abs(inside - tool).max()) < _OUTSIDE:
            return None
        return self.program([self.paths.straight(inside, joints)], position)

    def compile(self, group: Sequence[Action], position: Axes, wiring: GripperWiring) -> Program:
        """Lines for an atomic group, checked before the first byte goes out.

        Raises:
            MotionError: a path leaves the work space, the reach or a joint's range, or begins elsewhere.
        """
        (lines, here), joints = self._begun(position), self.joints(position)
        gripper = list[tuple[int, GripperState]]()
        for action in group:
            if isinstance(action, SetGripper):
                state = GripperState.CLOSED if action.closed else GripperState.OPEN
                lines.append(f"{wiring.line(state)}\n".encode())
                gripper.append((len(lines), state))
                lines.append(self._wait(action.seconds))
                continue
            path = self.paths.timed(action, joints)
            more, here = self._along(path, here)
            lines += more
            joints = path.joints[-1]
        dwells = (action.seconds for action in group if isinstance(action, SetGripper))
        return self._ended(lines, here, tuple(gripper), max(dwells, default=0.0))

    def retract(self, position: Axes) -> Program:
        """Straight up to the top of the work space, or as far as the arm reaches."""
        return self.program([self.paths.retract(self.joints(position))], position)

    def program(self, paths: Sequence[TimedPath], position: Axes) -> Program:
        """Lines for paths that follow each other."""
        lines, here = self._begun(position)
        for path in paths:
            more, here = self._along(path, here)
            lines += more
        return self._ended(lines, here)
