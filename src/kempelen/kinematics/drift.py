"""Open-loop steppers lose their place: how much, how sure one can be of it, what a look at the truth mends.

Per joint (paper, joint accuracy over repeated stops): at each stop after a motion a bias, always to the same
side, and a random part are lost for good; warmth shifts it; play leaves the joint at the end of its width
that it was pushed to last (`Slack`), or anywhere within when that is not known. The running estimate is a
Gaussian over the joints' errors, ``true = commanded + error``; seen through the Jacobian it is one over the
tool point, to be held against what a grasp allows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm, Drift, frozen_array
from kempelen.kinematics.chain import checked_joints, jacobian

SURE = 2.0
"""Standard deviations that count as certain."""

STILL = 1e-6
"""A joint that turns no farther than this between two stops has not moved, rad."""


SIDE_LEFT = 0.25
"""Share of its play within which a joint rests when it is known from which side it came: weight and friction
hold it at that end, not quite."""


class Uncertainty(NamedTuple):
    """Where the tool point may be, beside where it is believed to be.

    Attributes:
        shift: (3,) mm, expected; what `JointErrors.compensated` takes away.
        covariance: (3, 3) mm², that of the play included: independent errors add in quadrature.
        aside: mm, horizontally: how far off it may be, uncompensated.
        aside_known: mm, the same once the expected shift is compensated.
        up: mm, vertically, uncompensated.
    """

    shift: Array
    covariance: Array
    aside: float
    aside_known: float
    up: float


@dataclass(frozen=True, slots=True, eq=False)
class JointErrors:
    """What is known of the joints' errors, ``true = commanded + error``.

    Attributes:
        mean: (n,) rad, expected.
        covariance: (n, n) rad².
        stops: (n,) stops of each joint since it was known.
    """

    mean: Array
    covariance: Array
    stops: npt.NDArray[np.int64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", frozen_array(self.mean))
        object.__setattr__(self, "covariance", frozen_array(self.covariance))

    @classmethod
    def homed(cls, arm: Arm) -> Self:
        """Just homed: off by no more than a step of each motor, evenly spread."""
        step = arm.joint_from_motor / arm.steps_per_rad
        return cls(np.zeros(arm.n), step @ step.T / 12, np.zeros(arm.n, dtype=np.int64))

    def after(self, arm: Arm, stops: npt.ArrayLike) -> "JointErrors":
        """As it will be after a motion.

        Args:
            arm: The arm.
            stops: (k, n) rad: where the arm stands still, the place it starts from first. What it passes
                without stopping does not count.
        """
        stops = checked_joints(arm, stops).reshape(-1, arm.n)
        counts = (np.abs(np.diff(stops, axis=0)) > STILL).sum(axis=0)
        return replace(
            self,
            mean=self.mean + counts * arm.drift.stop_bias,
            covariance=self.covariance + np.diag(counts * arm.drift.stop_spread**2),
            stops=self.stops + counts,
        )

    def warmed(self, arm: Arm, kelvin: float, spread: float = 0.0) -> "JointErrors":
        """As it will be once the arm has become warmer by ``kelvin``, known to ``spread`` K."""
        shift = arm.drift.temperature
        return replace(
            self,
            mean=self.mean + kelvin * shift,
            covariance=self.covariance + spread**2 * np.outer(shift, shift),
        )

    def seen(
        self,
        arm: Arm,
        joints: npt.ArrayLike,
        off: npt.ArrayLike,
        spread: float,
        play: npt.ArrayLike | None = None,
    ) -> "JointErrors":
        """What a look at the tool point, or at a piece it has set down, teaches (a Kalman update).

        Args:
            arm: The arm.
            joints: (n,) rad as commanded when it was there.
            off: (3,) mm in the robot's frame: where it truly was minus where it was commanded to be; NaN for
                what was not seen, such as the height.
            spread: Standard deviation of the look, mm, each way.
            play: As for `tool`.

        Raises:
            MotionError: shapes are wrong, or the spread is not above 0.
        """
        off = np.asarray(off, dtype=np.float64).reshape(3)
        known = np.isfinite(off)
        if spread <= 0:
            raise MotionError(f"A look with a spread of {spread:g} mm teaches nothing; it has to be above 0.")
        lever = jacobian(arm, checked_joints(arm, joints).reshape(arm.n))[:3][known]
        width = arm.drift.play if play is None else np.asarray(play, dtype=np.float64)
        noise = np.eye(len(lever)) * spread**2 + lever @ _evenly(width) @ lever.T
        gain = self.covariance @ lever.T @ np.linalg.inv(lever @ self.covariance @ lever.T + noise)
        keep = np.eye(arm.n) - gain @ lever
        return replace(
            self,
            mean=self.mean + gain @ (off[known] - lever @ self.mean),
            covariance=keep @ self.covariance @ keep.T + gain @ noise @ gain.T,
        )

    def compensated(self, joints: npt.ArrayLike) -> Array:
        """Commands (..., n) rad that bring the joints to ``joints``, as far as the errors are known."""
        return np.asarray(np.asarray(joints, dtype=np.float64) - self.mean)

    def since(self, before: "JointErrors") -> "JointErrors":
        """What has come since an earlier state of the same account: what both have in common cancels."""
        return replace(
            self,
            mean=self.mean - before.mean,
            covariance=self.covariance - before.covariance,
            stops=self.stops - before.stops,
        )

    def tool(
        self, arm: Arm, joints: npt.ArrayLike, sure: float = SURE, play: npt.ArrayLike | None = None
    ) -> Uncertainty:
        """Where the tool point may be.

        Args:
            arm: The arm.
            joints: (n,) rad, where its joints are.
            sure: Standard deviations that count.
            play: (n,) rad, widths within which the joints rest anywhere; all of their play without.
        """
        lever = jacobian(arm, checked_joints(arm, joints).reshape(arm.n))[:3]
        shift = lever @ self.mean
        width = arm.drift.play if play is None else np.asarray(play, dtype=np.float64)
        covariance = lever @ (self.covariance + _evenly(width)) @ lever.T
        known = aside(covariance, sure)
        return Uncertainty(
            shift=shift,
            covariance=covariance,
            aside=float(np.linalg.norm(shift[:2])) + known,
            aside_known=known,
            up=abs(float(shift[2])) + sure * float(np.sqrt(covariance[2, 2])),
        )


def aside(covariance: Array, sure: float = SURE) -> float:
    """Horizontal distance, mm, in the worst direction, of ``sure`` standard deviations; (2+, 2+) mm²."""
    return sure * float(np.sqrt(max(float(np.linalg.eigvalsh(covariance[:2, :2])[-1]), 0.0)))


@dataclass(frozen=True, slots=True, eq=False)
class Slack:
    """Where in its play each joint rests, ``true = geared + slack``: between two bounds that motion closes.

    A gear takes its joint along at one end of the play, and at the other end after turning back by its width
    (the play operator of hysteresis). It never parts two bounds, so both may be led through a motion.

    Attributes:
        low: (n,) rad.
        high: (n,) rad.
    """

    low: Array
    high: Array

    @classmethod
    def unknown(cls, arm: Arm) -> Self:
        """Anywhere."""
        return cls(-arm.drift.play / 2, arm.drift.play / 2)

    def after(self, arm: Arm, path: npt.ArrayLike) -> "Slack":
        """As it will be after the gears have gone along (k, n) rad, straight from each to the next."""
        half = arm.drift.play / 2
        low, high = self.low, self.high
        for step in np.diff(checked_joints(arm, path).reshape(-1, arm.n), axis=0):
            low, high = np.clip(low - step, -half, half), np.clip(high - step, -half, half)
        return Slack(low, high)

    @property
    def mean(self) -> Array:
        """(n,) rad, expected."""
        return np.asarray((self.low + self.high) / 2)

    def width(self, arm: Arm) -> Array:
        """(n,) rad, within which the joints rest anywhere, as far as is known."""
        return np.asarray(np.maximum(self.high - self.low, SIDE_LEFT * arm.drift.play))


class Budget(NamedTuple):
    """How much of what a grasp allows is spent.

    Attributes:
        off: mm, how far aside the tool point may be at the grasp.
        allowed: mm.
        moves_left: How many more motions of the same kind can be done before it is spent; 0 when it is.
    """

    off: float
    allowed: float
    moves_left: int

    @property
    def spent(self) -> float:
        """Share, 1 and more when nothing is left."""
        return self.off / self.allowed if self.allowed > 0 else inf


_MOST_MOVES = 1000


def drift_budget(
    arm: Arm,
    errors: JointErrors,
    joints: npt.ArrayLike,
    allowed: float,
    *,
    motion: npt.ArrayLike | None = None,
    compensated: bool = True,
) -> Budget:
    """What is spent of the tolerance of a grasp, and how long the rest will last.

    Args:
        arm: The arm.
        errors: What is known of its joints.
        joints: (n,) rad at the grasp.
        allowed: How far aside the pads may be and still hold the piece, mm.
        motion: (k, n) rad, the stops of a typical motion; without it the grasp's joints are thought to stop
            once.
        compensated: Whether commands take the expected errors away.
    """
    off = _aside(compensated)
    here = checked_joints(arm, joints).reshape(arm.n)
    stops = np.stack([here - 1.0, here]) if motion is None else checked_joints(arm, motion)
    now = off(errors.tool(arm, here))
    if now > allowed:
        return Budget(now, allowed, 0)
    low, high = 0, _MOST_MOVES
    while low < high:  # the error only grows with the moves
        middle = (low + high + 1) // 2
        fits = off(_repeated(errors, arm, stops, middle).tool(arm, here)) <= allowed
        low, high = (middle, high) if fits else (low, middle - 1)
    return Budget(now, allowed, low)


def stop_loss(drift: Drift, moved: npt.ArrayLike, normal: npt.ArrayLike) -> Array:
    """What a simulated arm loses at one stop.

    Args:
        drift: Of the arm.
        moved: (n,) which joints came to the stop from a motion.
        normal: (n,) numbers of a standard normal distribution.

    Returns:
        (n,) rad, added to the joints' errors.
    """
    lost = drift.stop_bias + drift.stop_spread * np.asarray(normal, dtype=np.float64)
    return np.asarray(np.where(np.asarray(moved, dtype=bool), lost, 0.0))


def _aside(compensated: bool) -> Callable[[Uncertainty], float]:  # noqa: FBT001 - picks one of two
    return (lambda one: one.aside_known) if compensated else (lambda one: one.aside)


def _repeated(errors: JointErrors, arm: Arm, stops: Array, times: int) -> JointErrors:
    one = errors.after(arm, stops)
    return replace(
        errors,
        mean=errors.mean + times * (one.mean - errors.mean),
        covariance=errors.covariance + times * (one.covariance - errors.covariance),
    )


def _evenly(width: Array) -> Array:
    """(n, n) covariance of joints that rest anywhere within (n,) rad."""
    return np.asarray(np.diag(width**2 / 12))
