"""Ways over the standing pieces, by name: the one that is used, and the ones to compare it with."""

from collections.abc import Callable, Mapping

from kempelen.core.errors import MotionError
from kempelen.core.pieces import KINDS
from kempelen.core.surfaces import Point
from kempelen.motion import race, supercover
from kempelen.motion.cutting import cut
from kempelen.motion.leg import Leg

Planner = Callable[[Leg], list[Point]]
"""From a leg to the vertices of its path, start and end included."""


def asynchronous(leg: Leg) -> list[Point]:
    """Every axis at its own limits: z at once, the horizontal axes as soon as z allows (see `race`)."""
    if leg.length == 0.0:
        return [leg.start, leg.end]
    return [leg.at(s, z) for s, z in cut(leg, race.run(leg))]


def safe_height(leg: Leg) -> list[Point]:
    """Straight up to one fixed height over everything that may stand on the table, across, straight down."""
    if leg.length == 0.0:
        return [leg.start, leg.end]
    table, clearance = leg.scene.table, leg.scene.clearances.vertical
    pieces, up = table.pieces, table.upwards[2]
    hang = max(table.gripper.below_tool, *(pieces[kind].grip_height for kind in KINDS))
    floor = max(float(table.centre(place)[2]) for place in table.places)
    height = max(floor + up * pieces.tallest + hang + clearance, leg.rise)
    if height > table.space.upper[2]:
        raise MotionError(
            f"{leg.title}: the safe height is z = {height:.1f} mm; the work space ends at "
            f"{table.space.upper[2]:.1f} mm, {height - table.space.upper[2]:.1f} mm too low.",
            hint="Use the asynchronous planner, which climbs no higher than the pieces on its way.",
        )
    return _without_repeats([leg.start, leg.at(0.0, height), leg.at(leg.length, height), leg.end])


def thesis(leg: Leg) -> list[Point]:
    """The supercover heuristic; for carrying only: the empty hand goes at the safe height."""
    if leg.held is None or leg.length == 0.0:
        return safe_height(leg)
    profile = supercover.heights(leg)
    return _without_repeats([leg.start, *(leg.at(s, z) for s, z in profile), leg.end])


PLANNERS: Mapping[str, Planner] = {
    "asynchronous": asynchronous,
    "safe-height": safe_height,
    "supercover": thesis,
}
DEFAULT_PLANNER = "asynchronous"


def planner_named(name: str) -> Planner:
    """Look a planner up.

    Raises:
        MotionError: there is none of that name.
    """
    try:
        return PLANNERS[name]
    except KeyError:
        raise MotionError(
            f"There is no planner '{name}'.", hint=f"Choose one of: {', '.join(PLANNERS)}."
        ) from None


def _without_repeats(points: list[Point]) -> list[Point]:
    return [point for i, point in enumerate(points) if i == 0 or point != points[i - 1]]
