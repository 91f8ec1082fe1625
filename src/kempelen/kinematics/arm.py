"""What an arm is made of: a chain of links by Denavit and Hartenberg, its limits, its motors, its faults."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import ConfigError
from kempelen.core.geometry import Array


class Link(NamedTuple):
    """One link by the standard convention: Rot(z, joint + offset) Trans(z, d) Trans(x, a) Rot(x, alpha).

    Attributes:
        a: Length, mm.
        alpha: Twist, rad.
        d: Shift along the joint's axis, mm.
        offset: Added to the joint's angle, rad.
    """

    a: float
    alpha: float
    d: float
    offset: float = 0.0


class Body(NamedTuple):
    """A capsule around a part of the arm, for the swept test.

    Attributes:
        link: Number of the frame it moves with: 0 the base, k the one after joint k.
        start: (3,) mm in that frame, middle of one end's ball.
        end: (3,) mm in that frame, the other one's.
        radius: mm.
    """

    link: int
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float


class Mass(NamedTuple):
    """What a link weighs.

    Attributes:
        kg: Its mass.
        centre: (3,) mm in the frame after its joint.
        inertia: (3, 3) kg mm² about the centre, axes of that frame.
    """

    kg: float
    centre: Array
    inertia: Array


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """How true joint angles leave the commanded ones; see `kempelen.kinematics.drift`. All (n,).

    Attributes:
        stop_bias: Lost at each stop, always to the same side, rad.
        stop_spread: Standard deviation of what is lost at each stop, rad.
        play: Backlash: the whole width of the joint's free movement, rad.
        temperature: Shift by warming up, rad/K.
    """

    stop_bias: Array
    stop_spread: Array
    play: Array
    temperature: Array

    def __post_init__(self) -> None:
        for one in fields(self):
            object.__setattr__(self, one.name, frozen_array(getattr(self, one.name)))

    @classmethod
    def none(cls, joints: int) -> Self:
        """An arm that keeps its place."""
        return cls(*(np.zeros(joints) for _ in range(4)))


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """An arm of n turning joints. Frame "robot": origin on the base's foot, z up.

    Attributes:
        name: As in `--robot` options and the parameter file.
        title: For people.
        joint_names: n names.
        links: n rows; the last one reaches to the tool point between the pads, its z is the approach vector.
        ranges: (n, 2) least and greatest joint angle, rad.
        velocity: (n,) rad/s.
        acceleration: (n,) rad/s².
        jerk: (n,) rad/s³.
        coupling: (n, n) motor_from_joint: motor angles are ``coupling @ joints``.
        steps_per_rad: (n,) of each motor, after its gear.
        home: (n,) where homing ends, rad.
        drift: How it loses its place.
        bodies: Capsules for the swept test.
        masses: n links' masses; empty where they are not known.
        tool: A fixed row after the last joint, for arms whose last link does not end at the tool point.
        sources: Where each group of numbers comes from.

    Raises:
        ConfigError: shapes differ, a range is empty, a limit is not above 0, home lies outside the ranges, or
            the coupling cannot be inverted.
    """

    name: str
    joint_names: tuple[str, ...]
    links: tuple[Link, ...]
    ranges: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    coupling: Array
    steps_per_rad: Array
    home: Array
    drift: Drift
    bodies: tuple[Body, ...] = ()
    masses: tuple[Mass, ...] = ()
    tool: Link | None = None
    title: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("ranges", "velocity", "acceleration", "jerk", "coupling", "steps_per_rad", "home"):
            object.__setattr__(self, name, frozen_array(getattr(self, name)))
        self._check_shapes()
        self._check_numbers()
        self._check_coupling()

    @property
    def n(self) -> int:
        """How many joints."""
        return len(self.links)

    @property
    def motor_from_joint(self) -> Array:
        """(n, n): motor angles of joint angles."""
        return self.coupling

    @property
    def joint_from_motor(self) -> Array:
        """(n, n): joint angles of motor angles."""
        return np.asarray(np.linalg.inv(self.coupling), dtype=np.float64)

    def within(self, joints: npt.ArrayLike, tolerance: float = 1e-9) -> npt.NDArray[np.bool_]:
        """Whether joint angles (..., n) rad lie in the ranges: (...) bool."""
        joints = np.asarray(joints, dtype=np.float64)
        low, high = self.ranges[:, 0] - tolerance, self.ranges[:, 1] + tolerance
        return np.asarray(((joints >= low) & (joints <= high)).all(axis=-1))

    def with_links(self, links: tuple[Link, ...]) -> "Arm":
        """The same arm with other links, as a fit finds them."""
        return replace(self, links=links)

    def _check_shapes(self) -> None:
        n = self.n
        vectors = ("velocity", "acceleration", "jerk", "steps_per_rad", "home")
        wanted: dict[str, tuple[int, ...]] = dict.fromkeys(vectors, (n,))
        wanted |= {"ranges": (n, 2), "coupling": (n, n)}
        for name, shape in wanted.items():
            found = getattr(self, name)
            if found.shape != shape:
                raise self._wrong(f"{name} has the shape {found.shape}, not {shape} as {n} links need")
            if not np.isfinite(found).all():
                raise self._wrong(f"{name} holds a number that is not finite")
        for one in fields(self.drift):
            if getattr(self.drift, one.name).shape != (n,):
                raise self._wrong(f"drift.{one.name} has not {n} numbers, one a joint")
        if len(self.joint_names) != n:
            raise self._wrong(f"{len(self.joint_names)} names of joints for {n} links")
        if self.masses and len(self.masses) != n:
            raise self._wrong(f"{len(self.masses)} masses for {n} links")

    def _check_numbers(self) -> None:
        for name, (low, high), home in zip(self.joint_names, self.ranges, self.home, strict=True):
            low_deg, high_deg, home_deg = np.degrees([low, high, home])
            if low >= high:
                raise self._wrong(f"joint {name}: its range {low_deg:g}° to {high_deg:g}° is empty")
            if not low <= home <= high:
                raise self._wrong(
                    f"joint {name}: home at {home_deg:g}° lies outside {low_deg:g}° to {high_deg:g}°"
                )
        for what in ("velocity", "acceleration", "jerk", "steps_per_rad"):
            for name, value in zip(self.joint_names, getattr(self, what), strict=True):
                if value <= 0:
                    raise self._wrong(f"joint {name}: {what} is {value:g}, but has to be above 0")
        for body in self.bodies:
            if not 0 <= body.link <= self.n or body.radius <= 0:
                raise self._wrong(
                    f"a body on link {body.link} with radius {body.radius:g} mm: links are 0 to {self.n}, "
                    "radii above 0"
                )

    def _check_coupling(self) -> None:
        condition = float(np.linalg.cond(self.coupling))
        if not condition < _WORST_CONDITION:
            raise self._wrong(
                f"the coupling matrix cannot be inverted (condition number {condition:.2g}, allowed below "
                f"{_WORST_CONDITION:.0e}): two joints would hang on the same motors",
                hint="Each row gives a motor's angle from the joints' angles; without coupling it is the "
                "identity.",
            )

    def _wrong(self, what: str, hint: str = "Correct the arm's parameter file.") -> ConfigError:
        return ConfigError(f"Arm {self.name}: {what}.", hint=hint)


_WORST_CONDITION = 1e6


def frozen_array(values: npt.ArrayLike) -> Array:
    """A copy that cannot be written to."""
    out = np.array(values, dtype=np.float64)
    out.setflags(write=False)
    return out
