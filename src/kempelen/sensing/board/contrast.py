"""How the squares of a lattice differ from their neighbours: the chequered pattern as numbers.

Every edge between two neighbouring squares gives a few numbers, one for each place along it: by how much the
square that should be light is lighter than the one that should be dark, along the colour axis in which this
board's squares differ most. 1 is what the edges between certain corners show; where there is no pattern the
numbers scatter about 0. Differences of neighbours hardly feel the light, a shadow or a piece on one of the
two.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Picture
from kempelen.core.geometry import Array
from kempelen.sensing.board.lattice import TINY, Indices, apply

_SAMPLES = 10  # a side of a square
_STRIP = slice(1, 4)  # of those, from the edge inwards: off the blurred edge, off the piece in the middle
_LENGTH = slice(1, -1)  # along the edge, off its ends
PLACES = _SAMPLES - 2
"""Along an edge, that are measured."""
_RIDGE = 0.02  # of the difference's own square: keeps the axis from noise when few edges are known
_FEWEST = 4  # certain edges without which no axis is estimated


@dataclass(frozen=True, slots=True, eq=False)
class Contrasts:
    """Of a block of squares; NaN where the picture ends.

    Attributes:
        origin: (2,) the lattice point of the block's first square.
        across: (rows, columns + 1, places) contrasts along the edge at a column's left side, with the square
            to its left.
        down: (rows + 1, columns, places) along the edge at a row's upper side, with the square above it.
        seen: (rows, columns) whether a square's middle is in the picture.
        strength: Grey levels that a contrast of 1 stands for.
    """

    origin: Indices
    across: Array
    down: Array
    seen: npt.NDArray[np.bool_]
    strength: float


def measure_contrasts(
    picture: Picture, homography: Array, indices: Indices, low: Indices, size: tuple[int, int]
) -> Contrasts | None:
    """Contrasts of a block of squares; None without certain edges.

    Args:
        picture: Blue, green, red.
        homography: From lattice points to its pixels.
        indices: (n, 2) lattice points at which a corner was seen.
        low: First lattice point of the block.
        size: Its columns and rows of squares.
    """
    cells, seen = _sampled(picture, homography, low, size)
    left, right = (half[:, :, _LENGTH, _STRIP].mean(axis=3) for half in (cells, cells[:, :, :, ::-1]))
    top, bottom = (half[:, :, _STRIP, _LENGTH].mean(axis=2) for half in (cells, cells[:, :, ::-1]))
    rows, columns = seen.shape
    across = np.full((rows, columns + 1, PLACES, 3), np.nan)
    down = np.full((rows + 1, columns, PLACES, 3), np.nan)
    across[:, 1:-1] = left[:, 1:] - right[:, :-1]
    down[1:-1] = top[1:] - bottom[:-1]
    light = np.where(np.add.outer(np.arange(rows) + low[1], np.arange(columns) + low[0]) % 2 == 0, -1.0, 1.0)
    across[:, 1:-1] *= light[:, 1:, None, None]
    down[1:-1] *= light[1:, :, None, None]
    certain = _certain(across, down, indices - low)
    if len(certain) < _FEWEST:
        return None
    axis = _axis(certain)
    strength = float(np.median(certain @ axis))
    if not strength > 0:
        return None
    return Contrasts(low, across @ axis / strength, down @ axis / strength, seen, strength)


def _sampled(
    picture: Picture, homography: Array, low: Indices, size: tuple[int, int]
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """(rows, columns, samples, samples, 3) colours, NaN off the picture; (rows, columns) middles in it."""
    columns, rows = size
    fine = (np.arange(max(size) * _SAMPLES) + 0.5) / _SAMPLES
    x, y = np.meshgrid(low[0] + fine[: columns * _SAMPLES], low[1] + fine[: rows * _SAMPLES])
    pixels, depth = apply(homography, np.column_stack([x.ravel(), y.ravel()]))
    height, width = picture.shape[:2]
    inside = ((pixels >= 0) & (pixels <= (width - 1, height - 1))).all(axis=1)
    inside &= depth * _sign_at(homography, low, size) > 0
    maps = np.where(inside[:, None], pixels, 0).astype(np.float32).reshape(*x.shape, 2)
    colours = cv2.remap(
        picture, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    values = np.where(inside.reshape(*x.shape, 1), colours.astype(np.float64), np.nan)
    blocks = values.reshape(rows, _SAMPLES, columns, _SAMPLES, 3).transpose(0, 2, 1, 3, 4)
    middle = inside.reshape(rows, _SAMPLES, columns, _SAMPLES)[:, _SAMPLES // 2, :, _SAMPLES // 2]
    return blocks, middle


def _sign_at(homography: Array, low: Indices, size: tuple[int, int]) -> float:
    """Sign of the denominator in the middle of the block, which is on this side of the horizon."""
    middle = np.asarray(low, dtype=np.float64) + np.asarray(size) / 2
    return float(np.sign(homography[2, :2] @ middle + homography[2, 2]))


def _certain(across: Array, down: Array, places: Indices) -> Array:
    """(n, 3) differences over the edges whose two ends are corners that were seen."""
    rows, columns = across.shape[0], down.shape[1]
    corner = np.zeros((rows + 2, columns + 2), dtype=bool)
    usable = ((places >= 0) & (places <= (columns, rows))).all(axis=1)
    corner[places[usable, 1], places[usable, 0]] = True
    upright = corner[:rows, : columns + 1] & corner[1 : rows + 1, : columns + 1]
    level = corner[: rows + 1, :columns] & corner[: rows + 1, 1 : columns + 1]
    both = np.concatenate([across[upright], down[level]])
    known = both[np.isfinite(both).all(axis=(1, 2))]
    out: Array = np.median(known, axis=1)
    return out


def _axis(differences: Array) -> Array:
    """(3,) the colour axis that tells light from dark best (Fisher's), the middle taken for the mean."""
    middle = np.median(differences, axis=0)
    around = differences - middle
    spread = around.T @ around / len(around)
    spread += _RIDGE * max(float(middle @ middle), 1.0) * np.eye(3)
    axis = np.linalg.solve(spread, middle)
    return np.asarray(axis / max(float(np.linalg.norm(axis)), TINY), dtype=np.float64)
