"""The thesis's path over the pieces: Dedu's supercover line, grouped by row or column.

The straight line from source to target crosses squares; those it crosses form its supercover (E. Dedu,
"Bresenham-based supercover line algorithm": a line through a corner takes both side squares). They are
grouped along the line's longer direction, each group as tall as its tallest piece. The gripper climbs
with interpolated segments to the highest group and descends after it.

It knows squares, not widths: neither the carried piece nor the fingers are swept, so it may touch. Kept as a
baseline.
"""

from math import floor

import numpy as np

from kempelen.motion.leg import Leg

Cell = tuple[int, int]


def cells(start: Cell, end: Cell) -> list[Cell]:
    """All cells that the line between two cells' centres crosses, in order; exact, integers only."""
    (x, y), (x1, y1) = start, end
    dx, dy = abs(x1 - x), abs(y1 - y)
    sx, sy = (1 if x1 > x else -1), (1 if y1 > y else -1)
    crossed = [start]
    i = j = 0
    while (x, y) != end:
        # The next sides are crossed at (2i + 1) / (2 dx) and (2j + 1) / (2 dy) of the way.
        ahead = (2 * i + 1) * dy - (2 * j + 1) * dx
        if ahead == 0:
            crossed += [(x + sx, y), (x, y + sy)]
        if ahead <= 0:
            x, i = x + sx, i + 1
        if ahead >= 0:
            y, j = y + sy, j + 1
        crossed.append((x, y))
    return crossed


def heights(leg: Leg) -> list[tuple[float, float]]:
    """The path between start and end as (distance along the line, z), mm.

    Up to the highest group each group's height is reached where the line enters it, after it left where
    the line leaves it.
    """
    groups = _groups(leg)
    tops = [top for _, _, top in groups]
    peak = tops.index(max(tops))
    last = len(tops) - 1 - tops[::-1].index(max(tops))
    climb = [(enter, max(tops[: i + 1])) for i, (enter, _, _) in enumerate(groups[: peak + 1])]
    descend = [(leave, max(tops[i:])) for i, (_, leave, _) in enumerate(groups) if i >= last]
    return climb + descend


def _groups(leg: Leg) -> list[tuple[float, float, float]]:
    """Per row or column crossed: where along the line it begins and ends, and the height to fly at, mm."""
    scene, table = leg.scene, leg.scene.table
    board_from_robot = table.robot_from_board.inverse()
    start, end = (board_from_robot @ np.array(point) / table.square for point in (leg.start, leg.end))
    source, target = _cell(start), _cell(end)
    major = 0 if abs(end[0] - start[0]) >= abs(end[1] - start[1]) else 1
    standing = _tops(leg)
    held = 0.0 if leg.held is None else leg.held.grip_height
    ground = max(float(table.centre(place)[2]) for place in table.places)
    tallest: dict[int, float] = {}
    for cell in cells(source, target):
        tallest[cell[major]] = max(tallest.get(cell[major], ground), standing.get(cell, ground))
    span = end[major] - start[major]
    order = sorted(tallest, reverse=bool(span < 0))
    out = []
    for index in order:
        ends = sorted(((side - start[major]) / span for side in (index, index + 1)) if span else (0.0, 1.0))
        enter, leave = (min(max(float(t), 0.0), 1.0) * leg.length for t in ends)
        out.append((enter, leave, tallest[index] + held + scene.clearances.vertical))
    return out


def _cell(point: np.ndarray) -> Cell:
    return floor(point[0]), floor(point[1])


def _tops(leg: Leg) -> dict[Cell, float]:
    """Height of the tallest piece of each cell, robot frame, mm."""
    scene, table = leg.scene, leg.scene.table
    board_from_robot = table.robot_from_board.inverse()
    tops: dict[Cell, float] = {}
    count = len(scene.places)
    for i, place in enumerate(scene.places):
        cell = _cell(board_from_robot @ table.centre(place) / table.square)
        tops[cell] = max(tops.get(cell, -np.inf), float(scene.top[count + i]))
    return tops
