"""Chess men of many makers: a random set is drawn as a whole, so that its kinds belong together.

Lengths are in squares of the board. A kind is a turned body, and for knight, rook, queen, king and bishop
the parts that no lathe makes: head, battlements, coronet, cross, the cut in the mitre.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from kempelen.core.geometry import Array
from kempelen.twin.cameras.variety import chance

Outline = list[tuple[float, float]]
"""Radius and height from the foot's middle upwards."""

KINDS = "PNBRQK"
_SIDES = 24
_USUAL_HEIGHTS = {"P": 0.5, "N": 0.68, "B": 0.78, "R": 0.57, "Q": 0.9, "K": 1.0}  # of the king's: Staunton
_USUAL_BASES = {"P": 0.78, "N": 0.9, "B": 0.88, "R": 0.92, "Q": 0.98, "K": 1.0}

# Heads of horses seen from the side: x forwards, z up; the box (-1..1, 0..1) is stretched to the head's size.
_HORSES = (
    (
        (-0.7, 0.0), (0.65, 0.0), (0.45, 0.25), (0.15, 0.42), (0.35, 0.5), (0.8, 0.44), (1.0, 0.52),
        (0.95, 0.64), (0.5, 0.82), (0.25, 0.92), (0.12, 1.0), (0.02, 0.92), (-0.35, 0.85), (-0.7, 0.65),
        (-0.88, 0.35),
    ),
    (
        (-0.75, 0.0), (0.7, 0.0), (0.55, 0.2), (0.05, 0.4), (0.1, 0.52), (0.6, 0.5), (0.85, 0.55), (0.9, 0.7),
        (0.4, 0.9), (0.15, 1.0), (-0.1, 0.93), (-0.55, 0.75), (-0.85, 0.45), (-0.9, 0.2),
    ),
    (
        (-0.6, 0.0), (0.6, 0.0), (0.35, 0.3), (0.3, 0.45), (0.75, 0.35), (0.95, 0.42), (0.8, 0.66),
        (0.45, 0.85), (0.3, 1.0), (0.05, 0.95), (-0.4, 0.9), (-0.75, 0.7), (-0.7, 0.4), (-0.5, 0.2),
    ),
)  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A mesh.

    Attributes:
        vertices: (n, 3) squares; z up from the foot.
        faces: (m, 3) indices, counter-clockwise seen from outside.
        dark: Whether it is a cut or a hole, drawn darker.
    """

    vertices: Array
    faces: npt.NDArray[np.int64]
    dark: bool = False


@dataclass(frozen=True, slots=True)
class Style:
    """What the kinds of one set have in common; lengths in squares or as shares of the base's radius.

    Attributes:
        king: Height.
        base: Radius of the king's base.
        stem: Radius of stems, of the base's.
        foot: Height of the foot, of the piece's.
        collars: How many rings are under the head.
        collar: Their radius, of the base's.
        sweep: How steeply the body narrows: 1 is a cone.
        head: Size of heads, of the usual.
        horse: Which side view, and its (n, 2) shifts.
        points: Of the queen's coronet.
        merlons: Of the rook.
        cross: Whether the king wears a cross, else a ball.
        cut: Whether the bishop's mitre is cut.
        beads: Whether the coronet carries beads, else points.
        heights: Of the kinds, as shares of the king's.
        bases: Radii, as shares of the king's.
    """

    king: float
    base: float
    stem: float
    foot: float
    collars: int
    collar: float
    sweep: float
    head: float
    horse: Array
    points: int
    merlons: int
    cross: bool
    cut: bool
    beads: bool
    heights: Mapping[str, float]
    bases: Mapping[str, float]


def random_style(rng: Generator) -> Style:
    """One maker's taste."""
    horse = np.array(_HORSES[rng.integers(len(_HORSES))])
    return Style(
        king=rng.uniform(1.35, 2.05),
        base=rng.uniform(0.31, 0.41),
        stem=rng.uniform(0.3, 0.56),
        foot=rng.uniform(0.04, 0.13),
        collars=int(rng.integers(0, 4)),
        collar=rng.uniform(0.5, 0.75),
        sweep=rng.uniform(1.3, 6.0),
        head=rng.uniform(0.85, 1.2),
        horse=horse + rng.normal(0, 0.035, horse.shape),
        points=int(rng.integers(5, 11)),
        merlons=int(rng.integers(4, 7)),
        cross=chance(rng, 0.85),
        cut=chance(rng, 0.75),
        beads=chance(rng, 0.4),
        heights={k: h * (1.0 if k == "K" else rng.uniform(0.92, 1.08)) for k, h in _USUAL_HEIGHTS.items()},
        bases={k: b * rng.uniform(0.93, 1.07) for k, b in _USUAL_BASES.items()},
    )


