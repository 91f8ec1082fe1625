"""Where the board stands: its pose in the robot's frame from two to four touched corners.

The robot drives its tool point to corners of the playing field; their coordinates give the board's position,
turn, height and tilt, and the side of its squares. Method: a plane through the touched points (least squares
on z), then the best similarity or rigid motion within that plane (weighted least squares, closed form in
complex numbers; see B. K. P. Horn, "Closed-form solution of absolute orientation using unit quaternions",
JOSA A 4 (1987), section 4, for the same result in space). Two corners leave the tilt across their line
unknown: it is taken to be none.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from itertools import combinations
from math import degrees, radians
from typing import Literal

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import CalibrationError
from kempelen.core.geometry import Array, Transform

CORNERS: tuple[str, ...] = ("a1", "h1", "h8", "a8")
"""The four corners of the playing field, anticlockwise seen from above."""

CALIBRATION_VERSION = 1
SQUARE_RANGE = (15.0, 120.0)
"""Sides of squares that are believed, mm."""

Touched = Literal["corner", "centre"]
"""What was touched: the outer corners of the playing field, or the centres of its corner squares."""

_UNIT: Mapping[str, tuple[int, int]] = {"a1": (0, 0), "h1": (1, 0), "h8": (1, 1), "a8": (0, 1)}
_INSET: Mapping[Touched, float] = {"corner": 0.0, "centre": 0.5}
_SAME_POINT = 10.0  # mm: two corners of the smallest believable board are over ten times as far apart


@dataclass(frozen=True, slots=True)
class Tolerances:
    """What is still believed to be a board.

    Attributes:
        residual: Largest distance of a touched point from where the fitted board has it, mm.
        scale: Largest relative difference of the measured square from the known one.
        tilt: Largest angle between the robot's z axis and the board's, rad.
    """

    residual: float = 1.5
    scale: float = 0.005
    tilt: float = radians(2.0)


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A measured board.

    Attributes:
        robot_from_board: Pose; the board's origin is a1's outer corner on the playing surface, x towards h1,
            y towards a8.
        square: Side of a square, mm.
        corners: The points touched, (3,) mm each, robot frame, by the corner's name.
        residuals: Distance of each from where the fitted board has it, mm.
        rms: Root of their mean square, mm.
        date: When it was measured.
        known_square: The side that was given; None when it was measured.
        touched: Whether ``corners`` are outer corners or centres of the corner squares.
        weights: Trust in each corner, relative.
        version: Of this record's meaning.
    """

    robot_from_board: Transform
    square: float
    corners: Mapping[str, tuple[float, float, float]]
    residuals: Mapping[str, float]
    rms: float
    date: datetime
    known_square: float | None = None
    touched: Touched = "corner"
    weights: Mapping[str, float] = field(default_factory=dict)
    version: int = CALIBRATION_VERSION

    @property
    def checked(self) -> bool:
        """Whether the residual says anything: two corners with an unknown square fit any pair of points."""
        return len(self.corners) > 2 or self.known_square is not None  # noqa: PLR2004 - two points, by name above

    def __str__(self) -> str:
        x, y, z = self.robot_from_board.translation
        pose = self.robot_from_board
        return (
            f"a1 at ({x:.1f}, {y:.1f}, {z:.1f}) mm, turned {degrees(pose.yaw):.2f}°, tilted "
            f"{degrees(pose.tilt):.2f}°, squares {self.square:.2f} mm, residual {self.rms:.2f} mm "
            f"over {len(self.corners)} corners, {self.date:%Y-%m-%d %H:%M}"
        )


