"""Lines for GRBL: numbers, paths, gripper commands.

Every motion of a gantry is ``G0``: each axis at its own limits, which is what the planner's asynchronous
schedules assume.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kempelen.core.errors import ConfigError, MotionError
from kempelen.core.geometry import Array
from kempelen.core.protocols import Action, Follow, FollowJoints, GripperState, SetGripper
from kempelen.core.table import WorkSpace

# Stated in front of every group: work coordinates, millimetres, absolute. Whatever was modal before does not
# matter.
PREAMBLE = "G21G54G90"
# Every motion is a G0, so a feed rate means nothing to this machine (and should a bare G1 ever reach it, it
# would creep). It is lost at every reset: finding it again proves that the controller has not been reset
# since.
MEMORY_MARK = "F77"
BARRIER = b"G4P0\n"  # acknowledged when every motion before it has ended

_ROUNDING = 6e-4  # mm; coordinates are sent with three decimals
_START_TOLERANCE = 0.1  # mm between where a path begins and where the tool point is


def number(value: float) -> str:
    """A coordinate with at most three decimals, as short as it can be: ``12.009``, ``-0.5``, ``0``.

    Raises:
        MotionError: the number is not finite.
    """
    if not np.isfinite(value):
        raise MotionError(f"A coordinate is {value}.", hint="Calibrate again.")
    text = f"{value:.3f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def words(axes: Sequence[float], letters: str = "XYZ") -> str:
    """``X..Y..Z..`` for a number of each axis."""
    return "".join(f"{letter}{number(value)}" for letter, value in zip(letters, axes, strict=True))


@dataclass(frozen=True, slots=True)
class GripperWiring:
    """Which lines move the gripper.

    Attributes:
        open_line: G-code that opens it.
        close_line: G-code that closes it.
        open_words: Words of ``$G`` that all appear while it is told to be open.
        close_words: The same for closed.
        open_letter: Letter in a report's ``A:`` while it is open (coolant); ``"-"`` where none tells.
        after_reset: What a reset of the controller leaves behind.
    """

    open_line: str = "M8"
    close_line: str = "M9"
    open_words: frozenset[str] = frozenset({"M8"})
    close_words: frozenset[str] = frozenset({"M9"})
    open_letter: str = "F"
    after_reset: GripperState = GripperState.CLOSED

    @classmethod
    def servo(cls, open_pwm: float, closed_pwm: float) -> "GripperWiring":
        """A hobby servo on the spindle's PWM output: ``M3 S``; limp after a reset."""
        if open_pwm == closed_pwm:
            raise ConfigError(
                f"gripper servo: open and closed are both S{number(open_pwm)}.",
                hint="Set servo_open and servo_closed to different values.",
            )
        opened, closed = f"S{number(open_pwm)}", f"S{number(closed_pwm)}"
        return cls(
            open_line=f"M3{opened}",
            close_line=f"M3{closed}",
            open_words=frozenset({"M3", opened}),
            close_words=frozenset({"M3", closed}),
            open_letter="-",
            after_reset=GripperState.UNKNOWN,
        )

    def line(self, state: GripperState) -> str:
        """The line that brings the gripper into ``state``."""
        return self.open_line if state is GripperState.OPEN else self.close_line

    def read(self, modal: Sequence[str]) -> GripperState:
        """What the words of ``$G`` say."""
        told = {f"{word[0]}{number(float(word[1:]))}" if word[:1] == "S" else word for word in modal}
        if self.open_words <= told:
            return GripperState.OPEN
        return GripperState.CLOSED if self.close_words <= told else GripperState.UNKNOWN


@dataclass(frozen=True, slots=True)
class Program:
    """A group of actions as lines.

    Attributes:
        lines: Each with its newline; the last is a barrier.
        end: Where the axes are afterwards, work coordinates.
        gripper: After how many acknowledged lines the gripper is in which state.
        longest_dwell: s; Idle with an acknowledgement owed is legal for so long.
    """

    lines: tuple[bytes, ...]
    end: tuple[float, ...]
    gripper: tuple[tuple[int, GripperState], ...] = ()
    longest_dwell: float = 0.0

    def gripper_after(self, acknowledged: int) -> GripperState | None:
        """The state that so many lines have brought about; None when they did not touch the gripper."""
        done = [state for index, state in self.gripper if index <= acknowledged]
        return done[-1] if done else None


