"""An arm as the controller of its motors sees it: axes that are motor angles, in degrees.

A G-code controller knows nothing of joints. Its axes X, Y, Z, A, B are the motors; a motor's angle is what
the coupling makes of the joints' angles (`Gearing`). What such a controller must be set to follows from the
arm's parameter file alone, and is written down here once, for whoever checks the settings and whoever
simulates them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.motion.arm.steps import Gearing

AXES = "XYZABC"
"""Letters of the motors, base first."""
JUNCTION = 0.5
"""$11, degrees: how far a corner may be rounded; paths of joint angles are smooth by themselves."""
SEEK = 25.0
"""Fastest search for a switch, deg/s."""
LOCATE = 3.0
"""Speed at which it is touched for the second time, deg/s."""
PULL_OFF = 2.0
"""$27, degrees: how far a motor backs off its switch."""
_HOMING = 3.0  # $22: there are switches, and axes may be homed one by one
_HEADROOM = 2.0  # a controller's ramps within segments must be steeper than the path that they follow


@dataclass(frozen=True, eq=False)
class Motors:
    """The motors of an arm; all angles in degrees.

    Attributes:
        arm: Whose they are.
        gearing: How they turn its joints.
    """

    arm: Arm
    gearing: Gearing

    @classmethod
    def of(cls, arm: Arm) -> Self:
        """Those of an arm."""
        return cls(arm, Gearing(arm.coupling, arm.steps_per_rad))

    @property
    def axes(self) -> str:
        """Their letters."""
        return AXES[: self.arm.n]

    def degrees(self, joints: npt.ArrayLike) -> Array:
        """Motor angles (..., n) of joint angles (..., n) rad, rounded to whole steps.

        Each is rounded by itself from its exact value, so that remainders never add up along a path.
        """
        angles: Array = self.gearing.steps(joints) / self._signed_steps
        return angles

    def joints(self, degrees: npt.ArrayLike) -> Array:
        """Joint angles (..., n) rad at motor angles (..., n)."""
        return self.gearing.joints(np.radians(np.asarray(degrees, dtype=np.float64)))

    @cached_property
    def _signed_steps(self) -> Array:
        return np.radians(self.arm.steps_per_rad)

    @cached_property
    def steps_per_degree(self) -> Array:
        """(n,), positive: which way a motor is mounted is the controller's setting $3."""
        return np.abs(self._signed_steps)

    @cached_property
    def velocity(self) -> Array:
        """(n,) deg/s that a motor makes when all joints it hangs on turn at their fastest."""
        return np.degrees(np.abs(self.arm.coupling) @ self.arm.velocity)

    @cached_property
    def acceleration(self) -> Array:
        """(n,) deg/s², enough to follow any path within the joints' limits."""
        return _HEADROOM * np.degrees(np.abs(self.arm.coupling) @ self.arm.acceleration)

    @cached_property
    def travel(self) -> Array:
        """(n,) that a motor turns over its own joint's range."""
        own = np.abs(np.diag(self.arm.coupling))
        return np.degrees(own * (self.arm.ranges[:, 1] - self.arm.ranges[:, 0]))

    # --- homing --------------------------------------------------------------------------------------------

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Joints in the order of homing: what lifts the hand first, from the shoulder on, then base and roll.

        A joint's motor may turn others along, so each homes before those that hang on it.
        """
        last = self.arm.n - 1
        return (*range(1, last), 0, last)

    @cached_property
    def towards(self) -> Array:
        """(n,) +1 or -1: on which side of home a joint's switch is closed: the nearer end of its range."""
        low, high = self.arm.ranges.T
        return np.where(high - self.arm.home < self.arm.home - low, 1.0, -1.0)

    @cached_property
    def backs_off(self) -> Array:
        """(n,) deg by which a joint stands off its switch after homing."""
        return PULL_OFF / np.abs(np.diag(self.arm.coupling))

    @cached_property
    def switches(self) -> Array:
        """(n,) deg: joint angles at which the switches close."""
        return np.degrees(self.arm.home) + self.towards * self.backs_off

    @cached_property
    def home(self) -> Array:
        """(n,) motor angles where homing ends."""
        return self.gearing.motors(np.degrees(self.arm.home))

    @cached_property
    def motor_towards(self) -> Array:
        """(n,) +1 or -1: which way a motor turns to close its joint's switch."""
        return self.towards * np.sign(np.diag(self.arm.coupling))

    @cached_property
    def machine_from_work(self) -> Array:
        """(n,) to be added to a motor angle to get the controller's machine coordinate after homing.

        GRBL calls the place where homing ends ``-$27`` at the far end of an axis and ``$27 - $13x`` at its
        near end, to the step. The work offset G54 is this.
        """
        named = np.where(self.motor_towards > 0, -PULL_OFF, PULL_OFF - self.travel)
        return np.rint(named * self.steps_per_degree) / self.steps_per_degree - self.home

    # --- a controller's settings ---------------------------------------------------------------------------

    def settings(self) -> dict[int, float]:
        """``$`` number to the value that fits this arm; degrees, degrees/min, degrees/s²."""
        away = sum(1 << axis for axis, way in enumerate(self.motor_towards) if way < 0)
        turned = sum(1 << axis for axis, steps in enumerate(self.arm.steps_per_rad) if steps < 0)
        values = {1: 255.0, 3: float(turned), 10: 1.0, 11: JUNCTION, 13: 0.0, 20: 0.0, 21: 0.0, 22: _HOMING}
        values |= {23: float(away), 24: 60.0 * LOCATE, 25: 60.0 * SEEK, 27: PULL_OFF}
        values |= {44 + place: float(1 << joint) for place, joint in enumerate(self.order)}
        return values | {number: round(value, 6) for number, value in self._axis_settings()}

    def _axis_settings(self) -> Iterator[tuple[int, float]]:
        for axis in range(self.arm.n):
            yield 100 + axis, float(self.steps_per_degree[axis])
            yield 110 + axis, 60.0 * float(self.velocity[axis])
            yield 120 + axis, float(self.acceleration[axis])
            yield 130 + axis, float(self.travel[axis])
