"""Pictures of random boards with random sets under random light, with what stands where.

The scene is drawn by MuJoCo's renderer; lens, sensor and photographer are added to the drawn picture: shadows
that fall from outside, exposure, white balance, blur, noise, JPEG, and a background that is greyed out.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import chess
import cv2
import mujoco
import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from kempelen.bench.sets.shapes import KINDS, Part, parts, random_style
from kempelen.core.camera import Picture
from kempelen.core.geometry import Array
from kempelen.sensing.sighting import OUTER_CORNERS, BoardSighting, moved
from kempelen.twin.cameras.variety import chance
from kempelen.twin.look import Look
from kempelen.twin.physics.opengl import Canvas
from kempelen.twin.physics.paint import board_paint, table_paint

SIDE = 720
"""Of a picture, pixels."""
_METRES = 0.05
"""Metres in a square."""
_MEN = 32
_ASIDE = 10
"""Men beside the board at most."""
_LIGHTS = 3
_MOST_GEOMS = 500
_NEAREST = 0.5  # squares between lens and board plane
_BOARDS: tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...] = (
    ((0.87, 0.74, 0.55), (0.50, 0.32, 0.20)),  # maple and walnut
    ((0.93, 0.88, 0.75), (0.10, 0.32, 0.22)),  # buff and green vinyl
    ((0.92, 0.92, 0.88), (0.35, 0.12, 0.15)),  # white and burgundy
    ((0.90, 0.90, 0.92), (0.20, 0.28, 0.50)),  # white and blue
    ((0.85, 0.72, 0.35), (0.22, 0.15, 0.12)),  # yellow and brown card
    ((0.82, 0.75, 0.58), (0.12, 0.12, 0.12)),  # marble
    ((0.80, 0.62, 0.42), (0.38, 0.18, 0.10)),  # beech and mahogany
    ((0.75, 0.75, 0.75), (0.35, 0.35, 0.37)),  # greys
)
_WHITES = ((0.93, 0.86, 0.72), (0.95, 0.95, 0.92), (0.85, 0.68, 0.45), (0.90, 0.80, 0.60), (0.98, 0.97, 0.95))
_BLACKS = ((0.06, 0.06, 0.07), (0.22, 0.13, 0.09), (0.30, 0.14, 0.08), (0.12, 0.10, 0.10), (0.02, 0.02, 0.03))


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """A picture and the truth.

    Attributes:
        picture: (SIDE, SIDE, 3) blue, green, red.
        sighting: Where the board is, exactly.
        board: What stands on it.
    """

    picture: Picture
    sighting: BoardSighting
    board: chess.Board


def random_board(rng: Generator) -> chess.Board:
    """A position of a game of random moves, or men scattered so that all kinds are seen equally often."""
    if chance(rng, 0.5):
        board = chess.Board()
        for _ in range(int(rng.integers(0, 90))):
            moves = list(board.legal_moves)
            if not moves or board.is_game_over():
                break
            board.push(moves[rng.integers(len(moves))])
        return board
    board = chess.Board.empty()
    count = int(rng.integers(8, _MEN + 1))
    for square in rng.choice(64, count, replace=False):
        symbol = KINDS[rng.integers(len(KINDS))]
        symbol = symbol if chance(rng, 0.5) else symbol.lower()
        board.set_piece_at(int(square), chess.Piece.from_symbol(symbol))
    return board


def draw(rng: Generator, board: chess.Board | None = None) -> Truth:
    """One picture of a position on a board, with a set, and in a light that ``rng`` chooses.

    Args:
        rng: Everything random.
        board: The position; None for a random one.
    """
    board = random_board(rng) if board is None else board
    spec = mujoco.MjSpec()
    spec.visual.quality.offsamples = 4
    spec.visual.quality.shadowsize = int(rng.choice([1024, 2048]))
    spec.visual.global_.offwidth = spec.visual.global_.offheight = SIDE
    _add_surfaces(spec, rng)
    _add_men(spec, rng, board)
    _add_lights(spec, rng)
    sighting = _add_camera(spec, rng)
    return Truth(_spoilt(_rendered(spec), sighting, rng), sighting, board)


def _rendered(spec: Any) -> Picture:
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    eye = mujoco.MjvCamera()
    eye.type, eye.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, 0
    scene = mujoco.MjvScene(model, maxgeom=_MOST_GEOMS)
    everything = mujoco.mjtCatBit.mjCAT_ALL.value
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), mujoco.MjvPerturb(), eye, everything, scene)
    canvas = Canvas(model)
    try:
        return np.ascontiguousarray(canvas.draw(scene, SIDE, SIDE)[0][..., ::-1])
    finally:
        canvas.close()


def _tint(rng: Generator, rgb: tuple[float, float, float], spread: float) -> tuple[float, float, float]:
    red, green, blue = np.clip(np.array(rgb) * rng.uniform(1 - spread, 1 + spread, 3), 0, 1)
    return float(red), float(green), float(blue)


def _add_surfaces(spec: Any, rng: Generator) -> None:
    light, dark = _BOARDS[rng.integers(len(_BOARDS))]
    border = (light, dark, tuple(rng.uniform(0.05, 0.9, 3)))[rng.integers(3)]
    look = Look(
        light=_tint(rng, light, 0.12), dark=_tint(rng, dark, 0.25), border=_tint(rng, border, 0.1),
        border_width=float(rng.uniform(3, 40)), coordinates=chance(rng, 0.7),
        line=float(rng.choice([0.0, 1.0, 2.0])), grain=float(rng.uniform(0, 0.15)),
        table=_tint(rng, tuple(rng.uniform(0.1, 0.8, 3)), 0.0), cloth=float(rng.uniform(0, 0.2)),
        seed=int(rng.integers(2**31)),
    )  # fmt: skip
    paint = _worn(board_paint(look, 50.0), rng)
    edge = (4 + look.border_width / 50.0) * _METRES
    thick = float(rng.uniform(0.001, 0.02))
    _add_textured(spec, "board", paint, (1.0, 1.0), float(rng.uniform(0, 0.5)))
    _add_textured(spec, "table", table_paint(look), (float(rng.uniform(2, 30)),) * 2, 0.1)
    box = {"type": mujoco.mjtGeom.mjGEOM_BOX, "contype": 0, "conaffinity": 0}
    spec.worldbody.add_geom(material="board", pos=(0, 0, -thick), size=(edge, edge, thick), **box)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, material="table", size=(2, 2, 0.1), pos=(0, 0, -2 * thick),
        contype=0, conaffinity=0,
    )  # fmt: skip


def _worn(paint: Picture, rng: Generator) -> Picture:
    """With flecks and stains, as on a club's boards."""
    out = paint.copy()
    if chance(rng, 0.4):
        for _ in range(int(rng.integers(5, 200))):
            where = tuple(int(v) for v in rng.integers(0, len(out), 2))
            axes = tuple(int(v) for v in rng.integers(1, 9, 2))
            shade = [int(v) for v in np.full(3, rng.integers(20, 245))]
            cv2.ellipse(out, where, axes, float(rng.uniform(0, 180)), 0, 360, shade, -1)
    if chance(rng, 0.3):
        faded = rng.normal(1.0, 0.08, (8, 8, 1)).astype(np.float32)  # each square in its own way
        faded = np.asarray(cv2.resize(faded, out.shape[1::-1], interpolation=cv2.INTER_NEAREST), np.float32)
        out = np.clip(out * faded[..., None], 0, 255).astype(np.uint8)
    return out


