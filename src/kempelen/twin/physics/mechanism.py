"""Between an arm's motors and its joints: coupling, lost steps, play, warmth, and what homing mends.

True joint angles are what the true coupling makes of the motors' angles, plus what was lost at each stop
since the last homing, plus what the arm grew by warming up since then, within the play of each joint.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import ConfigError
from kempelen.core.geometry import Array, Transform
from kempelen.kinematics import Arm, Drift
from kempelen.kinematics.drift import STILL, stop_loss
from kempelen.twin.flaws import ArmFlaws
from kempelen.twin.physics.scene import StandingArm

WARM = 15.0
"""By how much an arm at work becomes warmer than one at rest, K."""
WARMING_S = 1200.0
"""Time constant of that, s of work."""
COOLING_S = 2400.0
"""The same of a motionless arm."""
SETTLES_S = 0.1
"""Motors that make no step for so long have stopped, whatever is still to be driven, s."""


class Mechanism:
    """The joints at the end of the motors.

    Args:
        arm: By its parameter file.
        flaws: How it truly is.

    Raises:
        ConfigError: the flaws are of an arm of another size.
    """

    def __init__(self, arm: Arm, flaws: ArmFlaws) -> None:
        _check(arm, flaws)
        self._arm, self._flaws = arm, flaws
        self._joint_from_motor = (
            np.linalg.inv(np.array(flaws.coupling)) if flaws.coupling else arm.joint_from_motor
        )
        self._offsets = np.array(flaws.offsets) if flaws.offsets else np.zeros(arm.n)
        self._drift = _shared(arm.drift, flaws)
        self._rng = np.random.default_rng(flaws.seed)
        self._homings = 0
        self._warmth = self._warmth_homed = 0.0  # share of WARM
        self._lost = np.zeros(arm.n)
        self._geared = self._stood = self._carried = np.zeros(arm.n)
        self._slack = np.zeros(arm.n)
        self._moving, self._still = False, 0.0
        self.stops: npt.NDArray[np.int64] = np.zeros(arm.n, dtype=np.int64)
        self._known = False

    @property
    def errors(self) -> Array:
        """(n,) rad: true joint angles minus those that a faultless arm would have by its motors."""
        grown = (self._warmth - self._warmth_homed) * WARM * self._drift.temperature
        return np.asarray(self._offsets + self._lost + grown + self._slack)

    def follow(self, dt: float, motors: npt.ArrayLike, homings: int, *, idle: bool = True) -> Array:
        """Let ``dt`` seconds pass.

        Args:
            dt: s.
            motors: (n,) where the motors truly are, rad, counted from joint angles 0.
            homings: How often the controller has been homed: each time what was lost is found again.
            idle: Whether the controller has nothing left to drive: motors that stand then have stopped;
                between the single steps of a slow motion they have not.

        Returns:
            (n,) true joint angles, rad.
        """
        geared = self._joint_from_motor @ np.asarray(motors, dtype=np.float64)
        if not self._known:
            self._geared = self._stood = self._carried = geared
            self._known = True
        turns = bool(np.abs(geared - self._geared).max() > STILL * dt)
        self._still = 0.0 if turns else self._still + dt
        moving = turns or (self._moving and not idle and self._still < SETTLES_S)
        self._geared = geared
        self._warm(dt, working=moving)
        self._take_up(geared)
        if homings != self._homings:
            self._find_home(homings)
        elif self._moving and not moving:
            self._stop()
        self._moving = moving
        return np.asarray(geared + self.errors)

    def lose(self, joints: Array) -> None:
        """Steps were lost: true angles are off by (n,) rad more, until the next homing."""
        self._lost = self._lost + joints

    def _warm(self, dt: float, *, working: bool) -> None:
        goal, seconds = (1.0, WARMING_S) if working else (0.0, COOLING_S)
        self._warmth += (goal - self._warmth) * -math.expm1(-dt / seconds)

    def _take_up(self, geared: Array) -> None:
        """Free movement: a joint follows its gear at the one or the other end of its play."""
        half = self._drift.play / 2
        self._slack = np.clip(self._carried, geared - half, geared + half) - geared
        self._carried = geared + self._slack

    def _stop(self) -> None:
        moved = np.abs(self._geared - self._stood) > STILL
        self._lost = self._lost + stop_loss(self._drift, moved, self._rng.standard_normal(self._arm.n))
        self.stops = self.stops + moved
        self._stood = self._geared

    def _find_home(self, homings: int) -> None:
        """The switches are found to a step of each motor."""
        step = self._joint_from_motor / self._arm.steps_per_rad
        self._lost = self._flaws.homing * step @ self._rng.uniform(-0.5, 0.5, self._arm.n)
        self._homings, self._warmth_homed = homings, self._warmth
        self.stops = np.zeros_like(self.stops)
        self._stood = self._geared

    # --- state ----------------------------------------------------------------------------------------------

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        return {
            "rng": self._rng.bit_generator.state,
            "homings": self._homings,
            "warmth": [self._warmth, self._warmth_homed],
            "moving": self._moving,
            "still": self._still,
            "known": self._known,
            "stops": self.stops.tolist(),
        } | {name: getattr(self, f"_{name}").tolist() for name in _ARRAYS}

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`."""
        self._rng.bit_generator.state = state["rng"]
        self._homings, (self._warmth, self._warmth_homed) = int(state["homings"]), state["warmth"]
        self._moving, self._known = bool(state["moving"]), bool(state["known"])
        self._still = float(state["still"])
        self.stops = np.array(state["stops"], dtype=np.int64)
        for name in _ARRAYS:
            setattr(self, f"_{name}", np.array(state[name], dtype=np.float64))


_ARRAYS = ("lost", "geared", "stood", "carried", "slack")


def true_arm(arm: Arm, flaws: ArmFlaws) -> StandingArm:
    """The arm as built and as it stands.

    Raises:
        ConfigError: the flaws are of an arm of another size.
    """
    _check(arm, flaws)
    if flaws.lengths:
        links = zip(arm.links, flaws.lengths, strict=True)
        arm = arm.with_links(tuple(link._replace(a=link.a + a, d=link.d + d) for link, (a, d) in links))
    return StandingArm(arm, Transform(_turned(*flaws.base_turn), np.array(flaws.base)))


def _turned(x: float, y: float, z: float) -> Array:
    """(3, 3) turns about the fixed x, then y, then z axis."""
    about_z = Transform.about_z(z).rotation
    c, s = math.cos(y), math.sin(y)
    about_y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    c, s = math.cos(x), math.sin(x)
    return np.asarray(about_z @ about_y @ np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]))


def _shared(drift: Drift, flaws: ArmFlaws) -> Drift:
    return replace(
        drift,
        stop_bias=drift.stop_bias * flaws.drift,
        stop_spread=drift.stop_spread * flaws.drift,
        play=drift.play * flaws.play,
        temperature=drift.temperature * flaws.temperature,
    )


def _check(arm: Arm, flaws: ArmFlaws) -> None:
    for name in ("offsets", "lengths", "coupling"):
        given = len(getattr(flaws, name))
        if given not in {0, arm.n}:
            raise ConfigError(
                f"The twin's arm has {arm.n} joints, flaws.{name} has {given} entries.",
                hint="Give one for each joint, base first, or none.",
            )
