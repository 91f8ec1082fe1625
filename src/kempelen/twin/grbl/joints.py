"""What an arm's motors really do: joints that hang on several motors, reference switches, ends of ranges.

Everything is in degrees here. The true position is that of the motors, as it would be counted from joint
angles of 0; joints follow from it through the coupling.
"""

from collections.abc import Sequence
from math import degrees, inf

import numpy as np

from kempelen.motion.arm.motors import Motors
from kempelen.twin.grbl.machine import Machine
from kempelen.twin.grbl.settings import Vec

_BEYOND = 4.0  # degrees from the end of a joint's range to its mechanical stop
_TOUCH = 1e-6  # degrees: a switch reached is a switch closed


class ArmMachine(Machine):
    """Joints with a reference switch each, closed from where homing finds it to the range's nearer end.

    Args:
        motors: Of the arm.
        joints: True joint angles at power-up, rad.
    """

    __slots__ = ("_joint_from_motor", "_stops", "_switches")

    def __init__(self, motors: Motors, joints: Sequence[float]) -> None:
        position = tuple(np.degrees(motors.gearing.motors(joints)).tolist())
        super().__init__(tuple(motors.travel.tolist()), position, ends=tuple(motors.towards.tolist()))
        self._joint_from_motor: list[Vec] = [tuple(row) for row in motors.arm.joint_from_motor.tolist()]
        self._switches: Vec = tuple(motors.switches.tolist())
        self._stops: list[tuple[float, float]] = [
            (degrees(low) - _BEYOND, degrees(high) + _BEYOND) for low, high in motors.arm.ranges
        ]

    @property
    def joints_deg(self) -> Vec:
        """True joint angles, degrees: what the coupling makes of where the motors are."""
        place = self.position
        return tuple([sum(map(_times, row, place)) for row in self._joint_from_motor])

    def _joint(self, axis: int) -> float:
        return float(sum(map(_times, self._joint_from_motor[axis], self.position)))

    def _stop_at_the_ends(self) -> None:
        """A joint at its stop stops its motor, which loses steps."""
        for axis, (low, high) in enumerate(self._stops):
            angle = self._joint(axis)
            excess = angle - high if angle > high else angle - low if angle < low else 0.0
            if excess:
                self._slip[axis] -= excess / self._joint_from_motor[axis][axis]

    def switch_at(self, axis: int) -> float:
        """Joint angle at which the switch of a joint closes, degrees."""
        return self._switches[axis]

    def closed(self, axis: int) -> bool:
        """Whether the switch of a joint is pressed."""
        if axis in self.dead_switches:
            return False
        return bool((self._joint(axis) - self._switches[axis]) * self._ends[axis] >= -_TOUCH)

    def distance_to_change(self, axis: int, unit: Sequence[float]) -> float:
        """How far along a straight way of the motors the switch of a joint changes, degrees; or infinity."""
        turning = [0.0 if motor in self.stalled else share for motor, share in enumerate(unit)]
        direction = sum(map(_times, self._joint_from_motor[axis], turning))
        if abs(direction) < _TOUCH or axis in self.dead_switches:
            return inf
        edge = self._switches[axis]
        if self.closed(axis):
            edge -= 2.0 * _TOUCH * self._ends[axis]
        distance = (edge - self._joint(axis)) / direction
        return distance if distance > 0.0 else inf


def _times(a: float, b: float) -> float:
    return a * b
