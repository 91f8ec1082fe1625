"""Pictures of the board's top and of the table's, to be drawn as textures."""

import math
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.twin.look import Look

Paint = npt.NDArray[np.uint8]

PAINT_SIZE = 1024
"""Side of the board's picture, pixels: with squares of 50 mm 2.4 to the millimetre, finer than a camera's."""
CLOTH_SIZE = 256
"""Side of the table top's repeated picture, pixels."""
_LETTER = 21
"""Height of OpenCV's plain letters at scale 1, pixels."""
_FILES = 8
_GRAIN = (181, 9)
"""Length and width of a streak in wood, pixels (odd)."""


@lru_cache(maxsize=8)
def board_paint(look: Look, square: float) -> Paint:
    """(n, n, 3) RGB picture of the board's whole top: column along x, row against y, a8 at the top left.

    Args:
        look: Colours.
        square: Side of a square, mm.
    """
    scale = _scale(look, square)
    at = (np.arange(PAINT_SIZE) + 0.5) / scale - look.border_width
    index = np.floor(at / square).astype(int)
    inside = (index >= 0) & (index < _FILES)
    chequer = (index[None, :] + index[::-1, None]) % 2 == 1  # a1, file 0 and rank 0, is dark
    field = inside[None, :] & inside[::-1, None]
    picture = np.where(chequer[..., None], look.light, look.dark)
    picture = np.where(field[..., None], picture, look.border)
    picture *= 1 + look.grain * _grain(look.seed, chequer & field)[..., None]
    paint = np.ascontiguousarray(np.clip(picture * 255, 0, 255).astype(np.uint8))
    _add_line(paint, look, square, scale)
    if look.coordinates:
        _add_coordinates(paint, look, square, scale)
    paint.setflags(write=False)
    return paint


def board_pixels(look: Look, square: float, points: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
    """(n, 2) columns and rows (from below) in `board_paint`'s picture of (n, 3) points of the board, mm."""
    return (points[:, :2] + look.border_width) * _scale(look, square)


def sampled(picture: npt.NDArray[Any], at: npt.NDArray[np.floating]) -> npt.NDArray[Any]:
    """(n, ...) values of a square picture at (n, 2) columns and rows, rows from below."""
    last = picture.shape[0] - 1
    column, row = np.clip(at.astype(np.int64), 0, last).T
    out: npt.NDArray[Any] = picture[last - row, column]
    return out


def _scale(look: Look, square: float) -> float:
    """Pixels of the board's picture to a millimetre."""
    return PAINT_SIZE / (8 * square + 2 * look.border_width)


@lru_cache(maxsize=8)
def table_paint(look: Look) -> Paint:
    """(n, n, 3) RGB picture of a patch of the table top that is repeated."""
    rng = np.random.default_rng(look.seed + 1)
    noise = np.tile(rng.standard_normal((CLOTH_SIZE, CLOTH_SIZE)), (2, 2))  # so that its edges fit together
    half = CLOTH_SIZE // 2
    pattern = cv2.GaussianBlur(noise, (0, 0), 1.5)[half : half + CLOTH_SIZE, half : half + CLOTH_SIZE]
    pattern *= look.cloth / pattern.std()
    picture = np.clip(np.array(look.table) * (1 + pattern[..., None]), 0, 1)
    return (picture * 255).astype(np.uint8)


def _grain(seed: int, turned: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
    """(n, n) streaks of unit spread; across where ``turned``, as in inlaid boards."""
    noise = np.random.default_rng(seed).standard_normal((PAINT_SIZE, PAINT_SIZE)).astype(np.float32)
    streaks = cv2.blur(cv2.GaussianBlur(noise, (0, 0), 1.0), _GRAIN)
    streaks = streaks / streaks.std()
    return np.asarray(np.where(turned, streaks, streaks.T), dtype=np.float64)


def _add_line(paint: Paint, look: Look, square: float, scale: float) -> None:
    if look.line > 0 and look.border_width > 0:
        low = round(look.border_width * scale)
        high = round((look.border_width + 8 * square) * scale)
        colour = [int(255 * c) for c in look.light]
        cv2.rectangle(paint, (low, low), (high, high), colour, max(1, round(look.line * scale)), cv2.LINE_AA)


def _add_coordinates(paint: Paint, look: Look, square: float, scale: float) -> None:
    """Letters along the ranks 1 and 8, digits along the files a and h, to be read from White's side."""
    height = 0.55 * look.border_width * scale
    if height < 1:
        return
    n, margin = PAINT_SIZE, look.border_width * scale / 2
    for i in range(8):
        along = (look.border_width + (i + 0.5) * square) * scale
        for across in (margin, n - margin):
            _write(paint, chr(ord("a") + i), (along, across), height, look)
            _write(paint, str(i + 1), (across, n - along), height, look)


def _write(paint: Paint, text: str, centre: tuple[float, float], height: float, look: Look) -> None:
    size, font = height / _LETTER, cv2.FONT_HERSHEY_SIMPLEX
    thick = max(1, round(1.6 * size))
    (width, tall), _ = cv2.getTextSize(text, font, size, thick)
    where = (math.floor(centre[0] - width / 2), math.floor(centre[1] + tall / 2))
    colour = [int(255 * c) for c in look.light]
    cv2.putText(paint, text, where, font, size, colour, thick, cv2.LINE_AA)
