"""What the twin looks like: turned pieces and the gantry's frame. Nothing here can be touched.

Contacts are the business of `bodies` and `gantry`, with the cheapest shapes that are true. These meshes are
for views and cameras only, and are made from the same measures.
"""

import math
from collections.abc import Mapping
from typing import Any

import chess
import mujoco
import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.core.pieces import KINDS, PieceShape
from kempelen.core.table import WorkSpace
from kempelen.twin.look import Look
from kempelen.twin.physics.paint import CLOTH_SIZE, PAINT_SIZE, board_paint, table_paint
from kempelen.twin.physics.units import METRES

PAINT = 1
"""Group of geoms that are drawn and never touched."""
HIDDEN = 3
"""Group of geoms that are touched and not drawn."""
WHITE, BLACK, BOARD, TABLE = "white", "black", "board", "table"
"""Names of materials."""
Faces = npt.NDArray[np.int32]
Rgba = tuple[float, float, float, float]
_CLOTH_REPEAT = (60.0, 60.0)
_SIDES = 28
_THINNEST = 1e-3  # mm, of radii: no triangle of a mesh is without area
_ALUMINIUM = (0.72, 0.74, 0.78, 1.0)
_STEEL = (0.32, 0.34, 0.38, 1.0)

# Above the stem, as shares: radius of the head's radius, height from the neck (0) to the top (1).
_HEADS: Mapping[chess.PieceType, tuple[tuple[float, float], ...]] = {
    chess.PAWN: (
        (0.95, 0.0),
        (0.95, 0.1),
        (0.55, 0.2),
        (0.85, 0.4),
        (1.0, 0.65),
        (0.8, 0.9),
        (0.4, 0.99),
        (0, 1),
    ),
    chess.ROOK: ((0.75, 0.0), (1.0, 0.25), (1.0, 1.0), (0.72, 1.0), (0.72, 0.72), (0, 0.72)),
    chess.KNIGHT: ((1.0, 0.0), (1.0, 0.12), (0.7, 0.2), (0, 0.2)),
    chess.BISHOP: (
        (1.0, 0.0),
        (0.6, 0.12),
        (0.95, 0.35),
        (0.9, 0.55),
        (0.5, 0.82),
        (0.2, 0.88),
        (0.28, 0.94),
        (0, 1),
    ),
    chess.QUEEN: (
        (1.0, 0.0),
        (0.62, 0.1),
        (0.7, 0.4),
        (1.0, 0.82),
        (0.6, 0.84),
        (0.45, 0.92),
        (0.2, 0.99),
        (0, 1),
    ),
    chess.KING: ((1.0, 0.0), (0.62, 0.08), (0.75, 0.4), (0.95, 0.66), (0.7, 0.74), (0.2, 0.78), (0, 0.78)),
}

# The knight's head seen from the side: x forwards, z up, as shares of the head's radius and height.
_HORSE = (
    (-0.75, 0.15), (0.55, 0.15), (0.5, 0.4), (0.35, 0.5), (0.95, 0.55), (1.0, 0.68), (0.45, 0.92), (0.2, 1.0),
    (-0.1, 0.9), (-0.6, 0.72), (-0.9, 0.4),
)  # fmt: skip


def profile(kind: chess.PieceType, shape: PieceShape) -> Array:
    """(n, 2) radius and height of a kind's outline, from the base's rim to the top, mm."""
    base, stem, head = shape.base_diameter / 2, shape.grip_diameter / 2, shape.head_diameter / 2
    foot = min(8.0, 0.15 * shape.height)
    neck = 0.5 * (shape.grip_height + shape.height)
    if kind in {chess.KNIGHT, chess.ROOK, chess.PAWN}:
        neck = shape.grip_height + 0.25 * (shape.height - shape.grip_height)
    body = [
        (0.0, 0.0), (base, 0.0), (base, 0.6 * foot), (0.86 * base, foot), (0.8 * base, 1.15 * foot),
        (0.5 * (0.75 * base + stem), 1.6 * foot),
        (stem, 0.55 * shape.grip_height + 0.45 * foot), (stem, neck),
    ]  # fmt: skip
    top = [(head * r, neck + h * (shape.height - neck)) for r, h in _HEADS[kind]]
    return np.array(body + top)


