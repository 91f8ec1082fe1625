"""Which corner is a1.

The picture of the empty board leaves two answers: a1 is dark, so is h8. What settles it is a known position
(white's men are the lighter ones, and where few men stand, which squares are empty), or the operator's word
on which side of the picture White sits.
"""

from dataclasses import replace
from enum import StrEnum
from typing import Any

import chess
import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Picture
from kempelen.core.geometry import Array
from kempelen.core.senses import BLACK, WHITE, states_of
from kempelen.sensing.board.placement import ROWS
from kempelen.sensing.sighting import DARK, BoardSighting, moved

_SAMPLES = 12  # a side of a square
_MIDDLE = slice(4, 8)  # of those: where a man's foot and body are
_FEWEST_REPEATED = 2  # men beside another like them: without, nobody knows how much men differ
_CLEARLY = 4.0  # standard errors by which one answer must be better
_MAD_OF_NORMAL = 0.6745  # median absolute deviation of a normal distribution, in standard deviations
_INNER = slice(2, 10)  # of the samples: without the lines between squares
_LEAST_SPREAD = 0.1  # of how much empty squares of a colour differ in grain, log
_GRAIN_RANGE = (-2.0, 6.0)  # deviations beyond which a square says no more: a shadow, a neighbour's head
_FULLER_ON_AVERAGE, _FULLER_IN_ALL = 2.5, 7.5
"""Deviations by which men's squares must be fuller than those they would stand on in the half turn: two
squares at least. On thirty photos the true turn had 3.5 to 6.1 on average, 8.4 to 63 in all."""


class Side(StrEnum):
    """Of the picture, where White sits."""

    BOTTOM = "bottom"
    TOP = "top"
    LEFT = "left"
    RIGHT = "right"


_TOWARDS = {
    Side.BOTTOM: np.array([0.0, 1.0]),
    Side.TOP: np.array([0.0, -1.0]),
    Side.LEFT: np.array([-1.0, 0.0]),
    Side.RIGHT: np.array([1.0, 0.0]),
}

_HALF_TURN = np.array([[-1.0, 0.0, ROWS], [0.0, -1.0, ROWS], [0.0, 0.0, 1.0]])
_QUARTER_TURN = np.array([[0.0, -1.0, ROWS], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def board_from_window(pixels_from_window: Array, *, dark_corner: bool) -> Array:
    """(3, 3) homography from squares of the board plane, a1 dark, White nearer to the picture's bottom.

    Args:
        pixels_from_window: From a window whose y axis runs to the right of its x axis, as pictures do.
        dark_corner: Whether the window's square at its origin is dark.
    """
    mirror = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, ROWS], [0.0, 0.0, 1.0]])
    # the window's lower left square is the one at y = 7: of the other colour than that at its origin
    upright = pixels_from_window @ mirror
    turned: Array = upright @ _QUARTER_TURN if dark_corner else upright
    return nearest_side(turned, Side.BOTTOM)


def unmirrored(pixels_from_window: Array) -> Array:
    """The same window with its y axis to the right of its x axis, as pictures have it."""
    if np.linalg.det(pixels_from_window) * pixels_from_window[2, 2] > 0:
        return pixels_from_window
    swapped: Array = pixels_from_window[:, [1, 0, 2]]
    return swapped


def half_turned(image_from_board: Array) -> Array:
    """The same board with h8 for a1."""
    out: Array = image_from_board @ _HALF_TURN
    return out


def four_turns(image_from_board: Array) -> list[Array]:
    """The same board with each of its corners for a1, by quarter turns."""
    return [image_from_board @ np.linalg.matrix_power(_QUARTER_TURN, turns) for turns in range(4)]


def nearest_side(image_from_board: Array, side: Side) -> Array:
    """Of the two turns with a1 dark, that with White nearer to a side of the picture."""
    white, black = moved(image_from_board, np.array([[4.0, 0.0], [4.0, 8.0]]))
    towards = float((white - black) @ _TOWARDS[side])
    return image_from_board if towards >= 0 else half_turned(image_from_board)


def turned_to(sighting: BoardSighting, side: Side) -> BoardSighting:
    """With White where the operator says."""
    return replace(sighting, image_from_board=nearest_side(sighting.image_from_board, side), oriented=True)


