"""How one axis gets from rest to rest in the least time: full acceleration, full speed, full braking.

Plain floats throughout: the planner asks for one number at a time, and arrays would be slower.
"""

from dataclasses import dataclass
from math import sqrt
from typing import Self


@dataclass(frozen=True, slots=True)
class Profile:
    """A time-optimal motion from rest to rest under a speed and an acceleration limit.

    It is also the fastest way to *pass* any point on the line: everywhere the speed is as high as a start
    at rest, the limit and the stop at the end allow (bang-bang, Pontryagin).

    Attributes:
        distance: mm, 0 or more.
        acceleration: mm/s².
        speed: The highest speed reached, mm/s.
        ramp: Time of accelerating, and of braking, s.
        seconds: All of it, s.
    """

    distance: float
    acceleration: float
    speed: float
    ramp: float
    seconds: float

    @classmethod
    def over(cls, distance: float, speed: float, acceleration: float) -> Self:
        """The profile over ``distance`` mm at no more than ``speed`` mm/s and ``acceleration`` mm/s²."""
        if distance <= 0.0:
            return cls(0.0, acceleration, 0.0, 0.0, 0.0)
        top = min(speed, sqrt(acceleration * distance))
        return cls(distance, acceleration, top, top / acceleration, distance / top + top / acceleration)

    def passing(self, distance: float) -> float:
        """When the point ``distance`` mm from the start is passed, s; clipped to the motion's ends."""
        if distance <= 0.0 or self.distance == 0.0:
            return 0.0
        if distance >= self.distance:
            return self.seconds
        braking = 0.5 * self.speed * self.ramp
        if distance <= braking:
            return sqrt(2.0 * distance / self.acceleration)
        if distance <= self.distance - braking:
            return self.ramp + (distance - braking) / self.speed
        return self.seconds - sqrt(2.0 * (self.distance - distance) / self.acceleration)

    def switches(self, start: float, sign: float = 1.0) -> list[tuple[float, float]]:
        """When the acceleration changes, and by how much: ``[(s, mm/s²), ...]``, from ``start`` on."""
        if self.distance == 0.0:
            return []
        rate, end = sign * self.acceleration, start + self.seconds
        return [(start, rate), (start + self.ramp, -rate), (end - self.ramp, -rate), (end, rate)]
