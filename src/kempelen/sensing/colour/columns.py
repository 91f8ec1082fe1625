"""Upright columns over the squares, cut out of a picture.

A piece stands up from its square and leans away from the camera. What is at height z over a point g of the
board is seen where the ray through it meets the board plane, at c + (g - c) * h / (h - z), with the camera h
over the point c of that plane. A slice of all 64 columns at one height is therefore one picture of the
board plane, scaled about the point under the camera.
"""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Frame, Picture
from kempelen.core.errors import SensorError
from kempelen.core.geometry import Array
from kempelen.sensing.sighting import BoardSighting

Columns = npt.NDArray[np.float32]
"""(64, slices, n, n, 3), squares in python-chess order; the first row of a slice is its far rank side."""

Plane = npt.NDArray[np.float32]
"""(n, n, 3) of the board from above with a margin."""

MARGIN = 1.5  # squares; a king of 1.9 squares leans out that far under a camera at 40 degrees
LOWEST = 2.0  # squares over the board; a camera below that sees no board, only a bad estimate does
SMALLEST = 6.0  # pixels a square: below that pieces are specks


def camera_over_board(frame: Frame, sighting: BoardSighting, focal: float) -> Array:
    """(3,) where the camera is, in squares of the board frame.

    From the pose where it is known; else from the homography and the intrinsics, or, without those, square
    pixels, the optical axis through the middle and a focal length of ``focal`` longer sides (Zhang 2000).
    """
    if sighting.camera_from_board is not None and sighting.square:
        return np.asarray(sighting.camera_from_board.inverse().translation) / sighting.square
    height, width = picture_of(frame).shape[:2]
    length = focal * max(height, width)
    matrix = np.array([[length, 0.0, (width - 1) / 2], [0.0, length, (height - 1) / 2], [0.0, 0.0, 1.0]])
    if frame.colour_camera is not None:
        matrix = frame.colour_camera.matrix
    pose = np.linalg.solve(matrix, sighting.image_from_board)
    pose /= np.sqrt(np.linalg.norm(pose[:, 0]) * np.linalg.norm(pose[:, 1]))
    axes, _, turn = np.linalg.svd(pose[:, :2], full_matrices=False)
    across = axes @ turn  # nearest pair of orthonormal axes
    rotation = np.column_stack([across, np.cross(across[:, 0], across[:, 1])])
    centre: Array = -rotation.T @ pose[:, 2]
    centre[2] = max(abs(centre[2]), LOWEST)  # negative when the picture is mirrored
    return centre


def picture_of(frame: Frame) -> Picture:
    """The colour picture.

    Raises:
        SensorError: there is none, or it is not (height, width, 3) bytes.
    """
    picture = frame.colour
    if picture is None:
        raise SensorError(
            f"Frame {frame.sequence} has no colour picture.",
            hint="Turn the camera's colour stream on, or read the board by depth.",
        )
    if picture.ndim != 3 or picture.shape[2] != 3 or picture.dtype != np.uint8:  # noqa: PLR2004 - the format
        raise SensorError(
            f"Frame {frame.sequence} holds a picture of {picture.dtype} {picture.shape}, wanted bytes "
            "(height, width, 3).",
            hint="Set the camera to BGR, 8 bits a channel.",
        )
    return picture


def square_pixels(sighting: BoardSighting) -> float:
    """Pixels of the picture on the side of an average square."""
    return float(np.sqrt(abs(cv2.contourArea(sighting.corners.astype(np.float32))))) / 8