def parts(style: Style, kind: str) -> list[Part]:
    """Meshes of a kind, one of ``PNBRQK``."""
    height, base = style.king * style.heights[kind], style.base * style.bases[kind]
    head = {"P": _pawn, "N": _knight, "B": _bishop, "R": _rook, "Q": _queen, "K": _king}[kind]
    return head(style, height, base)


def _pawn(style: Style, height: float, base: float) -> list[Part]:
    ball = base * 0.5 * style.head
    neck = height - 1.75 * ball
    return [_turned([*_body(style, height, base, neck), *_ball(neck + 0.75 * ball, ball)])]


def _bishop(style: Style, height: float, base: float) -> list[Part]:
    wide, bead = base * 0.52 * style.head, base * 0.15
    tall = min(3.0 * wide, 0.34 * height)
    neck = height - tall - 1.6 * bead
    share = np.linspace(0.05, 0.95, 12)
    mitre = [(float(wide * (math.sin(math.pi * s**0.62) ** 0.8)), float(neck + tall * s)) for s in share]
    out = [_turned([*_body(style, height, base, neck), *mitre, *_ball(height - bead, bead)])]
    if style.cut:
        size = np.array([1.6 * wide, 0.16 * wide, 0.5 * wide])
        lean = _turn_y(0.7)
        where = np.array([0.75 * wide, 0.0, neck + 0.62 * tall])
        out.append(_box(size / 2, where, lean, dark=True))
    return out


def _rook(style: Style, height: float, base: float) -> list[Part]:
    wide = base * 0.72 * style.head
    top, wall = 0.28 * height, 0.1 * height
    neck = height - top - wall
    head = [(0.8 * wide, neck), (wide, neck + 0.3 * top), (wide, neck + top), (0.68 * wide, neck + top)]
    floor = neck + top - 0.6 * wall
    out = [_turned([*_body(style, height, base, neck), *head, (0.66 * wide, floor), (0.0, floor)])]
    arc = math.tau / style.merlons
    out += [
        _sector((0.68 * wide, wide), (neck + top, height), (i * arc, (i + 0.68) * arc))
        for i in range(style.merlons)
    ]
    return out


def _queen(style: Style, height: float, base: float) -> list[Part]:
    wide, bead = base * 0.66 * style.head, base * 0.17
    tall = 0.24 * height
    neck = height - tall - 1.5 * bead
    rim = neck + tall
    cup = [(float(wide * (0.55 + 0.45 * s**2.2)), float(neck + tall * s)) for s in np.linspace(0, 1, 7)]
    dish = [(0.78 * wide, rim - 0.12 * tall), (0.5 * wide, rim + 0.3 * bead)]
    out = [_turned([*_body(style, height, base, neck), *cup, *dish, *_ball(height - bead, bead)])]
    arc, tooth = math.tau / style.points, 0.2 * tall
    for i in range(style.points):
        if style.beads:
            where = np.array([0.88 * wide * math.cos(i * arc), 0.88 * wide * math.sin(i * arc), rim])
            out.append(_moved(_turned(_ball(0.0, 0.2 * wide), sides=8), where))
        else:
            out.append(_sector((0.8 * wide, wide), (rim, rim + tooth), (i * arc, (i + 0.55) * arc)))
    return out


def _king(style: Style, height: float, base: float) -> list[Part]:
    wide, sign = base * 0.62 * style.head, 0.11 * height
    tall = 0.24 * height
    neck = height - tall - sign
    cup = [
        (float(wide * (0.58 + 0.42 * s**1.6)), float(neck + 0.72 * tall * s)) for s in np.linspace(0, 1, 6)
    ]
    dome = [
        (float(0.92 * wide * math.cos(a)), float(neck + 0.74 * tall + 0.26 * tall * math.sin(a)))
        for a in np.linspace(0.0, 1.45, 6)
    ]
    body = [*_body(style, height, base, neck), *cup, *dome]
    if not style.cross:
        return [_turned([*body, *_ball(height - 0.5 * sign, 0.5 * sign)])]
    thick, arm = 0.16 * sign, 0.42 * sign
    middle = np.array([0.0, 0.0, height - 0.5 * sign])
    upright = _box(np.array([thick, thick, 0.5 * sign]), middle, np.eye(3))
    across = _box(np.array([thick, arm, thick]), middle + np.array([0, 0, 0.12 * sign]), np.eye(3))
    return [_turned([*body, (0.0, neck + tall)]), upright, across]


def _knight(style: Style, height: float, base: float) -> list[Part]:
    foot = 0.2 * height
    stand = [*_body(style, height, base, foot, knight=True), (0.0, foot)]
    size = np.array([base * 0.92, height - 0.9 * foot]) * [min(style.head, 1.05), 1.0]
    side = _dense(style.horse) * size + [0, 0.85 * foot]
    return [_turned(stand), _inflated(side, 0.36 * base)]


