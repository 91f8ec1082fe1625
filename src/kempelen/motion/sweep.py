"""The independent check: what would the machine touch if it drove these vertices?

Knows nothing of planners, legs or hurdles: only the polyline that the controller gets, the scene and
what the fingers hold. Exact for the hand's true shape: two finger boxes, the piece between them, the
palm. Everything is grown by what the machine may be off: the wire's last digit, the rounding of corners
(junction deviation) and the servos' lag.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, hypot, inf, sin, sqrt
from typing import NamedTuple

import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceShape
from kempelen.core.surfaces import Point, Surface
from kempelen.core.table import Gripper
from kempelen.motion.scene import Scene

WIRE_RESOLUTION = 0.001
"""Three decimals, mm."""
_TOUCHING = 1e-9


@dataclass(frozen=True, slots=True)
class Contact:
    """Something that would be touched.

    Attributes:
        part: Of the hand: ``"a finger"``, ``"the carried piece"``, ``"the palm"``, ``"the tool point"``.
        what: ``"the black pawn on f2"``, ``"the board"``, ``"the work space's end"``.
        depth: By how much, mm: the least by which the hand would have to pass higher or farther off.
        at: (x, y, z) of the tool point, mm.
    """

    part: str
    what: str
    depth: float
    at: Point

    def __str__(self) -> str:
        x, y, z = self.at
        return f"{self.part} would touch {self.what} by {self.depth:.1f} mm at ({x:.1f}, {y:.1f}, {z:.1f}) mm"


def slack(scene: Scene) -> float:
    """How far the machine may be from the commanded polyline, mm."""
    return WIRE_RESOLUTION + scene.table.space.junction_deviation + scene.clearances.servo_lag


def sweep(vertices: Array, scene: Scene, held: PieceShape | None) -> list[Contact]:
    """Everything that driving ``vertices`` (n, 3) mm would touch, deepest first.

    Args:
        vertices: Robot frame; the controller goes straight from each to the next.
        scene: What stands, without what is held. A piece on whose place the tool point starts or ends is
            the one to be gripped or just released: it may be between the fingers.
        held: The piece in the closed fingers; None with open fingers.
    """
    contacts = [
        *_outside(vertices, scene),
        *_surfaces(vertices, scene, held),
        *_pieces(vertices, scene, held),
    ]
    deepest: dict[tuple[str, str], Contact] = {}
    for contact in contacts:
        key = (contact.part, contact.what)
        if key not in deepest or contact.depth > deepest[key].depth:
            deepest[key] = contact
    return sorted(deepest.values(), key=lambda contact: -contact.depth)


# --- work space -------------------------------------------------------------------------------------------


def _outside(vertices: Array, scene: Scene) -> Iterator[Contact]:
    space = scene.table.space
    excess = np.maximum(np.asarray(space.lower) - vertices, vertices - np.asarray(space.upper)).max(axis=1)
    worst = int(excess.argmax())
    if excess[worst] > WIRE_RESOLUTION:
        yield Contact("the tool point", "the work space's end", float(excess[worst]), _point(vertices[worst]))


def _point(vertex: Array) -> Point:
    x, y, z = vertex.tolist()
    return x, y, z


# --- the hand's parts -------------------------------------------------------------------------------------


class _Part(NamedTuple):
    """An upright prism that moves with the tool point: a disc, or a box in the gripper's frame."""

    name: str
    bottom: float
    top: float
    radius: float
    box: tuple[float, float, float, float] | None  # x from, x to, y from, y to


def _parts(gripper: Gripper, held: PieceShape | None) -> list[_Part]:
    inner = gripper.opening / 2 if held is None else held.grip_diameter / 2
    outer, half = inner + gripper.finger_thickness, gripper.finger_width / 2
    reach = hypot(outer, half)
    low, high = -gripper.below_tool, gripper.finger_length
    parts = [
        _Part("a finger", low, high, reach, (inner, outer, -half, half)),
        _Part("a finger", low, high, reach, (-outer, -inner, -half, half)),
        _Part("the palm", high, inf, gripper.palm_radius, None),
    ]
    if held is not None:
        grip, head = held.grip_height, max(held.head_diameter, held.grip_diameter) / 2
        parts += [
            _Part("the carried piece", -grip, 0.0, held.base_diameter / 2, None),
            _Part("the carried piece", 0.0, held.height - grip, head, None),
        ]
    return parts


# --- standing pieces --------------------------------------------------------------------------------------


class _Cylinder(NamedTuple):
    x: float
    y: float
    radius: float
    bottom: float
    top: float