def plane(frame: Frame, sighting: BoardSighting, pixels: int) -> Plane:
    """BGR, 0 to 255, of the board from straight above with `MARGIN` squares around it, a8 at the top left.

    Args:
        frame: With a colour picture.
        sighting: Where the board is in it.
        pixels: Of a square's side.

    Raises:
        SensorError: no colour picture, or the board is too small in it.
    """
    picture, side = picture_of(frame), square_pixels(sighting)
    if side < SMALLEST:
        raise SensorError(
            f"A square is {side:.1f} pixels wide in the picture, at least {SMALLEST:g} are needed.",
            hint="Move the camera closer, or choose a higher resolution.",
        )
    small, small_from_board = _shrunk(picture, sighting, pixels / side)
    n, step = round((8 + 2 * MARGIN) * pixels), 1 / pixels
    board_from_plane = np.array(
        [[step, 0.0, step / 2 - MARGIN], [0.0, -step, 8 + MARGIN - step / 2], [0.0, 0.0, 1.0]]
    )
    seen = cv2.warpPerspective(
        small, small_from_board @ board_from_plane, (n, n),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    return seen.astype(np.float32)


def cut(seen: Plane, camera: Array, heights: Sequence[float]) -> Columns:
    """(64, len(heights), pixels, pixels, channels) of the columns over all squares.

    Args:
        seen: The board from above, in whatever channels.
        camera: (3,) where it was taken from, squares, board frame.
        heights: Of the slices over the board, squares.
    """
    return np.stack([_slice(seen, camera, height) for height in heights], axis=1)


def tiles(board: Plane) -> Columns:
    """(64, pixels, pixels, channels) squares of (8 * pixels, 8 * pixels, channels), in python-chess order."""
    pixels = len(board) // 8
    cells = board.reshape(8, pixels, 8, pixels, -1).transpose(0, 2, 1, 3, 4)
    return cells[::-1].reshape(64, pixels, pixels, -1)


def board_of(squares: Columns) -> Plane:
    """(8 * pixels, 8 * pixels, channels): `tiles` undone."""
    pixels = squares.shape[1]
    cells = squares.reshape(8, 8, pixels, pixels, -1)[::-1]
    return cells.transpose(0, 2, 1, 3, 4).reshape(8 * pixels, 8 * pixels, -1)


def without_margin(seen: Plane) -> Plane:
    """The eight by eight squares of a plane picture."""
    edge = round(len(seen) * MARGIN / (8 + 2 * MARGIN))
    return seen[edge:-edge, edge:-edge]


def _slice(seen: Plane, camera: Array, height: float) -> Columns:
    """(64, pixels, pixels, channels) at one height: the plane picture, scaled about the camera."""
    pixels = len(seen) / (8 + 2 * MARGIN)
    grow = camera[2] / max(camera[2] - height, LOWEST / 2)
    foot = np.array([camera[0], 8 - camera[1]])  # squares right and down of a8's outer corner
    start = ((1 - grow) * foot + MARGIN) * pixels + (grow - 1) / 2
    matrix = np.array([[grow, 0.0, start[0]], [0.0, grow, start[1]]])
    side = round(8 * pixels)
    out = cv2.warpAffine(
        seen, matrix, (side, side), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    return tiles(np.asarray(out, dtype=np.float32))


def _shrunk(picture: Picture, sighting: BoardSighting, scale: float) -> tuple[Picture, Array]:
    """The board's part of the picture, averaged down to the size it is needed in, so that nothing aliases."""
    height, width = picture.shape[:2]
    corners = sighting.corners
    room = MARGIN / 8 * 1.5 * float(np.ptp(corners, axis=0).max())  # perspective makes near squares larger
    left, top = np.clip(np.floor(corners.min(axis=0) - room), 0, (width - 1, height - 1)).astype(int)
    right, bottom = np.clip(np.ceil(corners.max(axis=0) + room), (left + 1, top + 1), (width, height)).astype(
        int
    )
    part = picture[top:bottom, left:right]
    shift = np.array([[1.0, 0.0, -left], [0.0, 1.0, -top], [0.0, 0.0, 1.0]])
    if scale < 1:
        size = (max(1, round((right - left) * scale)), max(1, round((bottom - top) * scale)))
        sx, sy = size[0] / (right - left), size[1] / (bottom - top)
        part = np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        shift = np.array([[sx, 0.0, (sx - 1) / 2], [0.0, sy, (sy - 1) / 2], [0.0, 0.0, 1.0]]) @ shift
    return part, shift @ sighting.image_from_board
