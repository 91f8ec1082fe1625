"""Circular arcs as GRBL checks them and cuts them into lines."""

from math import atan2, cos, hypot, pi, sin, sqrt

from kempelen.twin.grbl.settings import Vec
from kempelen.twin.grbl.status import Status
from kempelen.twin.grbl.words import GcodeError

Pair = tuple[float, float]

_FULL_TURN = 5e-7  # rad: below this an arc that ends where it began is a full circle
_RADIUS_TOLERANCE = 0.005  # mm
_RADIUS_LIMIT = 0.5  # mm
_RADIUS_SHARE = 0.001
_MAX_SEGMENTS = 0xFFFF


def arc_from_radius(chord: Pair, radius: float, *, clockwise: bool) -> Pair:
    """Centre relative to the start, mm, of the arc over ``chord``; a negative radius takes the long way.

    Raises:
        GcodeError: the radius is too small for the chord.
    """
    x, y = chord
    room = 4.0 * radius * radius - x * x - y * y
    distance = hypot(x, y)
    if room < 0.0:
        raise GcodeError(Status.ARC_RADIUS_ERROR)
    if distance == 0.0:  # the plane's part of a helix without a chord has no centre
        raise GcodeError(Status.INVALID_TARGET)
    height = -sqrt(room) / distance
    if clockwise == (radius < 0.0):
        height = -height
    return (0.5 * (x - y * height), 0.5 * (y + x * height))


def check_centre(chord: Pair, centre: Pair) -> None:
    """Check that start and end are equally far from the centre.

    Raises:
        GcodeError: they are not, by more than 0.5 mm or 0.1 % of the radius (at least 0.005 mm).
    """
    radius = hypot(*centre)
    error = abs(hypot(chord[0] - centre[0], chord[1] - centre[1]) - radius)
    if error > _RADIUS_TOLERANCE and (error > _RADIUS_LIMIT or error > _RADIUS_SHARE * radius):
        raise GcodeError(Status.INVALID_TARGET)


def arc_points(
    start: Vec, target: Vec, centre: Pair, plane: tuple[int, int, int], *, clockwise: bool, tolerance: float
) -> list[Vec]:
    """Ends of the lines that stand for the arc, ``target`` last, machine frame, mm.

    Args:
        start: Where it begins.
        target: Where it ends.
        centre: Relative to the start, in the plane.
        plane: Indices of the plane's two axes and of the one across.
        clockwise: Seen against the axis across.
        tolerance: $12, how far a line may be off the arc, mm.
    """
    first, second, _ = plane
    middle = (start[first] + centre[0], start[second] + centre[1])
    from_x, from_y = -centre[0], -centre[1]
    to_x, to_y = target[first] - middle[0], target[second] - middle[1]
    turn = atan2(from_x * to_y - from_y * to_x, from_x * to_x + from_y * to_y)
    if clockwise and turn >= -_FULL_TURN:
        turn -= 2.0 * pi
    elif not clockwise and turn <= _FULL_TURN:
        turn += 2.0 * pi
    count = _segments(turn, hypot(*centre), tolerance)
    points: list[Vec] = []
    for index in range(1, count):
        angle = turn * index / count
        point = [begin + (end - begin) * index / count for begin, end in zip(start, target, strict=True)]
        point[first] = middle[0] + from_x * cos(angle) - from_y * sin(angle)
        point[second] = middle[1] + from_x * sin(angle) + from_y * cos(angle)
        points.append(tuple(point))
    points.append(target)
    return points


def _segments(turn: float, radius: float, tolerance: float) -> int:
    sagitta = tolerance * (2.0 * radius - tolerance)
    if sagitta <= 0.0:
        return 0
    return min(int(abs(0.5 * turn * radius) / sqrt(sagitta)), _MAX_SEGMENTS)