def _add_textured(spec: Any, name: str, paint: Picture, repeat: tuple[float, ...], gloss: float) -> None:
    texture = spec.add_texture(
        name=name,
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        nchannel=3,
        width=paint.shape[1],
        height=paint.shape[0],
    )
    texture.data = paint.tobytes()
    material = spec.add_material(name=name, texrepeat=repeat, specular=gloss, shininess=0.3 + 0.5 * gloss)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


def _add_men(spec: Any, rng: Generator, board: chess.Board) -> None:
    style = random_style(rng)
    meshes = {kind: parts(style, kind) for kind in KINDS}
    for kind, shapes in meshes.items():
        for i, part in enumerate(shapes):
            _add_mesh(spec, f"{kind}{i}", part)
    gloss = float(rng.uniform(0, 1))
    for name, choices in (("white", _WHITES), ("black", _BLACKS)):
        rgb = np.array(_tint(rng, choices[rng.integers(len(choices))], 0.12))
        for suffix, factor in (("", 1.0), ("-cut", 0.35)):
            rgba = (*np.clip(rgb * factor, 0, 1), 1.0)
            spec.add_material(
                name=name + suffix, rgba=rgba, specular=gloss, shininess=float(rng.uniform(0.2, 0.9))
            )
    astray = float(rng.uniform(0.01, 0.12))
    for square, piece in board.piece_map().items():
        spot = np.array([chess.square_file(square), chess.square_rank(square)]) - 3.5
        _add_man(spec, rng, meshes, piece, spot + np.clip(rng.normal(0, astray, 2), -0.22, 0.22))
    for _ in range(int(rng.integers(0, _ASIDE + 1)) if chance(rng, 0.5) else 0):
        side = float(rng.choice([-1, 1])) * rng.uniform(5.2, 7.0)
        spot = np.array([side, rng.uniform(-4, 4)])
        piece = chess.Piece(int(rng.integers(1, 7)), chance(rng, 0.5))
        _add_man(spec, rng, meshes, piece, spot if chance(rng, 0.7) else spot[::-1])


