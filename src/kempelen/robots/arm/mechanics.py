"""An arm on the axes of a G-code controller: motors as axes X, Y, Z, A, B, in degrees.

Every segment is ``G93 G1`` with the inverse of its time, so that all motors start and arrive together
whatever their ways. Angles are those of whole steps. Source: RS274/NGC, section 3.5.19 (G93);
grblHAL and FluidNC take it as GRBL 1.1 does.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.protocols import Action, GripperState, SetGripper
from kempelen.core.table import WorkSpace
from kempelen.motion.arm.motors import Motors
from kempelen.motion.arm.synchrony import TimedPath
from kempelen.robots.arm.paths import ArmPaths, JogPath
from kempelen.robots.grbl.codec import Axes
from kempelen.robots.grbl.gcode import BARRIER, MEMORY_MARK, PREAMBLE, GripperWiring, Program, number, words
from kempelen.robots.grbl.jog import JogWay
from kempelen.robots.grbl.mechanics import Pose
from kempelen.robots.grbl.settings import Misfit

_TOLERANCE = 0.005  # relative; settings are stored as 32-bit floats and typed by people
_WHY = {
    1: "the motors must stay energised at rest, or the arm sinks and loses its position",
    10: "status reports must carry a position",
    11: "paths are planned for this junction deviation in degrees",
    13: "reports must not be in inches",
    20: "soft limits know motors, not joints; the driver checks every joint itself",
    21: "the switches are references within the joints' ranges, not their ends",
    22: "homing must be on, with reference switches, also of one axis alone",
    23: "the switches lie on these sides of home",
    27: "home is this many degrees off the switches",
}
_AXIS_WHY = {
    100: "steps of a degree of the motor of",
    110: "highest rate (degrees/min) of",
    120: "acceleration (degrees/s²) of",
    130: "travel (degrees) of",
}


class ArmAxes:
    """The `kempelen.robots.grbl.mechanics.Mechanics` of an arm.

    Args:
        motors: Of the arm.
        space: The box that the tool point keeps to, robot frame.
    """

    name = "arm"
    unit = "°"
    mark = f"{PREAMBLE}G94{MEMORY_MARK}"
    unlock = "$X"

    def __init__(self, motors: Motors, space: WorkSpace) -> None:
        self.motors = motors
        self.paths = ArmPaths(motors, space)
        self.space = space
        self.axes = motors.axes
        self.axis_names: Sequence[str] = motors.arm.joint_names
        self.arrived = 0.5 / float(motors.steps_per_degree.min()) + 0.002  # half a step and its rounding

    def pose(self, position: Axes) -> Pose:
        """Joints from motors, the tool point from joints."""
        joints = self.motors.joints(position)
        return Pose(self.paths.tool(joints), tuple(joints.tolist()))

    def misfits(self, settings: Mapping[int, float]) -> list[Misfit]:
        """Which of the controller's settings do not fit the arm's parameter file."""
        return list(self._misfits(settings))

    def _misfits(self, settings: Mapping[int, float]) -> Iterator[Misfit]:
        for key, value in self.motors.settings().items():
            if key in _UNKNOWABLE:
                continue
            have = settings.get(key)
            if have is None or abs(have - value) > _TOLERANCE * abs(value):
                yield Misfit(key, have, value, self._why(key, value))

    def _why(self, key: int, value: float) -> str:
        base, axis = divmod(key, 10)
        if base * 10 in _AXIS_WHY:
            return f"{_AXIS_WHY[base * 10]} {self.axis_names[axis]} is {number(value)} for this arm"
        return _WHY.get(key, "joints home in this order: from the shoulder outwards, then base and roll")

    def remembers(self, modal: Sequence[str]) -> bool:
        """Whether the mark is still there, or the arm is in the middle of a path."""
        return MEMORY_MARK in modal or "G93" in modal

    def offset(self, machine: Axes, settings: Mapping[int, float]) -> Axes:  # noqa: ARG002 - the file's count
        """So that work positions are motor angles, wherever the controller says that home is."""
        steps = self.motors.steps_per_degree
        exact = np.rint(np.array(machine) * steps) / steps
        return tuple(np.round(exact - self.motors.home, 3).tolist())

    def entry(self, position: Axes) -> Program | None:
        """Along a straight line to the nearest point of the work space."""
        joints = self.motors.joints(position)
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
        lines, gripper = [self._first()], list[tuple[int, GripperState]]()
        joints, here = self.motors.joints(position), self._whole(position)
        for action in group:
            if isinstance(action, SetGripper):
                state = GripperState.CLOSED if action.closed else GripperState.OPEN
                lines.append(f"{wiring.line(state)}\n".encode())
                gripper.append((len(lines), state))
                lines.append(f"G4P{number(action.seconds)}\n".encode())
                continue
            path = self.paths.timed(action, joints)
            more, here = self._lines(path, here)
            lines += more
            joints = path.joints[-1]
        dwells = (action.seconds for action in group if isinstance(action, SetGripper))
        return self._program(lines, here, tuple(gripper), max(dwells, default=0.0))

    def retract(self, position: Axes) -> Program:
        """Straight up to the top of the work space, or as far as the arm reaches."""
        return self.program([self.paths.retract(self.motors.joints(position))], position)

    def program(self, paths: Sequence[TimedPath], position: Axes) -> Program:
        """Lines for paths that follow each other."""
        lines, here = [self._first()], self._whole(position)
        for path in paths:
            more, here = self._lines(path, here)
            lines += more
        return self._program(lines, here)

    def _first(self) -> bytes:
        return f"{PREAMBLE}G93\n".encode()

    def _program(
        self,
        lines: Sequence[bytes],
        end: Array,
        gripper: tuple[tuple[int, GripperState], ...] = (),
        dwell: float = 0.0,
    ) -> Program:
        last = (f"G94{MEMORY_MARK}\n".encode(), BARRIER)
        return Program((*lines, *last), tuple(end.tolist()), gripper, dwell)

    def _whole(self, position: Axes) -> Array:
        """The reported angles to the step."""
        steps = self.motors.steps_per_degree
        whole: Array = np.rint(np.array(position) * steps) / steps
        return whole

    def _lines(self, path: TimedPath, here: Array) -> tuple[list[bytes], Array]:
        """One line for each stretch in which a motor makes a step; its time is that since the line before."""
        lines, before = [], 0.0
        angles = self.motors.degrees(path.joints)
        for angle, time in zip(angles[1:], path.times[1:].tolist(), strict=True):
            if (angle == here).all():
                continue
            axes = words(angle.tolist(), self.axes)
            lines.append(f"G1{axes}F{number(60.0 / (time - before))}\n".encode())
            here, before = angle, time
        return lines, here

    def jog(self, position: Axes) -> JogWay:
        """Along straight lines of the tool point."""
        return ArmJog(self, position)


class ArmJog:
    """Short straight pieces of the tool point's way as jog commands of the motors.

    Args:
        mechanics: Of the arm.
        position: Of the motors at its beginning.
    """

    def __init__(self, mechanics: ArmAxes, position: Axes) -> None:
        self.fastest = float(min(mechanics.space.velocity))
        self._motors = mechanics.motors
        self._path = JogPath(mechanics.paths, self._motors.joints(position))
        self._angles: Array = self._motors.degrees(self._path.joints)

    def go_on(self, velocity: Array, seconds: float) -> tuple[str, float]:
        """The next command and how long it takes, s; 0 s at the edge of the reach."""
        took = self._path.go_on(velocity, seconds)
        if not took:
            return "", 0.0
        angles = self._motors.degrees(self._path.joints)
        way = float(np.linalg.norm(angles - self._angles))
        self._angles = angles
        if not way:
            return "", took
        return f"$J=G21G90{words(angles.tolist(), self._motors.axes)}F{number(60.0 * way / took)}", took


_UNKNOWABLE = frozenset({3, 24, 25})  # how motors are mounted, how fast they seek: the owner's business
_OUTSIDE = 0.5  # mm
