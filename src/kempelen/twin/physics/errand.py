"""What a person's hand is asked to do, and how it goes about it: pure motion, no physics."""

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from kempelen.core.geometry import Array

Point = tuple[float, float, float]

REACH_SECONDS = 0.25
REACH_SPEED = 1100.0
"""Mean speed of an empty hand, mm/s, to which the least time is added."""
LIFT_SECONDS = 0.3
LOWER_SECONDS = 0.35
CARRY_SPEED = 700.0
"""Mean speed of a carry, mm/s."""
CARRY_SECONDS = 0.25
"""Least time of a carry, s."""
RELEASE_HEIGHT = 0.3
_GRASP = 0.8
"""Share of a piece's height at which the fingers hold it."""
_ARCH = 60.0
"""How far an empty hand rises over a straight way, mm."""
_LAY = math.pi / 2


@dataclass(frozen=True, slots=True)
class Errand:
    """One piece to take somewhere, or a place to hold the hand over.

    Attributes:
        number: Of the errand.
        piece: Number in the scene; -1 to take nothing.
        target: (x, y, z) on the surface where the hand will let go, robot frame, mm; or where the finger tips
            are held.
        turn: Of the piece about its axis when let go, rad.
        via: (x, y) points that the piece is carried over first, mm, stopping at each.
        pause: How long the hand stops over each of them and over the target, s.
        slide: Whether the piece is pushed along the board instead of lifted.
        lying: Whether it is laid down instead of stood up.
        pace: Times the usual duration of every motion.
    """

    number: int
    piece: int
    target: Point
    turn: float = 0.0
    via: tuple[tuple[float, float], ...] = ()
    pause: float = 0.0
    slide: bool = False
    lying: bool = False
    pace: float = 1.0


