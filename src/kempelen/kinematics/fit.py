"""An arm's true measures from points that it has touched, or where it has been seen.

Unknown are the base's pose, an offset of each joint and the lengths of the links. Gauss-Newton on the
distances, with priors, so that a few points do not bend what they say little about; and what they say
nothing about (the base joint's offset turns all points just as the base's own yaw does) is left as it was,
and named.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from kempelen.core.errors import CalibrationError
from kempelen.core.geometry import Array, Transform
from kempelen.kinematics.arm import Arm, Link
from kempelen.kinematics.chain import checked_joints, forward

LEAST_POINTS = 10
"""Fewer points do not settle base, offsets and lengths."""

_LEARNT = 0.5
"""A number counts as told by the points when they bring its spread below this share of the prior one."""


@dataclass(frozen=True, slots=True)
class Priors:
    """How far the numbers may be from what was known: standard deviations.

    Attributes:
        place: Of the base, mm.
        turn: Of the base about its upright axis, rad.
        lean: Of the base from upright, rad.
        offset: Of a joint, rad.
        length: Of a link's a and d, mm.
        point: Of a touched or seen point, mm.
    """

    place: float = 200.0
    turn: float = 0.5
    lean: float = 0.03
    offset: float = 0.05
    length: float = 1.0
    point: float = 0.5


class Value(NamedTuple):
    """A number found.

    Attributes:
        value: Change against what was known: mm or rad.
        spread: Its standard deviation.
    """

    value: float
    spread: float


@dataclass(frozen=True, slots=True, eq=False)
class ArmFit:
    """An arm as the points tell it.

    Attributes:
        arm: With its offsets and lengths.
        table_from_robot: The base's pose.
        values: What was found, by name: ``base x``, ``offset elbow``, ``a shoulder``, ``d roll``, ...
        left: Names of what the points do not determine; it is as it was.
        residuals: (m,) mm, distance of each point.
    """

    arm: Arm
    table_from_robot: Transform
    values: Mapping[str, Value]
    left: tuple[str, ...]
    residuals: Array

    @property
    def rms(self) -> float:
        """Root of the mean square of the residuals, mm."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def worst(self) -> int:
        """Number of the point that fits least, from 0."""
        return int(self.residuals.argmax())


def fit_arm(
    arm: Arm,
    joints: npt.ArrayLike,
    points: npt.ArrayLike,
    table_from_robot: Transform | None = None,
    priors: Priors | None = None,
) -> ArmFit:
    """Fit base pose, joint offsets and link lengths.

    Args:
        arm: As its parameter file has it.
        joints: (m, n) rad as reported at each point.
        points: (m, 3) mm in the table's frame, where the tool point truly was; NaN for what was not
            measured, such as the height of what a camera has seen.
        table_from_robot: Where the base is thought to be; by default at the origin.
        priors: How far all may be from what was known.

    Raises:
        CalibrationError: fewer than `LEAST_POINTS`, shapes that do not go together, or points that are all
            near one line.
    """
    joints = checked_joints(arm, joints)
    points = np.asarray(points, dtype=np.float64)
    _check(joints, points)
    problem = _Problem(arm, joints, points, table_from_robot or Transform.identity(), priors or Priors())
    chosen = problem.told()
    values = problem.solve(chosen)
    spreads = problem.spreads(values, chosen)
    names = problem.names
    table, fitted = problem.taken(values)
    return ArmFit(
        arm=fitted,
        table_from_robot=table,
        values={
            names[k]: Value(float(values[k]), float(spread))
            for k, spread in zip(chosen, spreads, strict=True)
        },
        left=tuple(name for k, name in enumerate(names) if k not in set(chosen)),
        residuals=np.linalg.norm(np.nan_to_num(problem.off(values)), axis=1),
    )