def add_materials(spec: Any, look: Look) -> None:
    """Materials of the two colours of pieces, the board's top, the table's and the walls."""
    for name, rgb in ((WHITE, look.white), (BLACK, look.black)):
        spec.add_material(name=name, rgba=(*rgb, 1.0), specular=look.gloss, shininess=0.3 + 0.5 * look.gloss)
    wall = np.array(look.room)
    spec.add_texture(
        name="room", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=wall, rgb2=0.6 * wall, width=32, height=192,
    )  # fmt: skip
    _textured(spec, BOARD, (1.0, 1.0), look.board_gloss)
    _textured(spec, TABLE, _CLOTH_REPEAT, 0.05)


def _textured(spec: Any, name: str, repeat: tuple[float, float], gloss: float) -> None:
    """Blank at first: a list of a million numbers would be the specification's way to hold a picture."""
    side = PAINT_SIZE if name == BOARD else CLOTH_SIZE
    spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT, nchannel=3,
        width=side, height=side,
    )  # fmt: skip
    material = spec.add_material(name=name, texrepeat=repeat, specular=gloss, shininess=0.3 + 0.5 * gloss)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


def paint_textures(model: Any, look: Look, square: float) -> None:
    """Fill a compiled model's textures."""
    for name, paint in ((BOARD, board_paint(look, square)), (TABLE, table_paint(look))):
        start = int(model.tex_adr[model.texture(name).id])
        model.tex_data[start : start + paint.size] = paint.ravel()


def add_board_paint(board: Any, square: float, look: Look) -> None:
    """Paint only: one thin plate on the board that nothing touches."""
    middle, edge = 4 * square, 4 * square + look.border_width
    board.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, material=BOARD, contype=0, conaffinity=0, group=PAINT,
        pos=np.array([middle, middle, 0.0]) * METRES, size=np.array([edge, edge, 0.05]) * METRES,
    )  # fmt: skip


def add_meshes(spec: Any, pieces: Mapping[chess.PieceType, PieceShape], look: Look) -> None:
    """One turned mesh for each kind; the king's cross and the knight's head beside it."""
    rng = np.random.default_rng(look.seed)
    for kind in KINDS:
        outline = carved(profile(kind, pieces[kind]), rng, look.carving)
        outline[:, 0] = np.maximum(outline[:, 0], _THINNEST)
        _mesh(spec, chess.piece_name(kind), *turned(outline, _SIDES))
    knight = pieces[chess.KNIGHT]
    _mesh(spec, "horse", *_horse(knight))


def carved(outline: Array, rng: np.random.Generator, share: float) -> Array:
    """(n, 2) an outline as another workshop would turn it; base, top and widest parts stay.

    Args:
        outline: (n, 2) radius and height, mm.
        rng: The workshop's taste.
        share: How far it goes, 0 to 1.
    """
    out = outline.copy()
    if not share:
        return out
    gaps = np.abs(np.diff(outline[:, 1]))
    room = np.minimum(gaps[:-1], gaps[1:])[3:-1]  # of the fifth point to the last but two
    out[4:-2, 0] *= 1 + share * np.clip(rng.normal(-0.05, 0.12, len(room)), -0.3, 0.1)
    out[4:-2, 1] += share * 0.4 * rng.uniform(-1, 1, len(room)) * room
    return out


def add_paint(body: Any, kind: chess.PieceType, shape: PieceShape, material: str) -> None:
    """Make a piece's body look like its kind."""
    common = {"contype": 0, "conaffinity": 0, "group": PAINT, "material": material, "mass": 0.0}
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=chess.piece_name(kind), **common)
    if kind == chess.KNIGHT:
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="horse", **common)
    if kind == chess.KING:
        size = 0.11 * (shape.height - shape.grip_height)
        for half in ((1.0, 0.35, 0.35), (0.35, 0.35, 1.0)):
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX, size=size * np.array(half) * METRES,
                pos=(0.0, 0.0, (shape.height - size) * METRES), **common,
            )  # fmt: skip


