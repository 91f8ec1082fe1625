"""One leg of the hand's way, and what stands under it.

The hand goes in the vertical plane through start and end. What it could touch there becomes *hurdles*:
between two distances along the line the tool point must be at least so high.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot, inf
from typing import NamedTuple, Self

import numpy as np

from kempelen.core.errors import MotionError
from kempelen.core.pieces import PieceShape
from kempelen.core.surfaces import Point, Surface
from kempelen.core.table import Gripper
from kempelen.motion.profile import Profile
from kempelen.motion.scene import Scene

_TINY = 1e-6  # mm


class Hurdle(NamedTuple):
    """Between ``enter`` and ``leave`` mm along the line z must be at least ``height``."""

    enter: float
    leave: float
    height: float
    what: str


class Column(NamedTuple):
    """Part of the moving body, thought to reach up without end: ``bottom`` is relative to the tool point."""

    radius: float
    bottom: float


def columns(gripper: Gripper, held: PieceShape | None) -> list[Column]:
    """The moving body as upright columns: fingers, the piece in them, palm."""
    reach = gripper.half_length_open if held is None else held.grip_diameter / 2 + gripper.finger_thickness
    body = [Column(hypot(reach, gripper.finger_width / 2), -gripper.below_tool)]
    if held is not None:
        body.append(Column(held.base_diameter / 2, -held.grip_height))
    body.append(Column(gripper.palm_radius, gripper.finger_length))
    return body


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """From one tool point to another, at rest at both.

    Attributes:
        title: For messages: ``"carrying the white knight from g1 to f3"``.
        start: (x, y, z) mm, robot frame.
        end: (x, y, z) mm, robot frame.
        held: What the closed fingers hold; None with open fingers.
        length: Horizontal distance, mm.
        direction: Horizontal unit vector; (1, 0) for a vertical leg.
        hurdles: What must be passed over.
        rise: z of the highest hurdle or end, mm.
    """

    title: str
    scene: Scene
    start: Point
    end: Point
    held: PieceShape | None
    length: float
    direction: tuple[float, float]
    hurdles: tuple[Hurdle, ...]
    rise: float

    @classmethod
    def between(cls, scene: Scene, start: Point, end: Point, held: PieceShape | None, title: str) -> Self:
        """Find the hurdles between two tool points.

        Raises:
            MotionError: an end lies outside of the work space, or a hurdle is too high for it.
        """
        dx, dy = end[0] - start[0], end[1] - start[1]
        length = hypot(dx, dy)
        direction = (dx / length, dy / length) if length > _TINY else (1.0, 0.0)
        line = _Line(start, end, length if length > _TINY else 0.0, direction)
        _require_inside(scene, line, title)
        hurdles = tuple(_hurdles(scene, line, held))
        rise = max((h.height for h in hurdles), default=-inf)
        _require_headroom(scene, hurdles, rise, title)
        return cls(
            title, scene, start, end, held, line.length, direction, hurdles, max(rise, start[2], end[2])
        )

    def travel(self) -> Profile:
        """The fastest horizontal motion, each axis at its own limits."""
        space = self.scene.table.space
        shares = [(abs(c), v, a) for c, v, a in zip(
            self.direction, space.velocity[:2], space.acceleration[:2], strict=True
        ) if abs(c) > _TINY]  # fmt: skip
        speed = min(v / c for c, v, _ in shares)
        return Profile.over(self.length, speed, min(a / c for c, _, a in shares))

    def lift(self, height: float) -> Profile:
        """The fastest vertical motion over ``height`` mm."""
        space = self.scene.table.space
        return Profile.over(height, space.velocity[2], space.acceleration[2])

    def at(self, distance: float, height: float) -> Point:
        """(x, y, z) of the point ``distance`` mm along the line at z = ``height``."""
        return (
            self.start[0] + self.direction[0] * distance,
            self.start[1] + self.direction[1] * distance,
            height,
        )


class _Line(NamedTuple):
    start: Point
    end: Point
    length: float
    direction: tuple[float, float]


def _require_inside(scene: Scene, line: _Line, title: str) -> None:
    for name, point in (("start", line.start), ("end", line.end)):
        excess = scene.table.space.excess(np.array(point))
        if excess > _TINY:
            x, y, z = point
            raise MotionError(
                f"{title}: the {name} ({x:.1f}, {y:.1f}, {z:.1f}) mm lies {excess:.1f} mm outside of the "
                f"work space {scene.table.space.lower} to {scene.table.space.upper} mm.",
                hint="Calibrate the board again, or move the board or tray within the machine's reach.",
            )


def _require_headroom(scene: Scene, hurdles: tuple[Hurdle, ...], rise: float, title: str) -> None:
    ceiling = scene.table.space.upper[2]
    if rise > ceiling + _TINY:
        what = max(hurdles, key=lambda hurdle: hurdle.height).what
        raise MotionError(
            f"{title}: passing over {what} needs the tool point at z = {rise:.1f} mm; the work space ends at "
            f"{ceiling:.1f} mm, {rise - ceiling:.1f} mm too low.",
            hint="Use a lower board, a shorter set, a smaller vertical clearance or a taller machine.",
        )


def _hurdles(scene: Scene, line: _Line, held: PieceShape | None) -> Iterator[Hurdle]:
    if line.length == 0.0:
        return
    body = columns(scene.table.gripper, held)
    lowest = min(body, key=lambda column: column.bottom)
    for surface in scene.table.surfaces:
        hurdle = _over_surface(scene, line, lowest, surface)
        if hurdle is not None:
            yield hurdle
    if not scene.places:
        return
    own = [] if held is not None else [scene.gripped_at(line.start), scene.gripped_at(line.end)]
    yield from _over_pieces(scene, line, body, own)
    for end, index in enumerate(own):
        if index is not None:
            yield _off_own_piece(scene, line, body[0], index, at_start=end == 0)


def _over_pieces(scene: Scene, line: _Line, body: list[Column], own: list[int | None]) -> Iterator[Hurdle]:
    """Distances along the line at which a column is within reach of a cylinder, closed form.

    An end of the leg is where the table puts it. Where that leaves less room beside a piece than the lateral
    clearance, the room there is what is kept.
    """
    (ux, uy), (x0, y0, z0), z1 = line.direction, line.start, line.end[2]
    low = min(z0, z1)
    dx, dy = scene.centre[:, 0] - x0, scene.centre[:, 1] - y0  # (2n,)
    along, across = dx * ux + dy * uy, dy * ux - dx * uy
    across *= across
    from_start, from_end = along * along + across, (along - line.length) ** 2 + across
    count = len(scene.places)
    for column in body:
        height = scene.top + (scene.clearances.vertical - column.bottom)
        if height.max() <= low:
            continue
        reach = (scene.radius + (column.radius + scene.clearances.lateral)) ** 2
        reach = np.where(height > z0, np.minimum(reach, from_start), reach)
        reach = np.where(height > z1, np.minimum(reach, from_end), reach)
        half = np.sqrt(np.maximum(reach - across, 0.0))
        enter, leave = along - half, along + half
        there = (half > 0) & (height > low) & (leave > _TINY) & (enter < line.length - _TINY)
        for i in np.flatnonzero(there).tolist():
            if i % count not in own:
                yield Hurdle(
                    max(float(enter[i]), 0.0),
                    min(float(leave[i]), line.length),
                    float(height[i]),
                    scene.name(i),
                )


def _off_own_piece(scene: Scene, line: _Line, fingers: Column, index: int, *, at_start: bool) -> Hurdle:
    """The piece between the open fingers: straight up until clear of it, straight down onto it."""
    head = index + len(scene.places)
    gap, align = scene.clearances.near, scene.clearances.align
    footprint = fingers.radius + float(scene.radius[head]) + scene.clearances.lateral
    height = float(scene.top[head]) + gap - fingers.bottom
    reach = min(footprint, line.length)
    enter, leave = (align, reach) if at_start else (line.length - reach, line.length - align)
    return Hurdle(max(min(enter, leave), 0.0), leave, height, scene.name(index))


def _over_surface(scene: Scene, line: _Line, lowest: Column, surface: Surface) -> Hurdle | None:
    """The lowest part must be clear of the surface, but for the ends that stand on it."""
    r, length, align = lowest.radius, line.length, scene.clearances.align
    (u0, v0), (u1, v1) = surface.local(*line.start[:2]), surface.local(*line.end[:2])
    first, last = 0.0, 1.0
    for a, b, size in ((u0, u1, surface.size[0]), (v0, v1, surface.size[1])):
        if abs(b - a) < _TINY:
            if not -r < a < size + r:
                return None
            continue
        t0, t1 = sorted(((-r - a) / (b - a), (size + r - a) / (b - a)))
        first, last = max(first, t0), min(last, t1)
    if first >= last:
        return None
    dx, dy = line.end[0] - line.start[0], line.end[1] - line.start[1]
    ends = [surface.height(line.start[0] + t * dx, line.start[1] + t * dy) for t in (first, last)]
    height = max(ends) + r * hypot(*surface.slope) + scene.clearances.near - lowest.bottom
    if height <= min(line.start[2], line.end[2]):
        return None
    enter = align if first == 0.0 and line.start[2] < height else first * length
    leave = length - align if last == 1.0 and line.end[2] < height else last * length
    return Hurdle(enter, leave, height, f"the {surface.name}") if enter < leave else None