def _pieces(vertices: Array, scene: Scene, held: PieceShape | None) -> Iterator[Contact]:
    """Broad: which segment comes near which piece, as arrays. Narrow: those few, exactly, as floats."""
    if not scene.places or len(vertices) < 2:  # noqa: PLR2004
        return
    parts, spread, count = _parts(scene.table.gripper, held), slack(scene), len(scene.places)
    own = set() if held is not None else {
        scene.gripped_at(_point(vertices[end])) for end in (0, -1)
    }  # fmt: skip
    low = np.minimum(vertices[:-1, 2], vertices[1:, 2])  # (n,)
    tops = scene.top[count:] + spread
    radii = np.maximum(scene.radius[:count], scene.radius[count:]) + spread
    for group in (
        [part for part in parts if part.name != "the palm"],
        [p for p in parts if p.name == "the palm"],
    ):
        bottom, reach = min(part.bottom for part in group), max(part.radius for part in group)
        deep = np.flatnonzero(low + bottom < tops.max())
        if not len(deep):
            continue
        near = _distances(vertices[deep], vertices[deep + 1], scene.axis) < radii + (reach + spread)
        near &= (low[deep] + bottom)[:, None] < tops
        for segment, piece in np.argwhere(near).tolist():
            index = int(deep[segment])
            a, b = _point(vertices[index]), _point(vertices[index + 1])
            for cylinder in _cylinders(scene, piece, own=piece in own, spread=spread):
                for part in group:
                    touch = _touch(part, cylinder, a, b, scene.table.gripper.closing_axis)
                    if touch is not None:
                        yield Contact(part.name, scene.name(piece), *touch)


def _distances(a: Array, b: Array, points: Array) -> Array:
    """(n, m) horizontal distances of m points (m, 2) from n segments ``a`` to ``b`` (n, 3)."""
    step = b[:, :2] - a[:, :2]
    square = np.maximum((step * step).sum(axis=1), _TOUCHING)
    away = points[None, :, :] - a[:, None, :2]  # (n, m, 2)
    share = np.clip((away * step[:, None, :]).sum(axis=2) / square[:, None], 0.0, 1.0)
    away -= share[:, :, None] * step[:, None, :]
    distance: Array = np.sqrt((away * away).sum(axis=2))
    return distance


def _cylinders(scene: Scene, piece: int, *, own: bool, spread: float) -> list[_Cylinder]:
    """Base and head, grown by what the machine may be off."""
    count = len(scene.places)
    base, head = (
        _Cylinder(
            float(scene.centre[row, 0]),
            float(scene.centre[row, 1]),
            float(scene.radius[row]) + spread,
            float(scene.bottom[row]) - spread,
            float(scene.top[row]) + spread,
        )
        for row in (piece, piece + count)
    )
    if not own:
        return [base, head]
    # Between the fingers: the foot, which they must not reach, begins below their tips; the passage
    # between them is where the head is, leaning with the table or not.
    x, y = scene.axis[piece].tolist()
    tips = base.top - spread - scene.table.gripper.below_tool
    shape = scene.table.pieces[scene.standing[scene.places[piece]].piece_type]
    radius = max(shape.head_diameter, shape.grip_diameter) / 2 + scene.clearances.off_centre + spread
    return [base._replace(top=tips - 2 * spread), head._replace(x=x, y=y, radius=radius)]


def _touch(part: _Part, cylinder: _Cylinder, a: Point, b: Point, angle: float) -> tuple[float, Point] | None:
    """How deep one part goes into one cylinder along one segment, and where."""
    span = _overlap(a[2], b[2], cylinder.bottom - part.top, cylinder.top - part.bottom)
    if span is None:
        return None
    a, b = _between(a, b, span[0]), _between(a, b, span[1])
    beside = cylinder.radius - _gap(part, cylinder, a, b, angle)
    if beside <= _TOUCHING:
        return None
    below = max(min(cylinder.top - part.bottom - z, z + part.top - cylinder.bottom) for z in (a[2], b[2]))
    return min(beside, below), min(a, b, key=lambda p: p[2])


def _overlap(z0: float, z1: float, low: float, high: float) -> tuple[float, float] | None:
    """The part of a segment, as shares of it, during which z is between two heights."""
    if abs(z1 - z0) < _TOUCHING:
        return (0.0, 1.0) if low < z0 < high else None
    first, last = sorted(((low - z0) / (z1 - z0), (high - z0) / (z1 - z0)))
    first, last = max(first, 0.0), min(last, 1.0)
    return (first, last) if first < last else None


def _between(a: Point, b: Point, share: float) -> Point:
    return (
        a[0] + share * (b[0] - a[0]),
        a[1] + share * (b[1] - a[1]),
        a[2] + share * (b[2] - a[2]),
    )


def _gap(part: _Part, cylinder: _Cylinder, a: Point, b: Point, angle: float) -> float:
    """Least horizontal distance from the cylinder's axis to the part, along the segment, mm."""
    # The axis as the hand sees it goes from p to q.
    p, q = (cylinder.x - a[0], cylinder.y - a[1]), (cylinder.x - b[0], cylinder.y - b[1])
    if part.box is None:
        return max(_to_segment((0.0, 0.0), p, q) - part.radius, 0.0) if part.radius else 0.0
    c, s = cos(angle), sin(angle)
    p, q = (c * p[0] + s * p[1], c * p[1] - s * p[0]), (c * q[0] + s * q[1], c * q[1] - s * q[0])
    return _to_box(p, q, part.box)


