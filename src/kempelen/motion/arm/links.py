"""The arm's own links in the swept test: against pieces, surfaces, the table and one another."""

from functools import lru_cache
from itertools import combinations

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.kinematics.chain import frames
from kempelen.motion.arm.body import Capsules, Hand, capsules, hand_capsule
from kempelen.motion.arm.obstacles import Obstacles, point_of
from kempelen.motion.scene import Scene
from kempelen.motion.sweep import Contact, slack

Flags = npt.NDArray[np.bool_]
Pair = tuple[int, int]
_TINY = 1e-9


@lru_cache(maxsize=16)
def reach(arm: Arm) -> float:
    """No point of the arm or its hand is farther from any of its axes, mm."""
    own = sum(float(np.hypot(link.a, link.d)) for link in arm.links[1:])
    return own + max((body.radius for body in arm.bodies), default=0.0)


@lru_cache(maxsize=16)
def apart(arm: Arm) -> tuple[Pair, ...]:
    """Pairs of bodies that are not joined: those that do not touch where homing ends."""
    found = capsules(arm, frames(arm, arm.home)[None])
    pairs = list(combinations(range(len(arm.bodies)), 2))
    if not pairs:
        return ()
    gap = _between(found, pairs)[0]
    return tuple(pair for pair, free in zip(pairs, gap.tolist(), strict=True) if free > 0)


def chords(arm: Arm, at: tuple[Array, Array]) -> Array:
    """(s,) the longest way of any point of the links from one posture to the next, mm."""
    first, last = (capsules(arm, one) for one in at)
    ways = [np.linalg.norm(b - a, axis=2) for a, b in ((first.start, last.start), (first.end, last.end))]
    longest: Array = np.maximum(*ways).max(axis=1, initial=0.0)
    return longest


def close(
    arm: Arm, scene: Scene, obstacles: Obstacles, posture: tuple[Array, Hand], margin: tuple[Array, Array]
) -> tuple[Flags, list[Contact]]:
    """Postures at which a link is nearer to a piece or another link than a margin (s,), and what touches.

    Args:
        arm: Its bodies.
        scene: What stands.
        obstacles: Its cylinders.
        posture: Frames (s, n + 1, 4, 4), and the hand.
        margin: (s,) below which it is near, and (s,) or one number below which it touches, mm.
    """
    at, shape = posture
    near, touch = margin[0], np.broadcast_to(margin[1], margin[0].shape)
    found = capsules(arm, at)
    flags, contacts = _against_pieces(found, scene, obstacles, (near, touch), at)
    more, others = _against_itself(arm, found, (at, shape), (near, touch))
    return flags | more, contacts + others


def against_table(arm: Arm, scene: Scene, at: Array) -> list[Contact]:
    """Links that would go below the highest surface above which they are, or below the table itself."""
    found, spread = capsules(arm, at), slack(scene)
    moving = np.array([body.link > 1 for body in arm.bodies])
    lowest = np.minimum(found.start[..., 2], found.end[..., 2]) - found.radius
    contacts = []
    for surface in scene.table.surfaces:
        middle, half = (found.start + found.end) / 2, np.linalg.norm(found.end - found.start, axis=2) / 2
        u, v = surface.local(middle[..., 0], middle[..., 1])
        wide = half + found.radius
        over = (u > -wide) & (u < surface.size[0] + wide) & (v > -wide) & (v < surface.size[1] + wide)
        height = surface.height(middle[..., 0], middle[..., 1])
        contacts += _lowest(
            f"the {surface.name}", np.where(over & moving, height - lowest, -np.inf), spread, at
        )
    return contacts + _lowest("the table", np.where(moving, -lowest, -np.inf), spread, at)


def _lowest(what: str, depth: Array, spread: float, at: Array) -> list[Contact]:
    sample, body = np.unravel_index(int(depth.argmax()), depth.shape)
    deep = float(depth[sample, body]) + spread
    return [Contact(_NAME, what, deep, point_of(at[sample, -1, :3, 3]))] if deep > 0 else []


_NAME = "the arm"


def _against_pieces(
    found: Capsules, scene: Scene, obstacles: Obstacles, margin: tuple[Array, Array], at: Array
) -> tuple[Flags, list[Contact]]:
    near, touch = margin
    flags = np.zeros(len(at), dtype=bool)
    lowest = np.minimum(found.start[..., 2], found.end[..., 2]) - found.radius  # (s, b)
    if not len(obstacles.top):
        return flags, []
    sample, body = np.nonzero(lowest < obstacles.top.max() + near[:, None])
    if not len(sample):
        return flags, []
    start, end, radius = found.start[sample, body], found.end[sample, body], found.radius[body]
    gap = _from_cylinders(start, end, radius, obstacles, near[sample]).min(axis=1)
    flags[sample[gap < near[sample]]] = True
    if not (gap < touch[sample]).any():
        return flags, []
    gaps = _from_cylinders(start, end, radius, obstacles, touch[sample])
    contacts = [
        Contact(
            _NAME,
            scene.name(int(obstacles.piece[row.argmin()])),
            float(touch[i] - row.min()),
            point_of(at[i, -1, :3, 3]),
        )
        for i, row in zip(sample.tolist(), gaps, strict=True)
        if row.min() < touch[i]
    ]
    return flags, contacts


