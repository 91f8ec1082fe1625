"""Where the board is in space: from its picture and the camera's intrinsics."""

import cv2
import numpy as np

from kempelen.core.camera import Intrinsics
from kempelen.core.geometry import Array, Transform
from kempelen.sensing.board.placement import GRID
from kempelen.sensing.sighting import moved


def camera_from_board(
    image_from_board: Array, square: float, intrinsics: Intrinsics
) -> tuple[Transform, float] | None:
    """Pose of the board in the camera's frame, mm, and the RMS distance in pixels that it leaves.

    A planar homography with known intrinsics has up to two poses (Collins and Bartoli 2014); the one with the
    lesser residual is refined over the 81 lattice points by Levenberg-Marquardt.

    Args:
        image_from_board: (3, 3) from squares to pixels, with a1's outer corner at (0, 0).
        square: Side of a square, mm.
        intrinsics: Of the colour camera.

    Returns:
        None when no pose has the board's upper side towards the camera.
    """
    pixels = moved(image_from_board, GRID)
    points = np.column_stack([GRID * square, np.zeros(len(GRID))])
    distortion = np.array(intrinsics.distortion)
    try:
        found, turns, shifts, _ = cv2.solvePnPGeneric(
            points, pixels, intrinsics.matrix, distortion, flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:
        return None
    best: tuple[Transform, float] | None = None
    for rough_turn, rough_shift in zip(turns[:found], shifts[:found], strict=True):
        turn, shift = cv2.solvePnPRefineLM(
            points, pixels, intrinsics.matrix, distortion, rough_turn, rough_shift
        )
        rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)
        pose = Transform(_orthonormal(rotation), np.asarray(shift, dtype=np.float64))
        in_camera = pose @ points
        if (in_camera[:, 2] <= 0).any() or float(pose.rotation[:, 2] @ in_camera[0]) >= 0:
            continue
        off = float(np.sqrt(np.mean(np.sum((intrinsics.project(in_camera) - pixels) ** 2, axis=1))))
        if best is None or off < best[1]:
            best = pose, off
    return best


def _orthonormal(rotation: Array) -> Array:
    left, _, right = np.linalg.svd(rotation)
    out: Array = left @ right
    return out