def _body(style: Style, height: float, base: float, neck: float, *, knight: bool = False) -> Outline:
    """(radius, z) from the foot's middle to the neck."""
    foot = min(style.foot * height, 0.5 * neck)
    stem = (0.8 if knight else style.stem) * base
    out = [(0.0, 0.0), (base, 0.0), (base, 0.6 * foot), (0.93 * base, foot), (0.97 * base, 1.25 * foot)]
    rings = 0 if knight else style.collars
    ring = 0.16 * base
    shoulder = max(neck - rings * ring, 1.6 * foot)
    start, shares = 1.6 * foot, np.linspace(0, 1, 9)
    for s in shares:
        narrow = (1 - s) ** style.sweep
        out.append((float(stem + (0.85 * base - stem) * narrow), float(start + (shoulder - start) * s)))
    for i in range(rings):
        wide = base * style.collar * (1 - 0.15 * i)
        low = shoulder + i * ring
        out += [
            (0.8 * wide, low),
            (wide, low + 0.3 * ring),
            (wide, low + 0.5 * ring),
            (0.75 * wide, low + ring),
        ]
    return out


def _ball(middle: float, radius: float) -> Outline:
    angles = np.linspace(-1.15, math.pi / 2, 9)
    return [(float(radius * math.cos(a)), float(middle + radius * math.sin(a))) for a in angles]


def _turned(outline: Outline, *, sides: int = _SIDES) -> Part:
    """A solid of revolution about z."""
    profile = np.array(outline)
    angles = np.arange(sides) * math.tau / sides
    radius = np.maximum(profile[:, 0], 1e-4)
    ring = np.stack([np.outer(radius, np.cos(angles)), np.outer(radius, np.sin(angles))], axis=-1)
    level = np.broadcast_to(profile[:, 1, None, None], (*ring.shape[:2], 1))
    return Part(np.concatenate([ring, level], axis=-1).reshape(-1, 3), _strips(len(profile), sides))


def _strips(rows: int, columns: int) -> npt.NDArray[np.int64]:
    """Faces between rows of vertices that close on themselves."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    here, right = i * columns + j, i * columns + (j + 1) % columns
    below = np.stack([here, right, here + columns], axis=-1).reshape(-1, 3)
    above = np.stack([right, right + columns, here + columns], axis=-1).reshape(-1, 3)
    return np.concatenate([below, above]).astype(np.int64)


def _sector(radii: tuple[float, float], levels: tuple[float, float], ends: tuple[float, float]) -> Part:
    """A piece of a ring's wall."""
    (inner, outer), (low, high) = radii, levels
    angles = np.linspace(*ends, 4)
    corners = [(inner, low), (outer, low), (outer, high), (inner, high)]
    rows = [[(r * math.cos(a), r * math.sin(a), z) for r, z in corners] for a in angles]
    vertices = np.array(rows).reshape(-1, 3)
    last = vertices.shape[0] - 4
    caps = np.array([[0, 1, 2], [0, 2, 3], [last, last + 2, last + 1], [last, last + 3, last + 2]])
    return Part(vertices, np.concatenate([_strips(len(angles), 4)[:, ::-1], caps]))


def _box(half: Array, where: Array, turn: Array, *, dark: bool = False) -> Part:
    signs = np.array([[x, y, z] for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    faces = np.array([
        [0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7],
        [2, 7, 6], [3, 0, 4], [3, 4, 7],
    ])  # fmt: skip
    return Part(signs * half @ turn.T + where, faces, dark)


def _turn_y(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def _moved(part: Part, where: Array) -> Part:
    return Part(part.vertices + where, part.faces, part.dark)


def _dense(corners: Array) -> Array:
    """A closed polygon with a point in the middle of every side."""
    out = np.empty((2 * len(corners), 2))
    out[::2], out[1::2] = corners, (corners + np.roll(corners, -1, axis=0)) / 2
    return out


def _inflated(side: Array, thick: float) -> Part:
    """A side view (x, z) with rounded cheeks: slices towards both sides shrink to the middle."""
    middle = side.mean(axis=0)
    shares = np.array([-1.0, -0.92, -0.7, -0.35, 0.35, 0.7, 0.92, 1.0])
    rows = []
    for share in shares:
        flat = middle + (side - middle) * (1 - 0.25 * abs(share) ** 5)
        rows.append(np.column_stack([flat[:, 0], np.full(len(flat), share * thick), flat[:, 1]]))
    n, last = len(side), (len(shares) - 1) * len(side)
    hubs = np.array([[middle[0], shares[0] * thick, middle[1]], [middle[0], shares[-1] * thick, middle[1]]])
    now, after = np.arange(n), (np.arange(n) + 1) % n
    near = np.column_stack([now, after, np.full(n, n * len(shares))])
    far = np.column_stack([after + last, now + last, np.full(n, n * len(shares) + 1)])
    faces = np.concatenate([_strips(len(shares), n)[:, ::-1], near, far])
    return Part(np.concatenate([*rows, hubs]), faces)
