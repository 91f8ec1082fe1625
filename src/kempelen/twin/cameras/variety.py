"""Boards, sets, light and points of view as different as they are in the world, drawn at random."""

import math
from dataclasses import replace

import chess
import numpy as np

from kempelen.core.geometry import Transform
from kempelen.core.pieces import KINDS, PRESETS, PieceSet, PieceShape
from kempelen.core.places import Layout, Place
from kempelen.core.table import Table
from kempelen.twin.cameras.settings import Lighting, Placement
from kempelen.twin.look import Colour, Look
from kempelen.twin.physics.scene import Scene, StandingPiece

# Light and dark squares of boards that are sold: woods, vinyl, plastic, marble.
_BOARDS: tuple[tuple[Colour, Colour], ...] = (
    ((0.87, 0.74, 0.55), (0.50, 0.32, 0.20)),
    ((0.93, 0.85, 0.70), (0.62, 0.42, 0.27)),
    ((0.83, 0.66, 0.45), (0.33, 0.20, 0.13)),
    ((0.94, 0.90, 0.80), (0.28, 0.45, 0.29)),
    ((0.93, 0.93, 0.85), (0.44, 0.55, 0.34)),
    ((0.92, 0.94, 0.96), (0.36, 0.52, 0.68)),
    ((0.94, 0.94, 0.93), (0.16, 0.16, 0.17)),
    ((0.80, 0.79, 0.76), (0.42, 0.42, 0.43)),
    ((0.92, 0.83, 0.72), (0.60, 0.25, 0.20)),
)
_WHITES: tuple[Colour, ...] = (
    (0.93, 0.86, 0.72), (0.85, 0.70, 0.48), (0.96, 0.95, 0.92), (0.90, 0.80, 0.58), (0.78, 0.58, 0.36),
)  # fmt: skip
_BLACKS: tuple[Colour, ...] = (
    (0.22, 0.15, 0.12), (0.08, 0.08, 0.09), (0.33, 0.17, 0.11), (0.16, 0.11, 0.09), (0.40, 0.12, 0.10),
)  # fmt: skip
_TABLES: tuple[Colour, ...] = (
    (0.35, 0.38, 0.36), (0.60, 0.45, 0.31), (0.86, 0.85, 0.83), (0.24, 0.17, 0.13), (0.15, 0.30, 0.22),
    (0.72, 0.63, 0.53), (0.45, 0.16, 0.15), (0.20, 0.24, 0.34),
)  # fmt: skip


def chance(rng: np.random.Generator, probability: float) -> bool:
    """Whether something happens that does with that probability."""
    return bool(rng.random() < probability)


def varied(rng: np.random.Generator, colour: Colour, spread: float = 0.05) -> Colour:
    """A colour like it."""
    r, g, b = np.clip(np.array(colour) * rng.normal(1, spread) + rng.normal(0, spread / 2, 3), 0.02, 1.0)
    return float(r), float(g), float(b)


def random_look(rng: np.random.Generator, square: float) -> Look:
    """Board, pieces and table top."""
    light, dark = _BOARDS[rng.integers(len(_BOARDS))]
    light, dark = varied(rng, light), varied(rng, dark)
    table = varied(rng, _TABLES[rng.integers(len(_TABLES))])
    border = (light, dark, varied(rng, dark, 0.2), table)[rng.integers(4)]
    width = 0.0 if chance(rng, 0.1) else float(rng.uniform(0.15, 0.8) * square)
    return Look(
        light=light, dark=dark, border=border, border_width=min(width, 60.0),
        coordinates=(chance(rng, 0.6)), line=float(rng.choice([0.0, 1.0, 2.0])),
        grain=float(rng.uniform(0, 0.12)), table=table, cloth=float(rng.uniform(0, 0.12)),
        white=varied(rng, _WHITES[rng.integers(len(_WHITES))]),
        black=varied(rng, _BLACKS[rng.integers(len(_BLACKS))]),
        gloss=float(rng.uniform(0, 1)), board_gloss=float(rng.uniform(0, 0.5)),
        carving=float(rng.uniform(0, 1)), room=varied(rng, (0.5, 0.5, 0.5), 0.4),
        seed=int(rng.integers(1 << 31)),
    )  # fmt: skip