def _add_mesh(spec: Any, name: str, part: Part) -> None:
    spec.add_mesh(
        name=name, uservert=(part.vertices * _METRES).ravel(), userface=part.faces.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )  # fmt: skip


def _add_man(
    spec: Any, rng: Generator, meshes: Mapping[str, list[Part]], piece: chess.Piece, spot: Array
) -> None:
    ahead = math.pi / 2 if piece.color else -math.pi / 2
    turn = ahead + rng.normal(0, 0.5) if chance(rng, 0.6) else rng.uniform(0, math.tau)
    kind, material = piece.symbol().upper(), "white" if piece.color else "black"
    for i, part in enumerate(meshes[kind]):
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"{kind}{i}", contype=0, conaffinity=0,
            material=material + ("-cut" if part.dark else ""), pos=(*(spot * _METRES), 0.0),
            quat=(math.cos(turn / 2), 0.0, 0.0, math.sin(turn / 2)),
        )  # fmt: skip


def _add_lights(spec: Any, rng: Generator) -> None:
    ambient = float(rng.uniform(0.1, 0.5))
    spec.visual.headlight.ambient = (ambient,) * 3
    spec.visual.headlight.diffuse = (float(rng.uniform(0, 0.35)),) * 3
    spec.visual.headlight.specular = (float(rng.uniform(0, 0.3)),) * 3
    count = int(rng.integers(1, _LIGHTS + 1))
    for i in range(count):
        angle, high = rng.uniform(0, math.tau), rng.uniform(0.35, 1.5)
        out = math.cos(high)
        where = 1.4 * np.array([math.cos(angle) * out, math.sin(angle) * out, math.sin(high)])
        warm = rng.uniform(0.85, 1.0)
        power = rng.uniform(0.3, 0.9) / count
        spec.worldbody.add_light(
            pos=where, dir=-where, castshadow=bool(i == 0 or chance(rng, 0.4)),
            diffuse=power * np.array([1.0, math.sqrt(warm), warm]), specular=np.full(3, rng.uniform(0, 0.6)),
            ambient=np.zeros(3), cutoff=80.0, exponent=float(rng.uniform(0, 3)),
            attenuation=(1.0, 0.0, 0.0),
        )  # fmt: skip


def _add_camera(spec: Any, rng: Generator) -> BoardSighting:
    """Looking at the board from 20 to 89 degrees above it, so near that the board fills the picture."""
    view = math.radians(rng.uniform(28, 75))
    focal = SIDE / 2 / math.tan(view / 2)
    elevation, azimuth = math.radians(rng.uniform(20, 89)), rng.uniform(0, math.tau)
    back = np.array([
        math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)
    ])  # fmt: skip
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    roll = rng.normal(0, 0.12)
    up = np.cross(back, right)
    right, up = math.cos(roll) * right + math.sin(roll) * up, math.cos(roll) * up - math.sin(roll) * right
    aim = np.array([*rng.normal(0, 0.25, 2), rng.uniform(0, 0.8)])
    fill = rng.uniform(0.62, 1.0)
    near, far = 3.0, 60.0
    for _ in range(30):  # bisection: how far the camera stands back
        distance = (near + far) / 2
        seen = _flat(aim + distance * back, right, up, back, focal)
        corners = moved(seen, OUTER_CORNERS) - (SIDE - 1) / 2
        behind = (seen[2] @ np.array([[0, 8, 8, 0], [0, 0, 8, 8], [1, 1, 1, 1]]) <= _NEAREST).any()
        near, far = (distance, far) if behind or np.abs(corners).max() > fill * SIDE / 2 else (near, distance)
    eye = aim + far * back
    spec.worldbody.add_camera(name="eye", pos=eye * _METRES, xyaxes=(*right, *up), fovy=math.degrees(view))
    return BoardSighting(_flat(eye, right, up, back, focal), 0.0, 1.0, "drawn", oriented=True)


