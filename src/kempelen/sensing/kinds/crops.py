"""Height-extended crops of the squares: what the piece classifier is shown, in training and in a game alike.

A piece stands in its square and rises out of it, away from the point below the camera. Each crop is turned so
that the board's vertical points up, scaled so that a square is equally long in all, and put so that the
square's centre lies at one place; so the foot of a piece is where the network expects it, its size does not
depend on the distance, and its height only on its kind and on the elevation of the camera. The fourth channel
marks the square itself, which shows that elevation.

Light is taken out by the board: its own dark squares become 0 and its light squares 1, the colours beside
them on the same scale (channels are not stretched one by one: on a brown board there is little blue).
"""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Picture
from kempelen.core.geometry import Array
from kempelen.sensing.sighting import BoardSighting, moved

WIDTH, HEIGHT = 64, 96
"""Of a crop, pixels."""
SQUARE_PIXELS = 34.0
"""Length of a square's side in a crop, where its foot is: a king of two squares fits, seen from the side."""
FOOT = (31.5, 73.5)
"""Where the square's centre lies in a crop."""
DARKEST, LIGHTEST = -1.0, 2.0
"""Range kept, in units of the board's contrast above its dark squares."""
CENTRES = np.stack([np.arange(64) % 8, np.arange(64) // 8], axis=1) + 0.5
"""(64, 2) squares: the centres, in python-chess order."""

Crops = npt.NDArray[np.uint8]

_QUAD = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
_NOTHING = (128, 128, 128)  # beyond the picture's edge
_MOST_DETAIL = 1.5  # times SQUARE_PIXELS: a larger picture is shrunk first, so that nothing aliases
_EDGE = 0.36  # of a square from its centre: bare board is seen there beside most pieces
_LEAST_CONTRAST = 12.0  # grey values: below it light and dark squares are noise
_USUAL_FOCAL, _SHORTEST, _LONGEST = 0.95, 0.5, 4.0  # of the picture's longer side: phones and webcams
_FOCAL_WEIGHT = 0.002  # of the usual focal length against the board's own evidence (see Stand.of)


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """How the space over the board is seen.

    Attributes:
        projection: (3, 4) from squares (x along the files, y along the ranks, z up) to pixels.
        focal: Pixels.
    """

    projection: Array
    focal: float

    @classmethod
    def of(cls, sighting: BoardSighting, width: int, height: int) -> Self:
        """From a sighting, by its pose where it has one, else by square pixels and a centred lens.

        A homography K [r1 r2 t] has orthogonal columns r1 and r2 of one length: two equations in 1/f², solved
        by least squares (Zhang, "A flexible new technique for camera calibration", 2000). Seen from straight
        above they say nothing, so the usual focal length is one more equation of little weight.
        """
        if sighting.camera_from_board is not None and sighting.square is not None:
            pose = sighting.camera_from_board
            columns = np.column_stack([pose.rotation[:, :2] * sighting.square, pose.translation])
            camera = sighting.image_from_board @ np.linalg.inv(columns)
            camera /= camera[2, 2]
            third = camera @ pose.rotation[:, 2] * sighting.square
            flat = camera @ columns
            return cls(np.insert(flat, 2, third, axis=1), float(camera[0, 0]))
        return cls._guessed(sighting.image_from_board, width, height)

    @classmethod
    def _guessed(cls, image_from_board: Array, width: int, height: int) -> Self:
        size = max(width, height)
        camera = np.array([[size, 0, (width - 1) / 2], [0, size, (height - 1) / 2], [0, 0, 1.0]])
        flat = np.linalg.inv(camera) @ image_from_board
        flat *= 8.0 / float(flat[2] @ [4.0, 4.0, 1.0])
        (x1, y1, z1), (x2, y2, z2) = flat[:, 0], flat[:, 1]
        known = np.array([x1 * x2 + y1 * y2, (x1 * x1 + y1 * y1 - x2 * x2 - y2 * y2) / 2])
        wanted = -np.array([z1 * z2, (z1 * z1 - z2 * z2) / 2])
        usual = _USUAL_FOCAL**-2
        inverse = (known @ wanted + _FOCAL_WEIGHT * usual) / (known @ known + _FOCAL_WEIGHT)
        focal = float(np.clip(max(inverse, 1e-9) ** -0.5, _SHORTEST, _LONGEST))
        camera[0, 0] = camera[1, 1] = focal * size
        flat[:2] /= focal
        side = float(np.linalg.norm(flat[:, :2], axis=0).mean())
        up = np.cross(flat[:, 0], flat[:, 1]) / side
        if up @ (flat @ [4.0, 4.0, 1.0]) > 0:  # up is towards the camera
            up = -up
        return cls(camera @ np.insert(flat, 2, up, axis=1), focal * size)

    def pixels(self, points: Array) -> Array:
        """(n, 2) pixels of (n, 3) points over the board, squares."""
        out = points @ self.projection[:, :3].T + self.projection[:, 3]
        result: Array = out[:, :2] / out[:, 2:]
        return result

    def scale(self, points: Array) -> Array:
        """(n,) pixels that a square's length facing the camera takes at (n, 3) points."""
        camera_rows = self.projection[2]
        depth = points @ camera_rows[:3] + camera_rows[3]
        # Row three of K [R|t] is a unit vector per length unit: its length is the side of a square.
        result: Array = self.focal * np.linalg.norm(camera_rows[:3]) / depth
        return result


def crops(picture: Picture, sighting: BoardSighting) -> Crops:
    """(64, 96, 64, 4) of the squares in python-chess order: blue, green, red, and the square itself.

    Args:
        picture: (height, width, 3) blue, green, red.
        sighting: Where the board is in it.
    """
    height, width = picture.shape[:2]
    stand = Stand.of(sighting, width, height)
    feet = np.column_stack([CENTRES, np.zeros(64)])
    scales = stand.scale(feet)
    shrink = min(1.0, _MOST_DETAIL * SQUARE_PIXELS / float(np.quantile(scales, 0.9)))
    small = _shrunk(levelled(picture, sighting), shrink)
    foot, top = stand.pixels(feet), stand.pixels(feet + np.array([0.0, 0.0, 1.0]))
    grown = np.array([[1 / shrink, 0, 0.5 / shrink - 0.5], [0, 1 / shrink, 0.5 / shrink - 0.5], [0, 0, 1]])
    out = np.empty((64, HEIGHT, WIDTH, 4), np.uint8)
    for square in range(64):
        turn = _similarity(foot[square], top[square] - foot[square], SQUARE_PIXELS / scales[square])
        quad = stand.pixels(np.column_stack([CENTRES[square] + _QUAD, np.zeros(4)]))
        out[square, ..., 3] = _marked(quad @ turn[:, :2].T + turn[:, 2])
        out[square, ..., :3] = cv2.warpAffine(
            small, turn @ grown, (WIDTH, HEIGHT), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT,
            borderValue=_NOTHING,
        )  # fmt: skip
    return out


def levelled(picture: Picture, sighting: BoardSighting) -> Picture:
    """The picture with the board's dark squares at a third and its light ones at two thirds of the range."""
    dark, light = levels(picture, sighting)
    gain = 255.0 / (LIGHTEST - DARKEST) / max(light - dark, _LEAST_CONTRAST)
    table = np.clip((np.arange(256) - dark) * gain - DARKEST * 255.0 / (LIGHTEST - DARKEST), 0, 255)
    return np.asarray(cv2.LUT(picture, table.round().astype(np.uint8)), dtype=np.uint8)


def levels(picture: Picture, sighting: BoardSighting) -> tuple[float, float]:
    """Grey values of the board's dark and light squares: medians of what is seen near their corners."""
    points = (CENTRES[:, None] + _EDGE * 2 * _QUAD).reshape(-1, 2)
    where = moved(sighting.image_from_board, points).round().astype(int)
    inside = ((where >= 0) & (where < (picture.shape[1], picture.shape[0]))).all(axis=1)
    colour = (np.repeat((CENTRES - 0.5).sum(axis=1).astype(int) % 2, 4) == 1)[inside]
    grey = picture[where[inside, 1], where[inside, 0]].astype(float) @ (0.114, 0.587, 0.299)
    if not (colour.any() and (~colour).any()):
        return 64.0, 192.0
    first, second = float(np.median(grey[~colour])), float(np.median(grey[colour]))
    return min(first, second), max(first, second)


def _shrunk(picture: Picture, factor: float) -> Picture:
    if factor >= 1.0:
        return picture
    size = (max(1, round(picture.shape[1] * factor)), max(1, round(picture.shape[0] * factor)))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _similarity(foot: Array, up: Array, scale: float) -> Array:
    """(2, 3) affine matrix that puts a foot in its place with ``up`` upwards."""
    length = float(np.hypot(*up))
    x, y = up / length if length > 0 else (0.0, -1.0)
    turn = scale * np.array([[-y, x], [-x, -y]])
    return np.column_stack([turn, FOOT - turn @ foot])


def _marked(quad: Array) -> Crops:
    out = np.zeros((HEIGHT, WIDTH), np.uint8)
    cv2.fillConvexPoly(out, np.clip(quad, -500, 500).round().astype(np.int32), 255)
    return out
