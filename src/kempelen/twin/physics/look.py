"""Colours, wood and polish of what stands on the table: no contact depends on them, every camera does."""

import math
from functools import lru_cache
from typing import Annotated

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

Share = Annotated[float, Field(ge=0, le=1)]
Colour = tuple[Share, Share, Share]
Paint = npt.NDArray[np.uint8]

PAINT_SIZE = 1024
"""Side of the board's picture, pixels: 2.4 to the millimetre on 50 mm squares, finer than any camera sees it."""
CLOTH_SIZE = 256
"""Side of the table top's repeated picture, pixels."""
_LETTER = 21
"""Height of OpenCV's plain letters at scale 1, pixels."""
_GRAIN = (181, 9)
"""Length and width of a streak in wood, pixels (odd)."""


class Look(BaseModel):
    """What everything looks like; colours are red, green, blue from 0 to 1.

    Attributes:
        light: Squares.
        dark: Squares.
        border: The board around its squares.
        border_width: mm, to the board's edge.
        coordinates: Whether letters and digits stand on the border.
        line: Width of a line around the 64 squares, mm; 0 for none.
        grain: How much streaks of wood change the squares' brightness.
        table: Table top.
        cloth: How much a fine pattern changes the table top's brightness.
        tray: Trays.
        white: Pieces.
        black: Pieces.
        gloss: Of the pieces: 0 is felt, 1 is varnish.
        board_gloss: Of the board.
        seed: Of the grain.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    light: Colour = (0.87, 0.74, 0.55)
    dark: Colour = (0.50, 0.32, 0.20)
    border: Colour = (0.42, 0.26, 0.16)
    border_width: Annotated[float, Field(ge=0, le=60)] = 12.0
    coordinates: bool = True
    line: Annotated[float, Field(ge=0, le=5)] = 0.0
    grain: Annotated[float, Field(ge=0, le=0.5)] = 0.06
    table: Colour = (0.35, 0.38, 0.36)
    cloth: Annotated[float, Field(ge=0, le=0.5)] = 0.04
    tray: Colour = (0.87, 0.74, 0.55)
    white: Colour = (0.93, 0.86, 0.72)
    black: Colour = (0.22, 0.15, 0.12)
    gloss: Share = 0.5
    board_gloss: Share = 0.15
    seed: Annotated[int, Field(ge=0)] = 0


@lru_cache(maxsize=8)
def board_paint(look: Look, square: float) -> Paint:
    """(n, n, 3) RGB picture of the board's whole top: column along x, row against y, a8 at the top left.

    Args:
        look: Colours.
        square: Side of a square, mm.
    """
    n, side = PAINT_SIZE, 8 * square + 2 * look.border_width
    scale = n / side
    at = (np.arange(n) + 0.5) / scale - look.border_width
    index = np.floor(at / square).astype(int)
    inside = (index >= 0) & (index < 8)
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
    streaks /= streaks.std()
    return np.where(turned, streaks, streaks.T)


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