def random_set(rng: np.random.Generator, square: float) -> PieceSet:
    """A preset's shapes, fitted to the square, stretched as a whole and each a little by itself."""
    base = PRESETS[str(rng.choice(sorted(PRESETS)))]
    across = square * rng.uniform(0.68, 0.85) / base.widest_base
    upwards = square * rng.uniform(1.45, 2.1) / base.tallest
    head, stem = rng.uniform(0.85, 1.25, 2)
    shapes: dict[str, PieceShape] = {}
    for kind in KINDS:
        shape = base[kind]
        wide, tall = across * rng.normal(1, 0.03), upwards * rng.normal(1, 0.05)
        foot = shape.base_diameter * wide
        shapes[chess.piece_name(kind)] = PieceShape(
            height=shape.height * tall, base_diameter=foot,
            head_diameter=min(shape.head_diameter * wide * head, foot),
            grip_height=shape.grip_height * tall, grip_diameter=min(shape.grip_diameter * wide * stem, foot),
        )  # fmt: skip
    return PieceSet(name="random", **shapes)


def random_position(rng: np.random.Generator) -> chess.Board:
    """A game of random length, played at random with a liking for captures."""
    board = chess.Board()
    for _ in range(int(rng.integers(0, 120))):
        moves = list(board.legal_moves)
        if not moves:
            break
        weights = np.array([4.0 if board.is_capture(move) else 1.0 for move in moves])
        board.push(moves[rng.choice(len(moves), p=weights / weights.sum())])
    return board


def random_scene(rng: np.random.Generator, board: chess.Board) -> Scene:
    """A position on some board with some set; a few pieces may stand beside it."""
    square = float(rng.uniform(34, 60))
    table = Table(
        robot_from_board=Transform.identity(), square=square, trays=(), pieces=random_set(rng, square)
    )
    layout = Layout({Place.at(at): piece for at, piece in board.piece_map().items()})
    scatter = float(rng.uniform(0, 0.12) * square)
    scene = Scene.from_layout(table, layout, seed=int(rng.integers(1 << 31)), scatter=scatter)
    scene = replace(scene, look=random_look(rng, square), board_thickness=float(rng.uniform(2, 25)))
    return scene.with_pieces(_aside(rng, scene)) if chance(rng, 0.5) else scene


def _aside(rng: np.random.Generator, scene: Scene) -> list[StandingPiece]:
    """Captured pieces beside the board."""
    side, edge = 8 * scene.table.square, scene.look.border_width + scene.table.square
    out = []
    for i in range(int(rng.integers(1, 7))):
        x = -edge if chance(rng, 0.5) else side + edge
        y, turn = float(rng.uniform(0, side)), float(rng.uniform(0, math.tau))
        kind, white = str(rng.choice(list("QRBNPP"))), (chance(rng, 0.5))
        out.append(StandingPiece(f"aside{i}", kind, white, x, y, -scene.depth, turn))
    return out


def random_lighting(rng: np.random.Generator, square: float) -> Lighting:
    """A lamp somewhere over the table, more or less room light, a camera that is not quite right about it."""
    side, angle = 8 * square, rng.uniform(0, math.tau)
    away, up = rng.uniform(0, 1500), rng.uniform(900, 2200)
    lamp = (side / 2 + away * math.cos(angle), side / 2 + away * math.sin(angle), up)
    share = rng.uniform(0.2, 0.8)
    total = float(rng.uniform(0.8, 1.25))
    red, green, blue = (float(gain) for gain in np.clip(rng.normal(1, 0.05, 3), 0.8, 1.2))
    return Lighting(
        lamp=lamp, brightness=total * share, ambient=total * (1 - share), shadows=(chance(rng, 0.8)),
        glare=float(rng.choice([0.0, 0.0, rng.uniform(0, 0.6)])), exposure=float(rng.uniform(0.75, 1.25)),
        white_balance=(red, green, blue),
    )  # fmt: skip


def random_placement(
    rng: np.random.Generator, square: float, view: float, elevation: tuple[float, float] = (20.0, 70.0)
) -> Placement:
    """From somewhere round the board, near enough that the board fills much of the picture.

    Args:
        rng: Of the choice.
        square: Side of a square, mm.
        view: The smaller angle of the picture, rad.
        elevation: Least and greatest angle of the view under the horizontal, degrees.
    """
    side = 8 * square
    up, turn = math.radians(rng.uniform(*elevation)), rng.uniform(0, math.tau)
    distance = rng.uniform(0.9, 1.4) * side * 0.75 / math.tan(view / 2)
    target = side / 2 + rng.uniform(-0.08, 0.08, 2) * side
    out = distance * np.array([math.cos(up) * math.cos(turn), math.cos(up) * math.sin(turn), math.sin(up)])
    position = out + np.array([*target, 0.0])
    return Placement(
        position=tuple(position.tolist()), target=(float(target[0]), float(target[1]), 0.0),
        roll=float(rng.normal(0, math.radians(3))),
    )  # fmt: skip