class _Problem:
    """Numbers in one vector: six of the base, n offsets, n lengths a, n shifts d; all 0 at what was known."""

    def __init__(self, arm: Arm, joints: Array, points: Array, start: Transform, priors: Priors) -> None:
        self._arm = arm
        self._joints = joints
        self._points = points
        self._start = start
        self._known = np.isfinite(points)
        names = arm.joint_names
        self.names = (
            *(f"base {what}" for what in ("x", "y", "z", "yaw", "roll", "pitch")),
            *(f"offset {name}" for name in names),
            *(f"a {name}" for name in names),
            *(f"d {name}" for name in names),
        )
        base = [priors.place] * 3 + [priors.turn] + [priors.lean] * 2
        self._prior = np.array(base + [priors.offset] * arm.n + [priors.length] * 2 * arm.n)
        self._noise = priors.point

    def taken(self, values: Array) -> tuple[Transform, Arm]:
        """The base's pose and the arm that a vector stands for."""
        n = self._arm.n
        turn = Rotation.from_rotvec([values[4], values[5], values[3]]).as_matrix()
        start = self._start
        table = Transform(turn @ start.rotation, start.translation + values[:3])
        offsets, lengths, shifts = values[6:].reshape(3, n)
        links = tuple(
            Link(link.a + a, link.alpha, link.d + d, link.offset + offset)
            for link, offset, a, d in zip(
                self._arm.links, offsets.tolist(), lengths.tolist(), shifts.tolist(), strict=True
            )
        )
        return table, self._arm.with_links(links)

    def off(self, values: Array) -> Array:
        """(m, 3) mm from the points to where the arm would have been."""
        table, arm = self.taken(values)
        return table @ forward(arm, self._joints)[:, :3, 3] - self._points

    def told(self) -> list[int]:
        """Numbers that the points determine: each, the base's first, adds to what those before it explain."""
        slope = self._slope(np.zeros(len(self.names))) * self._prior / self._noise
        chosen: list[int] = []
        for number in range(len(self.names)):
            trial = [*chosen, number]
            # with priors of one each, the last one's spread after the points have spoken
            information = slope[:, trial].T @ slope[:, trial] + np.eye(len(trial))
            spread = float(np.sqrt(np.linalg.inv(information)[-1, -1]))
            if spread < _LEARNT:
                chosen = trial
        return chosen

    def solve(self, chosen: list[int]) -> Array:
        """The best vector with all but the chosen numbers 0."""
        weight = self._prior[chosen]

        def misses(scaled: Array) -> Array:
            values = self._filled(scaled * weight, chosen)
            return np.concatenate([self.off(values)[self._known] / self._noise, scaled])

        found = least_squares(misses, np.zeros(len(chosen)), x_scale="jac", method="trf")
        return self._filled(found.x * weight, chosen)

    def spreads(self, values: Array, chosen: list[int]) -> Array:
        """(k,) standard deviations of the chosen numbers."""
        slope = self._slope(values)[:, chosen] / self._noise
        information = slope.T @ slope + np.diag(1 / self._prior[chosen] ** 2)
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(information))))

    def _filled(self, some: Array, chosen: list[int]) -> Array:
        values = np.zeros(len(self.names))
        values[chosen] = some
        return values

    def _slope(self, values: Array) -> Array:
        """(known coordinates, numbers): derivatives by central differences."""
        return _slope(lambda one: self.off(one)[self._known], values, 1e-5 * np.maximum(self._prior, 1.0))


def _slope(function: Callable[[Array], Array], at: Array, steps: Array) -> Array:
    columns = [
        (function(at + step * unit) - function(at - step * unit)) / (2 * step)
        for step, unit in zip(steps, np.eye(len(at)), strict=True)
    ]
    return np.stack(columns, axis=1)


def _check(joints: Array, points: Array) -> None:
    if joints.ndim != 2 or points.shape != (len(joints), 3):  # noqa: PLR2004 - rows of joints
        raise CalibrationError(
            f"Joints of shape {joints.shape} and points of shape {points.shape} do not go together.",
            hint="One row of joints and one point (x, y, z) each.",
        )
    if len(points) < LEAST_POINTS:
        raise CalibrationError(
            f"{len(points)} points were measured; at least {LEAST_POINTS} are needed.",
            hint="Touch more points, far apart.",
        )
    seen = points[np.isfinite(points[:, :2]).all(axis=1), :2]
    if len(seen) < LEAST_POINTS:
        raise CalibrationError(
            f"Only {len(seen)} points have both x and y; at least {LEAST_POINTS} are needed.",
            hint="Measure x and y of each point; the height may be left out.",
        )
    narrow = float(np.linalg.svd(seen - seen.mean(axis=0), compute_uv=False)[-1] / np.sqrt(len(seen)))
    if narrow < _LEAST_WIDTH:
        raise CalibrationError(
            f"The points lie within {narrow:.1f} mm of one line; they have to spread by "
            f"{_LEAST_WIDTH:.0f} mm at least.",
            hint="Touch points all over the board, the corners among them.",
        )


_LEAST_WIDTH = 10.0  # mm
