"""Where the camera cannot see: behind pieces.

What is measured under the line of sight over a piece cannot be a surface: it is a pixel that mixes the
piece's edge with what lies behind it, or a stereo matcher's bridge between the two.
"""

import cv2
import numpy as np

from kempelen.sensing.depth.geometry import MARGIN, BoardView, Pixels

_LEAST = 8.0  # mm: lower shadows are noise of the board
_HIGHEST = 130.0  # mm: shadows of taller things are a hand's
_ITSELF = 0.35  # squares: nearer than that a thing shades only its own back
_CEILING_SHARE = 0.5  # of the camera's height: nothing of a game is nearer to it


def shadow_heights(heights: Pixels, view: BoardView) -> Pixels:
    """(size, size) mm up to which the camera cannot see over each cell, for what stands before it.

    A thing of height h at a distance r from the point of the board under the camera, which is H above it,
    hides at the distance s r everything below H - (H - h) s.

    Args:
        heights: (size, size) mm over the board; NaN where nothing was measured.
        view: The geometry.
    """
    camera = view.plane.offset
    foot_x, foot_y = ((c + MARGIN) * view.cells - 0.5 for c in view.foot)
    standing = np.clip(np.nan_to_num(heights, nan=0.0), 0, min(_HIGHEST, _CEILING_SHARE * camera))
    hidden = np.zeros_like(standing)
    columns, rows = np.meshgrid(np.arange(view.size), np.arange(view.size))
    away = np.hypot(columns - foot_x, rows - foot_y).astype(np.float32)
    scale, step = 1.0, 1.0 / max(float(away.max()), 1.0)
    while camera - (camera - _HIGHEST) * (scale + step) > 0:
        scale += step
        if (camera - (camera - float(standing.max())) * scale) < _LEAST:
            break
        matrix = np.array([[scale, 0, (1 - scale) * foot_x], [0, scale, (1 - scale) * foot_y]])
        farther = cv2.warpAffine(standing, matrix, standing.shape[::-1], flags=cv2.INTER_LINEAR)
        other = away * np.float32(1 - 1 / scale) > _ITSELF * view.cells
        hidden = np.where(other, np.maximum(hidden, camera - (camera - farther) * scale), hidden)
    return np.where(hidden > _LEAST, hidden, 0).astype(np.float32)
