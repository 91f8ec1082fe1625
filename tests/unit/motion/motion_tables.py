"""Tables, positions and transfers for the tests of motion."""

import random
from itertools import pairwise
from math import cos, hypot, sin

import chess
import numpy as np
from hypothesis import strategies as st

from kempelen.core.geometry import Array, Transform
from kempelen.core.pieces import PRESETS
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.surfaces import Point
from kempelen.core.table import Gripper, Table, Tray, WorkSpace

WIDE = WorkSpace(lower=(-900.0, -900.0, -60.0), upper=(900.0, 900.0, 280.0))
KING, QUEEN, PAWN = (chess.Piece(kind, chess.WHITE) for kind in (chess.KING, chess.QUEEN, chess.PAWN))


def point(array: Array) -> Point:
    x, y, z = (float(v) for v in array)
    return x, y, z


def placed(**pieces: str) -> Layout:
    """``placed(e2="P", left1="q")``."""
    return Layout({Place(name): chess.Piece.from_symbol(symbol) for name, symbol in pieces.items()})


def random_board(rng: random.Random) -> chess.Board:
    board = chess.Board()
    for _ in range(rng.randrange(70)):
        moves = list(board.legal_moves)
        if not moves:
            break
        board.push(rng.choice(moves))
    return board


def random_transfer(layout: Layout, table: Table, rng: random.Random) -> Transfer:
    """Any piece to any free place: more than chess ever asks."""
    source = rng.choice(sorted(layout))
    target = rng.choice([place for place in table.places if place not in layout])
    return Transfer(layout[source], source, target)


@st.composite
def tables(draw: st.DrawFn) -> Table:
    """Any rotation, offset, lean, square size, trays at other heights, gripper at any angle."""
    scale = draw(st.floats(1.0, 1.25))
    square = 50.0 * scale
    heights = [draw(st.sampled_from([0.0, -25.0, 15.0])) for _ in range(2)]
    trays = (
        Tray(name="left", origin=(-1.9 * square, square / 2), pitch=50.0, height=heights[0]),
        Tray(name="right", origin=(8.9 * square, square / 2), pitch=50.0, height=heights[1]),
    )
    turn = draw(st.floats(-3.2, 3.2))
    middle = np.array([4 * square, 4 * square, 0.0])
    shift = np.array([draw(st.floats(-150, 150)), draw(st.floats(-150, 150)), draw(st.floats(-20, 30))])
    lean = draw(st.floats(-0.01, 0.01))
    tilt = np.array([[cos(lean), 0.0, sin(lean)], [0.0, 1.0, 0.0], [-sin(lean), 0.0, cos(lean)]])
    pose = Transform.about_z(turn) @ Transform(tilt, np.zeros(3))
    return Table(
        robot_from_board=Transform(pose.rotation, shift - pose @ middle),
        square=square,
        trays=trays,
        pieces=PRESETS[draw(st.sampled_from(["club", "thesis"]))],
        gripper=Gripper(closing_axis=draw(st.floats(-3.2, 3.2))),
        space=WIDE,
    )


def samples(vertices: Array, step: float = 0.5) -> Array:
    """Points along a polyline, no farther apart than ``step`` mm."""
    out = [vertices[:1]]
    for a, b in pairwise(vertices):
        count = max(int(np.ceil(np.linalg.norm(b - a) / step)), 1)
        out.append(a + (b - a) * np.linspace(0, 1, count + 1)[1:, None])
    return np.concatenate(out)


def distance_to_box(x: float, y: float, box: tuple[float, float, float, float]) -> float:
    return hypot(max(box[0] - x, x - box[1], 0.0), max(box[2] - y, y - box[3], 0.0))