def _flat(eye: Array, right: Array, up: Array, back: Array, focal: float) -> Array:
    """Homography from the board's squares, a1's corner first, to pixels."""
    rows = np.stack([right, -up, -back])
    camera = np.array([[focal, 0, (SIDE - 1) / 2], [0, focal, (SIDE - 1) / 2], [0, 0, 1.0]])
    middle = rows @ (np.array([-4.0, -4.0, 0.0]) - eye)
    out: Array = camera @ np.column_stack([rows[:, 0], rows[:, 1], middle])
    return out


def _spoilt(picture: Picture, sighting: BoardSighting, rng: Generator) -> Picture:
    """What lens, sensor, photographer and file format do to a picture."""
    light = _shadow(rng)[..., None] if chance(rng, 0.35) else np.ones((1, 1, 1), np.float32)
    light = light * (rng.uniform(0.6, 1.5) * rng.uniform(0.85, 1.15, 3)).astype(np.float32)
    exposed = np.clip(picture.astype(np.float32) / 255 * light, 0, 1)
    out: npt.NDArray[np.float32] = np.power(exposed, np.float32(rng.uniform(0.7, 1.4)))
    if chance(rng, 0.25):  # greyed out around the board, with or without the heads of the last row
        out[~_around(sighting, rng.uniform(0.1, 0.9))] = rng.uniform(0.2, 0.6)
    if chance(rng, 0.6):
        out = np.asarray(cv2.GaussianBlur(out, (0, 0), rng.uniform(0.4, 2.2)), dtype=np.float32)
    if chance(rng, 0.2):
        out = _shaken(out, rng)
    out += rng.normal(0, rng.uniform(0.0, 0.04), out.shape).astype(np.float32)
    if chance(rng, 0.06):
        out[:] = out.mean(axis=2, keepdims=True)
    spoilt = (np.clip(out, 0, 1) * 255).astype(np.uint8)
    if chance(rng, 0.7):
        _, coded = cv2.imencode(".jpg", spoilt, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(35, 96))])
        return np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR), dtype=np.uint8)
    return spoilt


def _shadow(rng: Generator) -> npt.NDArray[np.float32]:
    """(SIDE, SIDE) light left where something outside the picture takes some."""
    mask = np.zeros((SIDE, SIDE), np.float32)
    corners = rng.uniform(-0.2, 1.2, 2) * SIDE + rng.normal(0, 0.3 * SIDE, (int(rng.integers(3, 7)), 2))
    cv2.fillConvexPoly(mask, cv2.convexHull(corners.astype(np.int32)), 1.0)
    soft = cv2.GaussianBlur(mask, (0, 0), rng.uniform(1, 25))
    return np.asarray(1 - rng.uniform(0.2, 0.65) * soft, dtype=np.float32)


def _around(sighting: BoardSighting, margin: float) -> npt.NDArray[np.bool_]:
    low, high = -margin, 8 + margin
    quad = sighting.pixels([[low, low], [high, low], [high, high], [low, high]])
    mask = np.zeros((SIDE, SIDE), np.uint8)
    cv2.fillConvexPoly(mask, np.clip(quad, -9999, 9999).round().astype(np.int32), 1)
    return mask > 0


def _shaken(picture: npt.NDArray[np.float32], rng: Generator) -> npt.NDArray[np.float32]:
    length, angle = int(rng.integers(3, 8)), rng.uniform(0, math.pi)
    kernel = np.zeros((length, length), np.float32)
    half = (length - 1) / 2
    ends = [
        (round(half + s * half * math.cos(angle)), round(half + s * half * math.sin(angle))) for s in (-1, 1)
    ]
    cv2.line(kernel, ends[0], ends[1], 1.0)
    return np.asarray(cv2.filter2D(picture, -1, kernel / kernel.sum()), dtype=np.float32)
