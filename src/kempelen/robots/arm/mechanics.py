"""An arm on the axes of a G-code controller: motors as axes X, Y, Z, A, B, in degrees.

Every segment is ``G93 G1`` with the inverse of its time, so that all motors start and arrive together
whatever their ways. Angles are those of whole steps. Source: RS274/NGC, section 3.5.19 (G93);
grblHAL and FluidNC take it as GRBL 1.1 does.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.table import WorkSpace
from kempelen.motion.arm.motors import Motors
from kempelen.motion.arm.synchrony import TimedPath
from kempelen.robots.arm.axes import Grips, JointAxes
from kempelen.robots.arm.paths import JogPath
from kempelen.robots.grbl.codec import Axes
from kempelen.robots.grbl.gcode import BARRIER, MEMORY_MARK, PREAMBLE, Program, number, words
from kempelen.robots.grbl.jog import JogWay
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


class ArmAxes(JointAxes):
    """The `kempelen.robots.grbl.mechanics.Mechanics` of an arm.

    Args:
        motors: Of the arm.
        space: The box that the tool point keeps to, robot frame.
    """

    unit = "°"
    mark = f"{PREAMBLE}G94{MEMORY_MARK}"
    unlock = "$X"

    def __init__(self, motors: Motors, space: WorkSpace) -> None:
        super().__init__(motors, space)
        self.arrived = 0.5 / float(motors.steps_per_degree.min()) + 0.002  # half a step and its rounding

    def joints(self, position: Axes) -> Array:
        """(n,) rad at degrees of the motors."""
        return self.motors.joints(position)

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

    def _begun(self, position: Axes) -> tuple[list[bytes], Array]:
        steps = self.motors.steps_per_degree
        whole: Array = np.rint(np.array(position) * steps) / steps
        return [f"{PREAMBLE}G93\n".encode()], whole

    def _wait(self, seconds: float) -> bytes:
        return f"G4P{number(seconds)}\n".encode()

    def _ended(self, lines: Sequence[bytes], end: Array, gripper: Grips = (), dwell: float = 0.0) -> Program:
        last = (f"G94{MEMORY_MARK}\n".encode(), BARRIER)
        return Program((*lines, *last), tuple(end.tolist()), gripper, dwell)

    def _along(self, path: TimedPath, here: Array) -> tuple[list[bytes], Array]:
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