def _from_cylinders(start: Array, end: Array, radius: Array, obstacles: Obstacles, margin: Array) -> Array:
    """(k, c) horizontal distance of capsules, where they are at a cylinder's heights, from the cylinder."""
    low = obstacles.bottom - (radius + margin)[:, None]
    high = obstacles.top + (radius + margin)[:, None]
    rise = (end - start)[:, 2, None]
    level = np.abs(rise) < _TINY
    safe = np.where(level, 1.0, rise)
    a, b = (low - start[:, 2, None]) / safe, (high - start[:, 2, None]) / safe
    inside = (start[:, 2, None] > low) & (start[:, 2, None] < high)
    first = np.clip(np.where(level, 0.0, np.minimum(a, b)), 0.0, 1.0)
    last = np.clip(np.where(level, 1.0, np.maximum(a, b)), 0.0, 1.0)
    missed = np.where(level, ~inside, (np.maximum(a, b) < 0) | (np.minimum(a, b) > 1))
    way = (end - start)[:, None, :2]
    square = np.maximum((way * way).sum(axis=2), _TINY)
    off = obstacles.centre - start[:, None, :2]
    share = np.clip((off * way).sum(axis=2) / square, first, last)
    gap = np.linalg.norm(off - share[..., None] * way, axis=2) - radius[:, None] - obstacles.radius
    out: Array = np.where(missed, np.inf, gap)
    return out


def _against_itself(
    arm: Arm, found: Capsules, posture: tuple[Array, Hand], margin: tuple[Array, Array]
) -> tuple[Flags, list[Contact]]:
    """Links that are not joined, and the hand against all but the one that carries it."""
    at, shape = posture
    near, touch = margin
    least = room_within(arm, found, at, shape)
    contacts = [
        Contact(_NAME, "itself", float(touch[i] - least[i]), point_of(at[i, -1, :3, 3]))
        for i in np.flatnonzero(least < touch)
    ]
    return least < near, contacts


def room_within(arm: Arm, found: Capsules, at: Array, shape: Hand) -> Array:
    """(s,) least distance of links that are not joined, and of the hand from links, mm.

    Args:
        arm: Its bodies.
        found: The links' capsules at frames ``at`` (s, n + 1, 4, 4).
        at: Of the same postures.
        shape: The hand.
    """
    start, end, radius = hand_capsule(shape, at[:, -1])
    count = len(arm.bodies)
    both = Capsules(
        np.concatenate((found.start, start[:, None]), axis=1),
        np.concatenate((found.end, end[:, None]), axis=1),
        np.append(found.radius, radius),
    )
    pairs = [*apart(arm), *((i, count) for i, body in enumerate(arm.bodies) if body.link < arm.n - 2)]
    if not pairs:
        return np.full(len(at), np.inf)
    least: Array = _between(both, pairs).min(axis=1)
    return least


def _between(found: Capsules, pairs: list[Pair]) -> Array:
    """(s, k) distances of pairs of capsules (closest points of two segments, Ericson 2005, 5.1.9)."""
    one, other = (np.array(side, dtype=np.intp) for side in zip(*pairs, strict=True))
    p, q = found.start[:, one], found.start[:, other]
    d, e = found.end[:, one] - p, found.end[:, other] - q
    r = p - q
    a, b, c = (d * d).sum(axis=2), (d * e).sum(axis=2), (d * r).sum(axis=2)
    g, f = np.maximum((e * e).sum(axis=2), _TINY), (e * r).sum(axis=2)
    a = np.maximum(a, _TINY)
    s = np.clip((b * f - c * g) / np.maximum(a * g - b * b, _TINY), 0.0, 1.0)
    t = (b * s + f) / g
    s = np.where(t < 0, np.clip(-c / a, 0.0, 1.0), np.where(t > 1, np.clip((b - c) / a, 0.0, 1.0), s))
    t = np.clip(t, 0.0, 1.0)
    gap: Array = np.linalg.norm(r + s[..., None] * d - t[..., None] * e, axis=2)
    return gap - found.radius[one] - found.radius[other]
