"""The standing pieces as upright cylinders, and how near the hand's parts are to them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.core.surfaces import Point, Surface
from kempelen.motion.arm.body import Hand, Prisms
from kempelen.motion.scene import Scene
from kempelen.motion.sweep import WIRE_RESOLUTION, slack

FINEST = 0.04
"""Distance that is no longer told from touching, mm."""
_SIDEWAYS = np.array([[0.0, 1.0], [-1.0, 0.0]])
Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Obstacles:
    """Upright cylinders: c of them; ``piece`` (c,) is the index in the scene, ``own``: is it in the hand?"""

    centre: Array
    radius: Array
    bottom: Array
    top: Array
    piece: Indices
    own: npt.NDArray[np.bool_]


def obstacles(
    scene: Scene, parts: Prisms, *, open_hand: bool, lateral: float = 0.0, vertical: float = 0.0
) -> Obstacles:
    """The scene's cylinders, for a motion whose first and last postures are known.

    Args:
        scene: What stands.
        parts: The hand along the motion.
        open_hand: The piece at its start or end may be between the fingers: its foot begins below their tips,
            its head is in the passage between them.
        lateral: To keep away from the other pieces, mm.
        vertical: To keep above them, mm.
    """
    count = len(scene.places)
    radius, top = scene.radius + lateral, scene.top + vertical
    bottom, centre = scene.bottom.copy(), scene.centre.copy()
    mine = np.zeros(2 * count, dtype=bool)
    if open_hand:
        for end in (0, -1):
            own = scene.gripped_at(point_of(parts.tool[end]))
            if own is None:
                continue
            shape = scene.table.pieces[scene.standing[scene.places[own]].piece_type]
            head, spread = own + count, slack(scene)
            mine[[own, head]] = True
            tips = float(parts.bottom[end, :2].min())
            top[own] = min(tips - 2 * spread - FINEST, scene.top[own])
            bottom[head], top[head] = top[own], scene.top[head]
            centre[own], centre[head] = scene.axis[own], scene.axis[own]
            radius[own] = scene.radius[own]
            radius[head] = max(shape.head_diameter, shape.grip_diameter) / 2 + scene.clearances.off_centre
    return Obstacles(centre, radius, bottom, top, np.arange(2 * count) % max(count, 1), mine)


def gaps(parts: Prisms, found: Obstacles, margin: Array) -> tuple[Indices, Indices, Indices, Array]:
    """Pairs of a part and a cylinder nearer than ``margin`` (s,) mm: sample, part, cylinder, distance.

    The distance is the greater one of the horizontal and the vertical distance, below 0 where both overlap.
    A part's horizontal slices between the lowest and the highest height that it shares with the cylinder are
    one rectangle, shifted; what it covers is compared with the cylinder's disc.
    """
    grown = margin[:, None, None]
    low = np.maximum(found.bottom - grown, parts.bottom[:, :, None])
    high = np.minimum(found.top + grown, parts.top[:, :, None])
    wide = np.hypot(np.abs(parts.across).max(axis=2), parts.half) + parts.rounding
    wide = wide + np.hypot(parts.lean[..., 0], parts.lean[..., 1]) * (parts.top - parts.bottom)
    offset = found.centre - parts.tool[:, None, :2]  # (s, c, 2)
    near = ((offset * offset).sum(axis=2)[:, None, :]) < (found.radius + wide[:, :, None] + grown) ** 2
    sample, part, cylinder = np.nonzero(near & (low < high))
    if not len(sample):
        return sample, part, cylinder, np.zeros(0)
    away = offset[sample, cylinder]
    lean, z = parts.lean[sample, part], parts.tool[sample, 2]
    closing = parts.closing[sample]
    over = closing @ _SIDEWAYS
    ends = [
        away - lean * (height - z)[:, None]
        for height in (low[sample, part, cylinder], high[sample, part, cylinder])
    ]
    first = [(end * closing).sum(axis=1) for end in ends]
    second = [(end * over).sum(axis=1) for end in ends]
    across, half = parts.across[sample, part], parts.half[sample, part]
    beside = np.maximum(across[:, 0] - np.maximum(*first), np.minimum(*first) - across[:, 1])
    before = np.maximum(-half - np.maximum(*second), np.minimum(*second) - half)
    gap = np.hypot(np.maximum(beside, 0.0), np.maximum(before, 0.0))
    gap -= parts.rounding[sample, part] + found.radius[cylinder]
    above = parts.bottom[sample, part] - found.top[cylinder]
    gap = np.maximum(gap, np.maximum(above, found.bottom[cylinder] - parts.top[sample, part]))
    close = gap < margin[sample]
    return sample[close], part[close], cylinder[close], gap[close]


def lacks(scene: Scene, shape: Hand, parts: Prisms, margin: Array) -> Iterator[tuple[Surface, Array]]:
    """By how much (s, p) each part is less than ``margin`` (s,) mm above each surface; below 0: all well.

    A carried piece may stand where it is picked up and where it is set down.
    """
    ends = parts.tool[[0, -1], :2]
    off = np.linalg.norm(parts.tool[:, None, :2] - ends[None], axis=2).min(axis=1)
    standing = (off < scene.clearances.align + slack(scene))[:, None] & shape.upright
    wide = np.hypot(np.abs(parts.across).max(axis=2), parts.half) + parts.rounding
    x, y = parts.tool[:, 0], parts.tool[:, 1]
    for surface in scene.table.surfaces:
        u, v = (one[:, None] for one in surface.local(x, y))
        over = (u > -wide) & (u < surface.size[0] + wide) & (v > -wide) & (v < surface.size[1] + wide)
        slope = float(np.hypot(*surface.slope))
        wanted = np.where(standing, -2 * WIRE_RESOLUTION, margin[:, None] + slope * wide)
        lack = wanted - (parts.bottom - surface.height(x, y)[:, None])
        yield surface, np.where(over, lack, -np.inf)


def point_of(row: Array) -> Point:
    """A row (3,) as plain floats."""
    x, y, z = row.tolist()
    return x, y, z
