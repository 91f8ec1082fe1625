"""An arm on the latch bridge's motors: counts of steps, in blocks of time."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from kempelen.core.geometry import Array
from kempelen.motion.arm.motors import LOCATE, PULL_OFF, SEEK
from kempelen.motion.arm.synchrony import TimedPath
from kempelen.robots.arm.axes import Grips, JointAxes
from kempelen.robots.arm.paths import JogPath
from kempelen.robots.grbl.codec import Axes
from kempelen.robots.grbl.gcode import GripperWiring, Program
from kempelen.robots.grbl.jog import JogWay
from kempelen.robots.grbl.settings import Misfit

WIRING = GripperWiring(
    open_line="G 0", close_line="G 1", open_words=frozenset({"o"}), close_words=frozenset({"c"})
)
"""Without current it is closed, as a reset leaves it."""
_BARRIER = b"E\n"
_LONGEST = 10_000  # ms of a block


class LatchAxes(JointAxes):
    """The `kempelen.robots.grbl.mechanics.Mechanics` of an arm on the bridge.

    Args:
        motors: Of the arm.
        space: The box that the tool point keeps to, robot frame.
    """

    unit = "steps"
    arrived = 0.5
    mark = "K"
    unlock = "X"

    def joints(self, position: Axes) -> Array:
        """(n,) rad at counts of steps."""
        return self.motors.gearing.angles(np.rint(np.array(position)))

    def misfits(self, settings: Mapping[int, float]) -> list[Misfit]:  # noqa: ARG002 - none to have
        """The bridge has no settings: every number comes with its command."""
        return []

    def remembers(self, modal: Sequence[str]) -> bool:
        """Whether the report says so."""
        return self.mark in modal

    def offset(self, machine: Axes, settings: Mapping[int, float]) -> Axes:  # noqa: ARG002 - always the same
        """None: homing tells the bridge what to count from."""
        return (0.0,) * len(machine)

    def jog(self, position: Axes) -> JogWay:
        """Along straight lines of the tool point."""
        return LatchJog(self, position)

    def homing(self, joint: int) -> str:
        """The command that finds a joint's switch; afterwards its motor counts from joint angles 0."""
        motors = self.motors
        steps, turned = float(motors.steps_per_degree[joint]), float(motors.arm.steps_per_rad[joint])
        way = int(np.sign(motors.motor_towards[joint] * turned))
        most = round(1.5 * float(motors.travel[joint]) * steps)
        seek, locate, off = round(SEEK * steps), round(LOCATE * steps), round(PULL_OFF * steps)
        return f"H {joint} {way} {seek} {locate} {off} {most} {self.home_count(joint)}"

    def home_count(self, joint: int) -> int:
        """What a motor counts where homing ends."""
        return int(self.motors.gearing.steps(self.motors.arm.home)[joint])

    def switch_count(self, joint: int) -> int:
        """What a motor counts where its joint's switch closes, when nothing was lost."""
        motors = self.motors
        way = float(motors.motor_towards[joint]) * np.sign(float(motors.arm.steps_per_rad[joint]))
        return self.home_count(joint) + int(way) * round(PULL_OFF * float(motors.steps_per_degree[joint]))

    def _begun(self, position: Axes) -> tuple[list[bytes], Array]:
        return [], np.rint(np.array(position)).astype(np.int64)

    def _wait(self, seconds: float) -> bytes:
        return f"W {round(1000 * seconds)}\n".encode()

    def _ended(self, lines: Sequence[bytes], end: Array, gripper: Grips = (), dwell: float = 0.0) -> Program:
        return Program((*lines, _BARRIER), tuple(map(float, end)), gripper, dwell)

    def _along(self, path: TimedPath, here: Array) -> tuple[list[bytes], Array]:
        """A block for each piece of a path; what is rounded off one is made up for in the next."""
        counts = self.motors.gearing.steps(path.joints)
        marks = np.rint(1000 * path.times).astype(np.int64)
        lines, before = [], 0
        for count, mark in zip(counts[1:], marks[1:].tolist(), strict=True):
            if mark > before:
                lines += _cut(mark - before, count - here)
                here, before = count, mark
        if len(counts) > 1 and (counts[-1] != here).any():  # within the last millisecond
            lines += _cut(1, counts[-1] - here)
            here = counts[-1]
        return lines, here


def block(letter: str, milliseconds: int, steps: Array) -> str:
    """``B`` or ``J``, the time, the steps of each motor."""
    return f"{letter} {milliseconds} {' '.join(map(str, steps.tolist()))}"


def _cut(milliseconds: int, steps: Array) -> list[bytes]:
    """One block, or several where it is longer than the bridge takes."""
    pieces = -(-milliseconds // _LONGEST)
    ends = [(milliseconds * k // pieces, steps * k // pieces) for k in range(pieces + 1)]
    return [f"{block('B', b[0] - a[0], b[1] - a[1])}\n".encode() for a, b in pairwise(ends)]


class LatchJog:
    """Short straight pieces of the tool point's way as jog blocks.

    Args:
        mechanics: Of the arm.
        position: Counts of the motors at its beginning.
    """

    def __init__(self, mechanics: LatchAxes, position: Axes) -> None:
        self.fastest = float(min(mechanics.space.velocity))
        self._gearing = mechanics.motors.gearing
        self._path = JogPath(mechanics.paths, mechanics.joints(position))
        self._counts = np.rint(np.array(position)).astype(np.int64)

    def go_on(self, velocity: Array, seconds: float) -> tuple[str, float]:
        """The next command and how long it takes, s; 0 s at the edge of the reach."""
        took = self._path.go_on(velocity, seconds)
        if not took:
            return "", 0.0
        counts = self._gearing.steps(self._path.joints)
        steps, self._counts = counts - self._counts, counts
        return block("J", max(round(1000 * took), 1), steps), took
