"""Where an arm reaches, how far its gripper has to lean there, and where a board is best put before it."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import ReachError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.tilt import MOST_TILT, least_tilts

SQUARES = 8
_FINE = 0.05  # mm, to which the largest square is found
_LARGEST = 120.0  # mm
_CLEAR = 5.0  # mm between base and board
_STRIDE = 20.0  # mm between the distances that are tried first


@dataclass(frozen=True, slots=True, eq=False)
class Workspace:
    """Least tilt in the arm's upright plane.

    Attributes:
        radial: (k,) mm from the base's axis.
        up: (m,) mm above the base's foot.
        tilt: (m, k) rad; NaN out of reach.
    """

    radial: Array
    up: Array
    tilt: Array

    def rings(self, most: float) -> Array:
        """(j, 3) mm: heights with the least and greatest radius that a tilt up to ``most`` reaches."""
        there = np.abs(self.tilt) <= most
        rows = np.flatnonzero(there.any(axis=1))
        inner = self.radial[there[rows].argmax(axis=1)]
        outer = self.radial[::-1][there[rows][:, ::-1].argmax(axis=1)]
        return np.stack([self.up[rows], inner, outer], axis=1)


def workspace(arm: Arm, step: float = 10.0, most: float = MOST_TILT) -> Workspace:
    """The plane ahead of the base, looked at every ``step`` mm as far as the links could ever reach."""
    length = sum(abs(link.a) + abs(link.d) for link in arm.links[1:])
    foot = arm.links[0].d
    radial = np.arange(step / 2, length + step, step)
    up = np.arange(foot - length, foot + length + step, step)
    ahead = float(arm.ranges[0].mean())
    out, height = np.meshgrid(radial, up)
    points = np.stack([out * np.cos(ahead), out * np.sin(ahead), height], axis=-1)
    return Workspace(radial, up, least_tilts(arm, points, most))


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A board straight ahead of an arm: its ranks lie across, its middle before the base's axis.

    Attributes:
        square: Side of a square, mm.
        distance: From the base's axis to the middle of the nearest squares, mm.
        surface: Height of the playing surface above the base's foot, mm.
        tilts: (8, 8) rad: the largest of the least tilts at the heights asked for, by rank away from the arm
            and file from right to left as the arm sees it; NaN out of reach.
    """

    square: float
    distance: float
    surface: float
    tilts: Array

    @property
    def reached(self) -> bool:
        """Whether the arm serves all 64 squares."""
        return bool(np.isfinite(self.tilts).all())

    @property
    def worst(self) -> float:
        """The largest tilt, rad; infinite where a square is out of reach."""
        return float(np.abs(self.tilts).max()) if self.reached else np.inf

    @property
    def tilted(self) -> int:
        """How many squares need tilt."""
        return int((np.abs(self.tilts) > _UPRIGHT).sum())


_UPRIGHT = float(np.radians(0.01))


def base_radius(arm: Arm) -> float:
    """How far from the base's axis a board has to end, mm: the base's bodies, and a little."""
    of_base = [body for body in arm.bodies if body.link == 0]
    return max(
        (hypot(*end[:2]) + body.radius + _CLEAR for body in of_base for end in body[1:3]), default=_CLEAR
    )


def place_board(  # noqa: PLR0917 - a place has that many numbers
    arm: Arm,
    square: float,
    distance: float,
    surface: float,
    heights: Sequence[float],
    most: float = MOST_TILT,
) -> Placement:
    """How a board at a given place is served.

    Args:
        arm: The arm.
        square: Side of a square, mm.
        distance: From the base's axis to the middle of the nearest squares, mm.
        surface: Of the board above the base's foot, mm.
        heights: Of the tool point above the surface that have to be reached, mm.
        most: Greatest tilt allowed, rad.
    """
    points = _centres(square)[None] + np.array([[distance, 0.0, surface]])
    tall = np.asarray(heights, dtype=np.float64)[:, None, None]
    tilts = least_tilts(arm, points + tall * np.array([0.0, 0.0, 1.0]), most)
    worst = np.take_along_axis(tilts, np.abs(tilts).argmax(axis=0)[None], axis=0)[0]
    return Placement(square, distance, surface, worst.reshape(SQUARES, SQUARES))