def add_frame(
    spec: Any, slides: Mapping[str, Any], space: WorkSpace, *, palm_top: float, table_top: float
) -> None:
    """Rails on the table, a portal that runs on them, and the pole that carries the hand.

    Args:
        spec: MjSpec to add to.
        slides: Bodies ``x`` and ``z``, whose origins move with those axes.
        space: What the machine can reach.
        palm_top: Of the palm above the tool point, mm.
        table_top: z of the table, robot frame, mm.
    """
    (x0, y0, z0), (x1, y1, z1) = space.lower, space.upper
    beam, level = 12.0, z1 + palm_top + 40.0
    for y in (y0 - 60.0, y1 + 60.0):
        rail = ((x0 + x1) / 2, y, table_top + beam / 2)
        _beam(spec.worldbody, rail, ((x1 - x0) / 2 + 60.0, beam, beam / 2), _STEEL)
        foot = table_top + beam
        _beam(slides["x"], (0.0, y, (foot + level) / 2), (beam, beam, (level - foot) / 2), _ALUMINIUM)
        _beam(slides["x"], (0.0, y, foot + beam), (4 * beam, beam, beam), _ALUMINIUM)
    _beam(slides["x"], (0.0, (y0 + y1) / 2, level), (beam, (y1 - y0) / 2 + 60.0 + beam, beam), _ALUMINIUM)
    pole = (z1 - z0) / 2 + 50.0
    _beam(slides["z"], (2.2 * beam, 0.0, palm_top + pole), (8.0, 8.0, pole), _ALUMINIUM)
    _beam(slides["z"], (1.1 * beam, 0.0, palm_top + 5.0), (2.2 * beam, 8.0, 5.0), _ALUMINIUM)


def _beam(
    body: Any,
    where: tuple[float, float, float],
    half: tuple[float, float, float],
    rgba: Rgba,
) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=np.array(where) * METRES, size=np.array(half) * METRES, rgba=rgba,
        contype=0, conaffinity=0, group=PAINT, mass=0.0,
    )  # fmt: skip


def _mesh(spec: Any, name: str, vertices: Array, faces: Faces) -> None:
    spec.add_mesh(
        name=name, uservert=(vertices * METRES).ravel(), userface=faces.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )  # fmt: skip


def turned(outline: Array, sides: int) -> tuple[Array, Faces]:
    """A solid of revolution about z of (n, 2) radii and heights: (m, 3) vertices and (k, 3) faces."""
    angles = np.arange(sides) * math.tau / sides
    radius, height = outline.T
    ring = np.stack([np.outer(radius, np.cos(angles)), np.outer(radius, np.sin(angles))], axis=-1)
    vertices = np.concatenate([ring, np.broadcast_to(height[:, None, None], (*ring.shape[:2], 1))], axis=-1)
    i, j = np.meshgrid(np.arange(len(outline) - 1), np.arange(sides), indexing="ij")
    here, right = i * sides + j, i * sides + (j + 1) % sides
    below = np.stack([here, right, here + sides], axis=-1).reshape(-1, 3)
    above = np.stack([right, right + sides, here + sides], axis=-1).reshape(-1, 3)
    return vertices.reshape(-1, 3), np.concatenate([below, above]).astype(np.int32)


def _horse(shape: PieceShape) -> tuple[Array, Faces]:
    """The side view, a third as thick as long: (m, 3) vertices, mm, and (k, 3) faces."""
    head, neck = shape.head_diameter / 2, shape.grip_height + 0.25 * (shape.height - shape.grip_height)
    side = np.array(_HORSE) * [head, shape.height - neck] + [0.0, neck]
    n = len(side)
    thick = 0.45 * head
    left, right = (np.stack([side[:, 0], np.full(n, y), side[:, 1]], axis=1) for y in (-thick, thick))
    hub = np.array([[0.0, y, float(side[:, 1].mean())] for y in (-thick, thick)])
    now, after = np.arange(n), (np.arange(n) + 1) % n
    walls = np.concatenate(
        [np.stack([now, after, now + n], axis=1), np.stack([after, after + n, now + n], axis=1)]
    )
    caps = np.concatenate(
        [
            np.stack([after, now, np.full(n, 2 * n)], axis=1),
            np.stack([now + n, after + n, np.full(n, 2 * n + 1)], axis=1),
        ]
    )
    inwards = np.concatenate([walls, caps])
    return np.concatenate([left, right, hub]), inwards[:, ::-1].astype(np.int32)