def turned_by_position(sighting: BoardSighting, picture: Picture, position: chess.BaseBoard) -> BoardSighting:
    """With a known position told from its half turn by where the lighter men stand, else by where men stand.

    ``oriented`` stays False where the picture does not tell: a position that looks the same from the other
    side, or men whose brightness hardly differs on squares that its half turn would fill as well.
    """
    scores = [_agreement(square_contrast(image, picture), position) for image in _both(sighting)]
    best = int(np.argmax(scores))
    certain = scores[best] > _CLEARLY and scores[best] - scores[1 - best] > _CLEARLY
    if not certain:
        fuller = _fuller(_grain(sighting.image_from_board, picture), position)
        best, certain = int(fuller < 0), bool(fuller)
    image = _both(sighting)[best] if certain else sighting.image_from_board
    return replace(sighting, image_from_board=image, oriented=bool(certain))


def square_contrast(image_from_board: Array, picture: Picture) -> Array:
    """(64,) brightness of the middle of each square against the empty squares of its colour, grey levels.

    The reference is the median over the squares of that colour: half of them are empty in every position.
    """
    blocks = _sampled(image_from_board, cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))
    middle = np.median(blocks[:, _MIDDLE, :, _MIDDLE], axis=(1, 3)).ravel()
    for colour in (DARK, ~DARK):
        middle[colour] -= np.median(middle[colour])
    return middle


def _sampled(image_from_board: Array, picture: npt.NDArray[Any]) -> Array:
    """(8, samples, 8, samples, …) the picture on a grid over the board, rank by rank."""
    grid = (np.arange(ROWS * _SAMPLES) + 0.5) / _SAMPLES
    x, y = np.meshgrid(grid, grid)
    spots = moved(image_from_board, np.column_stack([x.ravel(), y.ravel()])).astype(np.float32)
    across, down = (spots[:, axis].reshape(x.shape) for axis in (0, 1))
    seen = cv2.remap(picture, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(seen, dtype=np.float64).reshape(ROWS, _SAMPLES, ROWS, _SAMPLES, *seen.shape[2:])


def _grain(image_from_board: Array, picture: Picture) -> Array:
    """(64,) how little each square is of one colour, log: a man on it makes it many."""
    blocks = _sampled(image_from_board, cv2.cvtColor(picture, cv2.COLOR_BGR2LAB).astype(np.float32))
    scatter = blocks[:, _INNER, :, _INNER].std(axis=(1, 3)).sum(axis=-1)
    grain: Array = np.log1p(scatter.ravel())
    return grain


def _fuller(grain: Array, position: chess.BaseBoard) -> float:
    """Deviations by which a position fits better than its half turn (positive), or worse; 0: not clearly.

    What counts are squares on which men stand in only one of the two; how empty squares look is learned from
    those that are empty in both.
    """
    full = states_of(position) > 0
    turned = full[::-1]
    away = np.zeros(64)
    for shade in (DARK, ~DARK):
        bare = grain[shade & ~full & ~turned]
        if not len(bare):
            return 0.0
        usual = np.median(bare)
        spread = max(float(np.median(np.abs(bare - usual))) / _MAD_OF_NORMAL, _LEAST_SPREAD)
        away[shade] = np.clip((grain[shade] - usual) / spread, *_GRAIN_RANGE)
    told = int(np.count_nonzero(full & ~turned))
    total = float(away[full & ~turned].sum() - away[turned & ~full].sum())
    return total if abs(total) >= max(_FULLER_IN_ALL, _FULLER_ON_AVERAGE * told) else 0.0


def _both(sighting: BoardSighting) -> tuple[Array, Array]:
    return sighting.image_from_board, half_turned(sighting.image_from_board)


def _agreement(contrast: Array, position: chess.BaseBoard) -> float:
    """By how many standard errors White's men are brighter than Black's, where both stand on like squares.

    A man is seen against its square: White's on light squares look darker than Black's on dark ones. So each
    colour of square has its own difference, and they are weighed together as in a two-way layout, with one
    spread for the men of one colour on squares of one colour.
    """
    states = states_of(position)
    difference = weight = scatter = 0.0
    freedom = 0
    for shade in (DARK, ~DARK):
        bright, dim = contrast[shade & (states == WHITE)], contrast[shade & (states == BLACK)]
        for men in (bright, dim):
            scatter += float(men.var() * len(men)) if len(men) else 0.0
            freedom += max(len(men) - 1, 0)
        if len(bright) and len(dim):
            counts = len(bright) * len(dim) / (len(bright) + len(dim))
            difference += counts * float(bright.mean() - dim.mean())
            weight += counts
    if freedom < _FEWEST_REPEATED or not weight:
        return 0.0
    spread = np.sqrt(scatter / freedom / weight)
    return float(difference / weight / max(spread, 1.0))