def best_placement(
    arm: Arm,
    square: float,
    surfaces: Sequence[float],
    heights: Sequence[float],
    most: float = MOST_TILT,
) -> Placement:
    """Where to put a board so that the gripper has to lean least (after Yang: placement for given targets).

    All distances are tried, every 5 mm and then every mm around the best; of equal ones the middle of those
    that are.

    Args:
        arm: The arm.
        square: Side of a square, mm.
        surfaces: Heights of the playing surface to try, mm above the base's foot.
        heights: Of the tool point above the surface that have to be reached, mm.
        most: Greatest tilt allowed, rad.

    Raises:
        ReachError: the board fits nowhere; the message says how large one would.
    """
    reach = sum(abs(link.a) + abs(link.d) for link in arm.links)
    tried = [
        place_board(arm, square, float(distance), surface, heights, most)
        for surface in surfaces
        for distance in np.arange(base_radius(arm) + square / 2, reach, 5.0)
    ]
    best = _middle_of_best(tried)
    if best is None:
        largest = largest_square(arm, surfaces, heights, most)
        raise ReachError(
            f"Arm {arm.name} cannot serve a board with squares of {square:.1f} mm anywhere before it with a "
            f"tilt up to {np.degrees(most):.0f}°; squares of {largest:.1f} mm are the largest.",
            hint="Use smaller squares, or allow more tilt.",
        )
    around = [
        place_board(arm, square, max(best.distance + shift, tried[0].distance), best.surface, heights, most)
        for shift in np.arange(-4, 5)
    ]
    return _middle_of_best(around) or best


def largest_square(
    arm: Arm,
    surfaces: Sequence[float],
    heights: Sequence[float],
    most: float,
    *,
    distance: float | None = None,
) -> float:
    """Side of the largest square, mm, of a board whose 64 squares are all within reach, or 0.

    Args:
        arm: The arm.
        surfaces: Heights of the playing surface to try, mm.
        heights: Of the tool point above the surface, mm.
        most: Greatest tilt allowed, rad.
        distance: From the base's axis to the middle of the nearest squares, mm; any by default.
    """
    reach = sum(abs(link.a) + abs(link.d) for link in arm.links)
    distances = np.arange(10.0, reach, _STRIDE) if distance is None else np.array([distance])
    best = (0.0, float(distances[0]), surfaces[0])
    for surface in surfaces:
        for away in distances.tolist():
            best = max(best, (_larger(arm, best[0], away, surface, heights, most), away, surface))
    if distance is None:
        for away in np.linspace(best[1] - _STRIDE, best[1] + _STRIDE, 17).tolist():
            best = max(best, (_larger(arm, best[0], away, best[2], heights, most), away, best[2]))
    return best[0]


def _larger(  # noqa: PLR0917 - a place has that many numbers
    arm: Arm, than: float, distance: float, surface: float, heights: Sequence[float], most: float
) -> float:
    """By halving, above ``than``; 0 where none is larger: a larger board holds farther places."""
    clear = base_radius(arm)

    def fits(square: float) -> bool:
        near = distance - square / 2 >= clear
        return near and place_board(arm, square, distance, surface, heights, most).reached

    low, high = than + _FINE, _LARGEST
    if not fits(low):
        return 0.0
    while high - low > _FINE:
        middle = (low + high) / 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def _middle_of_best(placements: Sequence[Placement]) -> Placement | None:
    least = min(one.worst for one in placements)
    if not np.isfinite(least):
        return None
    best = [one for one in placements if one.worst <= least + _UPRIGHT]
    mine = [one for one in best if one.surface == best[0].surface]
    return mine[len(mine) // 2]


def _centres(square: float) -> npt.NDArray[np.float64]:
    """(64, 3) mm from the middle of the nearest rank: x away from the arm, y to its left."""
    index = np.arange(SQUARES)
    away, left = np.meshgrid(index * square, (index - (SQUARES - 1) / 2) * square, indexing="ij")
    return np.stack([away.ravel(), left.ravel(), np.zeros(away.size)], axis=1)
