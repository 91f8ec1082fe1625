"""A drawn chess board with pieces that stand up from it, seen by a camera whose place is known."""

from collections.abc import Mapping

import chess
import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Frame, Intrinsics, Picture
from kempelen.core.geometry import Array
from kempelen.sensing.sighting import BoardSighting

LENS = Intrinsics(640, 480, 520.0, 520.0, 319.5, 239.5)
LIGHT, DARK = (170, 205, 225), (60, 95, 70)
WHITE, BLACK = (200, 225, 235), (38, 34, 32)
HEIGHTS = {
    chess.PAWN: 0.8,
    chess.ROOK: 0.9,
    chess.KNIGHT: 1.1,
    chess.BISHOP: 1.2,
    chess.QUEEN: 1.5,
    chess.KING: 1.7,
}
OVER = np.array([4.6, -3.0, 11.0])


def states(board: chess.BaseBoard) -> npt.NDArray[np.int64]:
    """(64,) 0 empty, 1 white, 2 black."""
    out = np.zeros(64, dtype=np.int64)
    for square, piece in board.piece_map().items():
        out[square] = 1 if piece.color else 2
    return out


def seen(
    board: chess.BaseBoard,
    *,
    over: Array = OVER,
    gains: tuple[float, float, float] = (1.0, 1.0, 1.0),
    shade: tuple[float, float, float, float] | None = None,
    grain: int | None = None,
    aside: Mapping[int, tuple[float, float]] | None = None,
    lens: Intrinsics = LENS,
) -> tuple[Frame, BoardSighting]:
    """The picture and where the board is in it.

    Args:
        board: What stands there.
        over: (3,) camera, squares of the board frame; it looks at the middle of the board.
        gains: Of blue, green and red light.
        shade: Left, bottom, right, top of a shadow on the board, squares.
        grain: Seed of noise of two grey levels, or none.
        aside: By how much pieces stand off the middle of their square.
        lens: Intrinsics.
    """
    pose = _pose(over)
    image_from_board = lens.matrix @ np.column_stack([pose[:, 0], pose[:, 1], pose[:, 3]])
    sighting = BoardSighting(image_from_board, 0.01, 1.0, "drawn", oriented=True)
    canvas = _board(sighting, lens)
    order = sorted(board.piece_map().items(), key=lambda item: -_far(item[0], over))
    for square, piece in order:
        dx, dy = (aside or {}).get(square, (0.0, 0.0))
        _stand(canvas, lens.matrix @ pose, (square % 8 + 0.5 + dx, square // 8 + 0.5 + dy), piece)
    light = canvas.astype(np.float64) ** 2.2
    if shade is not None:
        light *= 1 - 0.55 * _shadow(canvas.shape[:2], sighting, shade)[..., None]
    light *= gains
    picture = light ** (1 / 2.2)
    if grain is not None:
        picture += np.random.default_rng(grain).normal(0, 2, picture.shape)
    return Frame(0, 0.0, np.clip(picture, 0, 255).astype(np.uint8), colour_camera=lens), sighting


def _pose(over: Array) -> Array:
    """(3, 4) from squares of the board frame to the camera's."""
    ahead = np.array([4.0, 4.0, 0.0]) - over
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(ahead, right), ahead])
    return np.column_stack([rotation, -rotation @ over])


def _far(square: int, over: Array) -> float:
    return float(np.hypot(square % 8 + 0.5 - over[0], square // 8 + 0.5 - over[1]))


def _board(sighting: BoardSighting, lens: Intrinsics) -> Picture:
    canvas = np.full((lens.height, lens.width, 3), (110, 120, 140), dtype=np.uint8)
    _fill(canvas, sighting, [(-0.4, -0.4), (8.4, -0.4), (8.4, 8.4), (-0.4, 8.4)], (50, 70, 90))
    for square in range(64):
        x, y = square % 8, square // 8
        colour = DARK if (x + y) % 2 == 0 else LIGHT
        _fill(canvas, sighting, [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)], colour)
    return canvas


def _fill(
    canvas: Picture, sighting: BoardSighting, corners: list[tuple[float, float]], colour: tuple[int, int, int]
) -> None:
    cv2.fillConvexPoly(
        canvas, np.round(sighting.pixels(corners) * 16).astype(np.int32), colour, cv2.LINE_AA, 4
    )


def _stand(canvas: Picture, matrix: Array, foot: tuple[float, float], piece: chess.Piece) -> None:
    """Discs from the foot up, lighter towards the top, with a dark rim."""
    height = HEIGHTS[piece.piece_type]
    base = np.array(WHITE if piece.color else BLACK, dtype=np.float64)
    for level in np.linspace(0, 1, 14):
        radius = 0.34 - 0.2 * level
        turn = np.linspace(0, 2 * np.pi, 25)
        ring = np.stack(
            [
                foot[0] + radius * np.cos(turn),
                foot[1] + radius * np.sin(turn),
                0 * turn + level * height,
                0 * turn + 1,
            ]
        )
        pixels = matrix @ ring
        points = np.round((pixels[:2] / pixels[2]).T * 16).astype(np.int32)
        colour = tuple(float(c) for c in base * (0.72 + 0.28 * level))
        cv2.fillConvexPoly(canvas, points, colour, cv2.LINE_AA, 4)


def _shadow(
    shape: tuple[int, int], sighting: BoardSighting, shade: tuple[float, float, float, float]
) -> Array:
    left, bottom, right, top = shade
    mask = np.zeros(shape, dtype=np.uint8)
    corners = sighting.pixels([(left, bottom), (right, bottom), (right, top), (left, top)])
    cv2.fillConvexPoly(mask, np.round(corners).astype(np.int32), 255)
    return cv2.GaussianBlur(mask, (0, 0), 3).astype(np.float64) / 255