def calibrate(
    corners: Mapping[str, npt.ArrayLike],
    *,
    date: datetime,
    square: float | None = None,
    touched: Touched = "corner",
    weights: Mapping[str, float] | None = None,
    tolerances: Tolerances | None = None,
) -> Calibration:
    """Measure the board from touched corners.

    Args:
        corners: Two to four of `CORNERS`, each with the (3,) point of the playing surface that the robot
            touched, robot frame, mm.
        date: When.
        square: Side of a square, mm, when it is known; otherwise it is measured too.
        touched: Whether the points are outer corners or centres of the corner squares.
        weights: Trust in each corner, relative; 1 where none is given.
        tolerances: What is still believed; the defaults suit a hand-driven gantry.

    Raises:
        CalibrationError: unknown, too few, doubled, swapped or mirrored corners; not a square; scale, tilt or
            residual beyond the tolerance, each with its number.
    """
    limits = tolerances or Tolerances()
    points = _checked_points(corners)
    trust = _checked_weights(points, weights or {})
    _check_square(square)
    _check_distinct(points)
    fit = _fit(points, trust, square, touched)
    if not fit.within(limits):
        _refuse(points, fit, limits, _mistaken_names(points, trust, square, touched, limits))
    _check_square(fit.square)
    return Calibration(
        robot_from_board=fit.pose,
        square=fit.square,
        corners={name: (float(p[0]), float(p[1]), float(p[2])) for name, p in points.items()},
        residuals=fit.residuals,
        rms=fit.rms,
        date=date,
        known_square=square,
        touched=touched,
        weights=trust,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """A board through touched points, believed or not."""

    pose: Transform
    square: float
    scale: float  # measured square over the known one
    residuals: Mapping[str, float]
    rms: float

    @property
    def worst(self) -> str:
        return max(self.residuals, key=lambda name: self.residuals[name])

    def within(self, limits: Tolerances) -> bool:
        return (
            abs(self.scale - 1) <= limits.scale
            and self.residuals[self.worst] <= limits.residual
            and self.pose.tilt <= limits.tilt
        )


def _fit(points: Mapping[str, Array], trust: Mapping[str, float], square: float | None, at: Touched) -> _Fit:
    names = tuple(points)
    weight = np.array([trust[name] for name in names])
    robot = np.array([points[name] for name in names])  # (n, 3)
    ideal = np.array([_ideal(name, at) for name in names])  # (n, 2) squares
    tilt = _tilt(robot, weight)
    centre = weight @ robot / weight.sum()
    level = (robot - centre) @ tilt.rotation  # (n, 3): tilt's inverse
    ideal_centre = weight @ ideal / weight.sum()
    # Within the plane: measured = turn_and_scale * ideal, both about their centres, as complex numbers.
    measured = level[:, 0] + 1j * level[:, 1]
    wanted = (ideal - ideal_centre) @ np.array([1, 1j])
    turn_and_scale = complex((weight * wanted.conj()) @ measured / (weight @ np.abs(wanted) ** 2))
    estimated = abs(turn_and_scale)
    side = estimated if square is None else square
    rotation = tilt @ Transform.about_z(float(np.angle(turn_and_scale)))
    offset = rotation @ np.append(ideal_centre * side, 0.0)
    pose = Transform(rotation.rotation, centre - offset)
    off = pose @ np.column_stack([ideal * side, np.zeros(len(names))]) - robot
    lengths = np.linalg.norm(off, axis=1)
    return _Fit(
        pose=pose,
        square=float(side),
        scale=float(estimated / side) if side > 0 else float("inf"),
        residuals=dict(zip(names, lengths.tolist(), strict=True)),
        rms=float(np.sqrt(np.mean(lengths**2))),
    )


def _ideal(name: str, at: Touched) -> tuple[float, float]:
    """Where a touched point lies on an ideal board, in squares from a1's outer corner."""
    inset = _INSET[at]
    x, y = (inset + far * (8 - 2 * inset) for far in _UNIT[name])
    return x, y


def _tilt(robot: Array, weight: Array) -> Transform:
    """The smallest turn that takes z to the normal of the plane through the points (n, 3)."""
    centred = robot - weight @ robot / weight.sum()
    root = np.sqrt(weight)
    # lstsq gives the least-norm slope: for two points, none across their line.
    slope = np.linalg.lstsq(centred[:, :2] * root[:, None], centred[:, 2] * root, rcond=None)[0]
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1.0 + slope @ slope)
    axis = np.cross([0.0, 0.0, 1.0], normal)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return Transform(np.eye(3) + cross + cross @ cross / (1.0 + normal[2]), np.zeros(3))  # Rodrigues


# --- refusals -----------------------------------------------------------------------------------------------


def _checked_points(corners: Mapping[str, npt.ArrayLike]) -> dict[str, Array]:
    unknown = [name for name in corners if name not in CORNERS]
    if unknown:
        raise CalibrationError(
            f"'{unknown[0]}' is no corner of the board.", hint=f"Corners are {', '.join(CORNERS)}."
        )
    if len(corners) < 2:  # noqa: PLR2004 - two points make a line
        raise CalibrationError(
            f"{len(corners)} corner(s) touched: two to four are needed.", hint="Touch one more corner."
        )
    points: dict[str, Array] = {}
    for name in CORNERS:
        if name in corners:
            point = np.asarray(corners[name], dtype=np.float64)
            if point.shape != (3,) or not np.isfinite(point).all():
                raise CalibrationError(
                    f"Corner {name} is not three finite numbers: {corners[name]!r}.",
                    hint=f"Touch {name} again.",
                )
            points[name] = point
    return points


def _checked_weights(points: Iterable[str], weights: Mapping[str, float]) -> dict[str, float]:
    trust = {name: float(weights.get(name, 1.0)) for name in points}
    for name, value in trust.items():
        if not 0 < value < np.inf:
            raise CalibrationError(f"The weight of corner {name} is {value}.", hint="Weights are above 0.")
    return trust