@dataclass
class Grasp:
    """An errand under way. Only ``elapsed`` changes; what else there is to know is worked out once.

    Attributes:
        errand: What is to be done.
        start: (x, y, z) of the finger tips when it began, mm.
        home: (x, y, z) of the finger tips when it will be over, mm.
        source: (x, y, z) of the base's centre where the piece was taken, mm.
        attitude: (w, x, y, z) of the piece there.
        height: Of the base's centre during the carry, mm.
        tall: Of the piece, mm.
        radius: Of its base, mm.
        elapsed: Seconds since the hand set out.
    """

    errand: Errand
    start: Point
    home: Point
    source: Point
    attitude: tuple[float, float, float, float]
    height: float
    tall: float
    radius: float
    elapsed: float = 0.0

    @cached_property
    def reach_time(self) -> float:
        """When the hand is at the piece, s since it set out."""
        return self._reach(self.start, tuple(self._tip(*self._held(0.0))))

    def _reach(self, here: Point, there: tuple[float, ...]) -> float:
        return self.errand.pace * (REACH_SECONDS + math.dist(here, there) / REACH_SPEED)

    @cached_property
    def _legs(self) -> list[tuple[float, float]]:
        """(x, y) points of the carry, in order."""
        return [self.source[:2], *self.errand.via, self.errand.target[:2]]

    @cached_property
    def _leg_seconds(self) -> list[float]:
        return [
            self.errand.pace * (CARRY_SECONDS + min(math.dist(a, b), 1000.0) / CARRY_SPEED)
            for a, b in pairwise(self._legs)
        ]

    @cached_property
    def hold_seconds(self) -> float:
        """How long the piece is in the hand."""
        errand = self.errand
        if errand.piece < 0:
            return errand.pause
        stops = (len(errand.via) + 1) * errand.pause
        return errand.pace * (LIFT_SECONDS + LOWER_SECONDS) + sum(self._leg_seconds) + stops

    @property
    def release_time(self) -> float:
        """When the hand lets go, s since it set out."""
        return self.reach_time + self.hold_seconds

    @cached_property
    def end_time(self) -> float:
        """When the hand is out of the way again, s since it set out."""
        last = self._tip(*self._held(self.hold_seconds))
        return self.release_time + self._reach(self.home, tuple(last))

    @property
    def holding(self) -> bool:
        """Whether a piece is in the hand."""
        return self.errand.piece >= 0 and self.reach_time <= self.elapsed < self.release_time

    @property
    def done(self) -> bool:
        """Whether the hand is out of the way again."""
        return self.elapsed >= self.end_time

    def pose(self, elapsed: float) -> tuple[Array, Array]:
        """(3,) mm base's centre and (4,) attitude of the held piece at a time since the hand set out."""
        return self._held(min(max(elapsed - self.reach_time, 0.0), self.hold_seconds))

    def tip(self, elapsed: float) -> Array:
        """(3,) mm finger tips at a time since the hand set out."""
        reach, release = self.reach_time, self.release_time
        if elapsed < reach:
            return _arc(np.array(self.start), self._tip(*self._held(0.0)), elapsed / reach)
        if elapsed < release:
            return self._tip(*self.pose(elapsed))
        last = self._tip(*self._held(self.hold_seconds))
        return _arc(last, np.array(self.home), (elapsed - release) / max(self.end_time - release, 1e-9))

    def _tip(self, base: Array, attitude: Array) -> Array:
        """(3,) where a piece that stands or lies like that is held."""
        if self.errand.piece < 0:
            return base
        w, x, y, z = attitude
        axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
        return np.asarray(base + _GRASP * self.tall * axis)

    def _held(self, at: float) -> tuple[Array, Array]:
        """Pose of the piece at a time since it was taken."""
        errand, pace = self.errand, self.errand.pace
        if errand.piece < 0:
            return np.array(errand.target), np.array(self.attitude)
        where = np.array(self.source)
        up, down = _ease(at / (pace * LIFT_SECONDS)), self._lowered(at)
        where[:2] = self._across(at - pace * LIFT_SECONDS)
        low = errand.target[2] + RELEASE_HEIGHT + self.radius * errand.lying
        where[2] += up * (self.height - where[2]) + down * (low - self.height)
        return where, self._attitude(up, down)

    def _lowered(self, at: float) -> float:
        seconds = self.errand.pace * LOWER_SECONDS
        return _ease((at - self.hold_seconds + seconds) / seconds)

    def _across(self, at: float) -> Array:
        """(2,) of the carry at a time since it began."""
        legs = self._legs
        for (here, there), seconds in zip(pairwise(legs), self._leg_seconds, strict=True):
            if at <= seconds + self.errand.pause:
                return np.asarray(np.array(here) + _ease(at / seconds) * np.subtract(there, here))
            at -= seconds + self.errand.pause
        return np.array(legs[-1])

    def _attitude(self, up: float, down: float) -> Array:
        """From how the piece stood or lay to upright, and on to lying where that is wanted."""
        turn = self.errand.turn / 2
        mixed = _between(np.array(self.attitude), np.array([math.cos(turn), 0.0, 0.0, math.sin(turn)]), up)
        if not self.errand.lying:
            return mixed
        half = down * _LAY / 2  # about an axis in the base, so that the piece falls to no particular side
        return _product(mixed, np.array([math.cos(half), math.sin(half), 0.0, 0.0]))

    def state(self) -> dict[str, Any]:
        """JSON-able."""
        return asdict(self)

    @classmethod
    def of(cls, state: dict[str, Any]) -> "Grasp":
        """From `state`."""
        points = {name: tuple(state[name]) for name in ("start", "home", "source", "attitude")}
        return cls(**{**state, **points, "errand": errand_of(state["errand"])})


def errand_of(state: dict[str, Any]) -> Errand:
    """From JSON."""
    via = tuple((float(x), float(y)) for x, y in state["via"])
    return Errand(**{**state, "target": tuple(state["target"]), "via": via})


def _ease(share: float) -> float:
    """Minimum-jerk course from 0 to 1 (Flash and Hogan 1985)."""
    s = min(max(share, 0.0), 1.0)
    return s * s * s * (10 - 15 * s + 6 * s * s)


def _arc(here: Array, there: Array, share: float) -> Array:
    s = _ease(share)
    out = here + s * (there - here)
    out[2] += 4 * _ARCH * s * (1 - s)
    return np.asarray(out)


def _between(start: Array, end: Array, share: float) -> Array:
    mixed = (1 - share) * start + share * (end if start @ end >= 0 else -end)
    return np.asarray(mixed / np.linalg.norm(mixed))


def _product(p: Array, q: Array) -> Array:
    """Of two quaternions: first q, then p."""
    w, v = p[0] * q[0] - p[1:] @ q[1:], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])
    return np.array([w, *v])
