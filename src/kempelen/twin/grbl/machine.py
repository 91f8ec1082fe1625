"""What the carriage really does: ends of travel, switches, lost steps, stalled axes.

The true position is in GRBL's machine frame as it would be after a correct homing: the reference switch of an
axis that has it at its far end closes at 0, that of one that has it at its near end at -travel.
"""

from collections.abc import Sequence
from math import inf
from typing import Any

from kempelen.twin.grbl.settings import Vec

LETTERS = "XYZABC"
_UP = 2  # the axis that homes upwards
_OVERTRAVEL = 1.5  # mm from a switch to the mechanical end
_TOUCH = 1e-6  # mm: a switch reached is a switch closed
_BRAKING = 30_000.0  # mm/s²: of friction, when the motors are cut off in full flight


class Machine:
    """Axes with a reference switch each: as a rule z has it at its far end, every other axis at its near one.

    Args:
        travel: Of each axis, mm.
        position: True position at power-up, mm, machine frame.
        ends: +1 where the switch closes at 0, -1 where it closes at -travel.

    Attributes:
        motor: Where the controller has told the motors to be, mm.
        stalled: Axes whose motor turns without effect.
        dead_switches: Axes whose switch never closes.
    """

    __slots__ = ("_ends", "_slip", "dead_switches", "motor", "stalled", "travel")

    def __init__(self, travel: Vec, position: Vec, *, ends: Vec | None = None) -> None:
        self.travel = travel
        self._ends = ends or tuple(1.0 if axis == _UP else -1.0 for axis in range(len(travel)))
        self.motor: Vec = position
        self._slip = [0.0] * len(travel)  # true minus what the motors were told, mm
        self.stalled: set[int] = set()
        self.dead_switches: set[int] = set()

    @property
    def position(self) -> Vec:
        """True position, mm."""
        return tuple([told + slip for told, slip in zip(self.motor, self._slip, strict=True)])

    def follow(self, motor: Vec) -> None:
        """The motors have been told to go to ``motor``."""
        if self.stalled:
            for axis in self.stalled:
                self._slip[axis] -= motor[axis] - self.motor[axis]
        self.motor = motor
        self._stop_at_the_ends()

    def _stop_at_the_ends(self) -> None:
        motor = self.motor
        for axis in range(len(motor)):
            place = motor[axis] + self._slip[axis]
            if place > _OVERTRAVEL:
                self._slip[axis] -= place - _OVERTRAVEL
            elif place < -self.travel[axis] - _OVERTRAVEL:
                self._slip[axis] -= place + self.travel[axis] + _OVERTRAVEL

    def rename(self, motor: Vec) -> None:
        """The controller calls the present place ``motor`` from now on; nothing moves."""
        true = self.position
        self.motor = motor
        self._slip = [round(true[axis] - motor[axis], 9) for axis in range(len(motor))]

    def slip(self, axis: int, mm: float) -> None:
        """The carriage slips along an axis, unnoticed by the controller."""
        self._slip[axis] += mm
        self.follow(self.motor)

    def cut_off(self, velocity: Vec) -> None:
        """The motors stop dead at ``velocity`` (mm/s); the mass slides on and steps are lost."""
        for axis, speed in enumerate(velocity):
            if speed and axis not in self.stalled:
                self._slip[axis] += speed * abs(speed) / (2.0 * _BRAKING)
        self.follow(self.motor)

    def switch_at(self, axis: int) -> float:
        """True coordinate at which the switch of an axis closes, mm."""
        return 0.0 if self._ends[axis] > 0 else -self.travel[axis]

    def closed(self, axis: int) -> bool:
        """Whether the switch of an axis is pressed."""
        if axis in self.dead_switches:
            return False
        place = self.motor[axis] + self._slip[axis]
        return (place - self.switch_at(axis)) * self._ends[axis] >= -_TOUCH

    def pressed(self) -> str:
        """The axes whose switches are pressed, as in the status report."""
        return "".join(LETTERS[axis] for axis in range(len(self.travel)) if self.closed(axis))

    def distance_to_change(self, axis: int, unit: Sequence[float]) -> float:
        """How far along a straight way the switch of an axis changes, mm; infinity when it never does.

        Args:
            axis: Whose switch.
            unit: Direction of the way: the signed share that each axis takes of it.
        """
        direction = unit[axis]
        if not direction or axis in self.stalled or axis in self.dead_switches:
            return inf
        place = self.motor[axis] + self._slip[axis]
        edge = self.switch_at(axis)
        if self.closed(axis):
            edge -= 2.0 * _TOUCH * self._ends[axis]
        distance = (edge - place) / direction
        return distance if distance > 0.0 else inf

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        return {
            "travel": list(self.travel),
            "ends": list(self._ends),
            "motor": list(self.motor),
            "slip": list(self._slip),
            "stalled": sorted(self.stalled),
            "dead": sorted(self.dead_switches),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`."""
        self.travel, self._ends = tuple(state["travel"]), tuple(state["ends"])
        self.motor = tuple(state["motor"])
        self._slip = [float(slip) for slip in state["slip"]]
        self.stalled = {int(axis) for axis in state["stalled"]}
        self.dead_switches = {int(axis) for axis in state["dead"]}