def _to_segment(point: tuple[float, float], p: tuple[float, float], q: tuple[float, float]) -> float:
    dx, dy = q[0] - p[0], q[1] - p[1]
    square = dx * dx + dy * dy
    share = 0.0 if square < _TOUCHING else ((point[0] - p[0]) * dx + (point[1] - p[1]) * dy) / square
    share = min(max(share, 0.0), 1.0)
    return hypot(p[0] + share * dx - point[0], p[1] + share * dy - point[1])


def _to_box(p: tuple[float, float], q: tuple[float, float], box: tuple[float, float, float, float]) -> float:
    """Distance of a segment from a rectangle: 0 when they meet, else between an end of one and the other."""
    first, last = 0.0, 1.0
    for a, b, low, high in ((p[0], q[0], box[0], box[1]), (p[1], q[1], box[2], box[3])):
        span = _overlap(a, b, low, high)
        if span is None:
            first, last = 1.0, 0.0
            break
        first, last = max(first, span[0]), min(last, span[1])
    if first <= last:
        return 0.0
    ends = (hypot(max(box[0] - x, x - box[1], 0.0), max(box[2] - y, y - box[3], 0.0)) for x, y in (p, q))
    corners = (_to_segment((x, y), p, q) for x in box[:2] for y in box[2:])
    return min(*ends, *corners)


# --- surfaces ---------------------------------------------------------------------------------------------


def _surfaces(vertices: Array, scene: Scene, held: PieceShape | None) -> Iterator[Contact]:
    """The lowest part must stay off board and trays, but where a carried piece is picked up and set down."""
    spread = slack(scene)
    part = min(_parts(scene.table.gripper, held), key=lambda p: p.bottom)
    highest = max(max(_corners(surface)) for surface in scene.table.surfaces)
    low = np.minimum(vertices[:-1, 2], vertices[1:, 2]) + part.bottom
    ends = (_point(vertices[0]), _point(vertices[-1]))
    reach = scene.clearances.align + spread
    for index in np.flatnonzero(low < highest + spread).tolist():
        a, b = _point(vertices[index]), _point(vertices[index + 1])
        marks = [0.0, 1.0, *(t for end in ends for t in _crossings(a, b, end, reach))]
        for surface in scene.table.surfaces:
            yield from _scrape(part, surface, a, b, (marks, ends, reach, spread))


def _corners(surface: Surface) -> Iterator[float]:
    (ax, ay), (width, depth), (x, y, _) = surface.along, surface.size, surface.corner
    for u in (0.0, width):
        for v in (0.0, depth):
            yield surface.height(x + u * ax - v * ay, y + u * ay + v * ax)


_Marks = tuple[list[float], tuple[Point, Point], float, float]


def _scrape(part: _Part, surface: Surface, a: Point, b: Point, marks: _Marks) -> Iterator[Contact]:
    """Heights are linear along the segment, so it is enough to look where something changes."""
    shares, ends, reach, spread = marks
    span = _over(surface, a, b, part.radius + spread)
    if span is None:
        return
    for share in {*span, *(s for s in shares if span[0] <= s <= span[1])}:
        point = _between(a, b, share)
        clear = point[2] + part.bottom - surface.height(point[0], point[1])
        standing = any(hypot(point[0] - x, point[1] - y) < reach - _TOUCHING for x, y, _ in ends)
        wanted = -2 * WIRE_RESOLUTION if standing else spread + part.radius * hypot(*surface.slope)
        if clear < wanted - _TOUCHING:
            yield Contact(part.name, f"the {surface.name}", wanted - clear, point)


def _over(surface: Surface, a: Point, b: Point, margin: float) -> tuple[float, float] | None:
    """The part of a segment, as shares of it, that lies over a surface grown by ``margin``."""
    p, q = surface.local(a[0], a[1]), surface.local(b[0], b[1])
    spans = [_overlap(p[i], q[i], -margin, surface.size[i] + margin) for i in (0, 1)]
    if spans[0] is None or spans[1] is None:
        return None
    first, last = max(spans[0][0], spans[1][0]), min(spans[0][1], spans[1][1])
    return (first, last) if first <= last else None


def _crossings(a: Point, b: Point, centre: Point, radius: float) -> list[float]:
    """Where a segment crosses a circle, as shares of it."""
    dx, dy, ex, ey = b[0] - a[0], b[1] - a[1], a[0] - centre[0], a[1] - centre[1]
    square = dx * dx + dy * dy
    if square < _TOUCHING:
        return []
    half, rest = (dx * ex + dy * ey) / square, (ex * ex + ey * ey - radius * radius) / square
    if half * half < rest:
        return []
    root = sqrt(half * half - rest)
    return [t for t in (-half - root, -half + root) if 0.0 < t < 1.0]