def _check_square(square: float | None) -> None:
    low, high = SQUARE_RANGE
    if square is not None and not low <= square <= high:
        raise CalibrationError(
            f"Squares of {square:.2f} mm: a board has {low:.0f} to {high:.0f} mm.",
            hint="Touch the outer corners of the playing field, and name the square's side in millimetres.",
        )


def _check_distinct(points: Mapping[str, Array]) -> None:
    for one, other in combinations(points, 2):
        apart = float(np.linalg.norm(points[one][:2] - points[other][:2]))
        if apart < _SAME_POINT:
            raise CalibrationError(
                f"Corners {one} and {other} are only {apart:.1f} mm apart, seen from above: "
                "the same corner was touched twice.",
                hint=f"Touch {one} and {other} again.",
            )


def _mistaken_names(
    points: Mapping[str, Array],
    trust: Mapping[str, float],
    square: float | None,
    at: Touched,
    limits: Tolerances,
) -> list[tuple[str, str]]:
    """Pairs of names whose exchange would make the points a board."""
    found = []
    for one, other in combinations(CORNERS, 2):
        names = {one: other, other: one}
        renamed = {names.get(name, name): point for name, point in points.items()}
        weights = {names.get(name, name): value for name, value in trust.items()}
        if set(names) & set(points) and _fit(renamed, weights, square, at).within(limits):
            found.append((one, other))
    return found


def _refuse(
    points: Mapping[str, Array], fit: _Fit, limits: Tolerances, mistaken: list[tuple[str, str]]
) -> None:
    if mistaken:
        raise CalibrationError(
            f"Corners {_swaps(points, mistaken)} ({_sizes(points)}).",
            hint="Seen from above, a1, h1, h8, a8 run anticlockwise. Touch them again in that order.",
        )
    if fit.pose.tilt > limits.tilt:
        raise CalibrationError(
            f"The board is tilted by {degrees(fit.pose.tilt):.2f}°, at most {degrees(limits.tilt):.2f}° is "
            f"allowed ({_heights(points)}).",
            hint="Level the board, or touch the corner whose height looks wrong again.",
        )
    if abs(fit.scale - 1) > limits.scale:
        raise CalibrationError(
            f"The corners say squares of {fit.scale * fit.square:.2f} mm, the configuration says "
            f"{fit.square:.2f} mm: {100 * (fit.scale - 1):+.1f} %, at most ±{100 * limits.scale:.1f} % is "
            f"allowed ({_sizes(points)}).",
            hint="Correct the square's side in the configuration, or touch the corners again.",
        )
    raise CalibrationError(
        f"The corners are no square: {fit.worst} is {fit.residuals[fit.worst]:.1f} mm off the best fit, "
        f"at most {limits.residual:.1f} mm is allowed ({_sizes(points)}).",
        hint=f"Touch {fit.worst} again, then the others.",
    )


def _swaps(points: Mapping[str, Array], mistaken: list[tuple[str, str]]) -> str:
    """The likely mistakes in words: swapped where both were touched, misnamed where one was."""
    swapped = [pair for pair in mistaken if set(pair) <= set(points)]
    if swapped:
        return (
            " (or ".join(f"{one} and {other}" for one, other in swapped) + _close(swapped) + " look swapped"
        )
    named = [(one, other) if one in points else (other, one) for one, other in mistaken]
    return (
        "look misnamed: " + " (or ".join(f"{given} is where {meant} would be" for given, meant in named)
    ) + _close(named)


def _close(alternatives: list[tuple[str, str]]) -> str:
    return ")" * (len(alternatives) - 1)


def _heights(points: Mapping[str, Array]) -> str:
    return ", ".join(f"{name} at {point[2]:.1f} mm" for name, point in points.items())


def _sizes(points: Mapping[str, Array]) -> str:
    """Distances between the touched points and the angles at them, in words."""
    sides = [
        f"{one}-{other} {np.linalg.norm(points[one] - points[other]):.1f} mm"
        for one, other in combinations(points, 2)
    ]
    return ", ".join(sides + _angles(points))


def _angles(points: Mapping[str, Array]) -> list[str]:
    said = []
    for i, name in enumerate(CORNERS):
        before, after = CORNERS[i - 1], CORNERS[(i + 1) % 4]
        if {before, name, after} <= set(points):
            u, v = points[before] - points[name], points[after] - points[name]
            cosine = float(u @ v / (np.linalg.norm(u) * np.linalg.norm(v)))
            said.append(f"angle at {name} {degrees(np.arccos(np.clip(cosine, -1, 1))):.1f}°")
    return said
