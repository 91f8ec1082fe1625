"""Drawn boards whose every corner is known."""

import cv2
import numpy as np

from kempelen.core.camera import Depth, Frame, Intrinsics, Picture
from kempelen.core.geometry import Array, Transform
from kempelen.sensing.sighting import OUTER_CORNERS, BoardSighting

DARK, LIGHT, RIM, TABLE = (40, 60, 90), (170, 210, 220), (110, 140, 170), (120, 110, 100)
CAMERA = Intrinsics(640, 480, 560.0, 560.0, 319.5, 239.5)
_FINE = 40  # px a square of the drawing that is then seen in perspective


def drawn(
    image_from_board: Array,
    size: tuple[int, int] = (640, 480),
    *,
    squares: tuple[int, int] = (8, 8),
    rim: float = 0.6,
    men: dict[int, bool] | None = None,
    seed: int = 0,
    noise: float = 3.0,
) -> Picture:
    """A picture (height, width, 3) of a board, a1 dark, with discs for men (square: whether white)."""
    files, ranks = squares
    around = 1.0  # squares of flat drawing around the pattern
    wide, high = (round((count + 2 * around) * _FINE) for count in (files, ranks))
    flat = np.full((high, wide, 3), TABLE, dtype=np.uint8)
    low = round((around - rim) * _FINE)
    flat[low : high - low, low : wide - low] = RIM
    for rank in range(ranks):
        for file in range(files):
            y, x = round((rank + around) * _FINE), round((file + around) * _FINE)
            flat[y : y + _FINE, x : x + _FINE] = DARK if (file + rank) % 2 == 0 else LIGHT
    for square, white in (men or {}).items():
        middle = (round((square % 8 + 0.5 + around) * _FINE), round((square // 8 + 0.5 + around) * _FINE))
        cv2.circle(flat, middle, round(0.33 * _FINE), (235, 240, 245) if white else (15, 15, 20), -1)
    board_from_flat = np.array(
        [[1 / _FINE, 0, 0.5 / _FINE - around], [0, 1 / _FINE, 0.5 / _FINE - around], [0, 0, 1]]
    )
    seen = cv2.warpPerspective(
        flat,
        image_from_board @ board_from_flat,
        size,
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=TABLE,
    )
    soft = np.asarray(cv2.GaussianBlur(seen, (3, 3), 0), dtype=np.float64)
    grain = np.random.default_rng(seed).normal(0, noise, soft.shape)
    return np.clip(soft + grain, 0, 255).astype(np.uint8)


def view(
    *, tilt: float = 0.5, turn: float = 0.3, distance: float = 720.0, square: float = 40.0
) -> tuple[Array, Transform]:
    """image_from_board and camera_from_board of a board in the middle of CAMERA's picture; radians, mm."""
    c, s = np.cos(tilt), np.sin(tilt)
    # straight down: x stays, the board's y and z point against the camera's
    tilted = np.array([[1, 0, 0], [0, -c, -s], [0, s, -c]], dtype=np.float64)
    rotation = tilted @ Transform.about_z(turn).rotation
    middle = np.array([4 * square, 4 * square, 0.0])
    pose = Transform(rotation, np.array([0.0, 0.0, distance]) - rotation @ middle)
    return projected(pose, square), pose


def projected(pose: Transform, square: float) -> Array:
    """image_from_board of a pose in CAMERA."""
    plane = np.column_stack([pose.rotation[:, 0] * square, pose.rotation[:, 1] * square, pose.translation])
    return CAMERA.matrix @ plane


def depth_of(pose: Transform, noise: float = 1.0, seed: int = 0) -> Depth:
    """(480, 640) float32 mm of the plane that a board at ``pose`` lies in."""
    rows, columns = np.mgrid[0:480, 0:640]
    rays = CAMERA.rays(np.column_stack([columns.ravel(), rows.ravel()]))
    normal = pose.rotation[:, 2]
    depth = float(normal @ pose.translation) / (rays @ normal)
    depth += np.random.default_rng(seed).normal(0, noise, depth.shape)
    return depth.reshape(480, 640).astype(np.float32)


def frame(picture: Picture, depth: Depth | None = None) -> Frame:
    """As CAMERA gives it."""
    return Frame(0, 0.0, picture, depth, CAMERA, None if depth is None else CAMERA)


def corner_error(sighting: BoardSighting, image_from_board: Array, *, oriented: bool = False) -> float:
    """Squares: the worst outer corner, the best of the turns taken where the orientation does not count."""
    truth = BoardSighting(image_from_board, 0.0, 1.0, "truth").corners
    places = sighting.board_points(truth)
    turns = range(1) if oriented else range(4)
    return min(
        float(np.linalg.norm(places - np.roll(OUTER_CORNERS, turn, axis=0), axis=1).max()) for turn in turns
    )