def compile_group(
    group: Sequence[Action], start: tuple[float, float, float], space: WorkSpace, wiring: GripperWiring
) -> Program:
    """Lines for an atomic group, checked before the first byte goes out.

    Args:
        group: Paths and gripper commands.
        start: (x, y, z) mm where the tool point is now, robot frame.
        space: What the machine reaches.
        wiring: Of the gripper.

    Raises:
        MotionError: a path leaves the work space, is not finite, begins elsewhere than at ``start``, or is
            one of joint angles.
    """
    lines = [f"{PREAMBLE}G0\n".encode()]
    gripper: list[tuple[int, GripperState]] = []
    here = start
    for action in group:
        if isinstance(action, Follow):
            path, here = _path_lines(action.vertices, here, space)
            lines += path
        elif isinstance(action, FollowJoints):
            raise MotionError(
                f"A path of {np.shape(action.vertices)} joint angles came to a machine of straight axes. "
                "Nothing was sent.",
                hint="Plan for the gantry, or set robot.kind to 'arm'.",
            )
        else:
            state = GripperState.CLOSED if action.closed else GripperState.OPEN
            lines.append(f"{wiring.line(state)}\n".encode())
            gripper.append((len(lines), state))
            lines.append(_dwell(action))
    if not group or isinstance(group[-1], Follow):
        lines.append(BARRIER)
    dwells = (action.seconds for action in group if isinstance(action, SetGripper))
    return Program(tuple(lines), here, tuple(gripper), max(dwells, default=0.0))


def _dwell(action: SetGripper) -> bytes:
    return f"G4P{number(action.seconds)}\n".encode()


def _path_lines(
    vertices: Array, start: tuple[float, float, float], space: WorkSpace
) -> tuple[list[bytes], tuple[float, float, float]]:
    points = checked_path(vertices, start, space)
    lines: list[bytes] = []
    here = [round(value, 3) for value in start]
    for x, y, z in points.tolist():
        line = "".join(
            f"{letter}{number(value)}"
            for letter, value, old in zip("XYZ", (x, y, z), here, strict=True)
            if value != old
        )
        if line:
            lines.append(f"{line}\n".encode())
            here = [x, y, z]
    return lines, (here[0], here[1], here[2])


def checked_path(
    vertices: Array,
    start: tuple[float, float, float],
    space: WorkSpace,
    tolerance: float = _START_TOLERANCE,
) -> Array:
    """A path of the tool point (n, 3) mm, rounded to a thousandth.

    Args:
        vertices: In the robot frame.
        start: Where the tool point is.
        space: What it keeps to.
        tolerance: How far the first vertex may be from ``start``, mm.

    Raises:
        MotionError: it leaves the work space, is not finite, or begins elsewhere.
    """
    points = np.asarray(vertices, dtype=np.float64)
    if points.ndim != 2 or points.shape[1:] != (3,) or not len(points):  # noqa: PLR2004 - (n, 3)
        raise MotionError(
            f"A path has the shape {points.shape}, wanted (n, 3).", hint="This is a fault; report it."
        )
    if not np.isfinite(points).all():
        raise MotionError("A path holds a coordinate that is not finite.", hint="Calibrate again.")
    low, high = np.asarray(space.lower), np.asarray(space.upper)
    excess = np.maximum(low - points, points - high)
    if float(excess.max()) > _ROUNDING:
        raise _out_of_reach(points, excess, space)
    apart = float(np.abs(points[0] - start).max())
    if apart > tolerance:
        raise MotionError(
            f"A path begins at {_mm(points[0])}, the tool point is at {_mm(start)}: {apart:.3f} mm apart, "
            f"allowed {tolerance} mm.",
            hint="Plan again from where the machine is.",
        )
    rounded: Array = np.round(points, 3)
    return rounded


def _out_of_reach(points: Array, excess: Array, space: WorkSpace) -> MotionError:
    row, axis = divmod(int(excess.argmax()), 3)
    return MotionError(
        f"Out of reach: vertex {row} has {'xyz'[axis]} = {points[row, axis]:.3f} mm, allowed "
        f"{space.lower[axis]:g} to {space.upper[axis]:g} mm ({excess[row, axis]:.3f} mm too far). "
        "Nothing was sent.",
        hint="Check the calibration: board and trays must lie within the work space.",
    )


def _mm(point: Sequence[float] | Array) -> str:
    return "(" + ", ".join(f"{value:.3f}" for value in point) + ") mm"
