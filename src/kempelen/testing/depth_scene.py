"""Frames of a board with round pieces on it, cast ray by ray: exact, quick, and nothing but geometry."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.geometry import Array, Transform
from kempelen.sensing.sighting import OUTER_CORNERS, BoardSighting

SQUARE = 50.0
DEPTH_CAMERA = Intrinsics(384, 318, 274.0, 274.0, 191.5, 158.5)
COLOUR_CAMERA = Intrinsics(640, 480, 560.0, 560.0, 319.5, 239.5)
BASELINE = Transform(np.eye(3), np.array([-52.0, 0.0, 0.0]))
BROWN, CREAM, GREEN, IVORY, EBONY, SKIN = range(6)
_COLOURS = np.array(
    [[60, 90, 140], [170, 210, 230], [70, 90, 70], [235, 240, 245], [25, 25, 30], [120, 150, 210]], np.uint8
)
_HALF = 4  # squares from the board's middle to its edge
_RADIUS = 14.0
_EDGE = 0.3  # squares of frame around the squares
_THICKNESS = 20.0  # mm of the board over the table


@dataclass(frozen=True, slots=True)
class Post:
    """An upright cylinder.

    Attributes:
        x: Of its axis, mm, board frame.
        y: Of its axis.
        height: Of its top over the board.
        radius: mm.
        colour: Its own.
        bottom: Of its lower end over the board.
    """

    x: float
    y: float
    height: float
    radius: float = _RADIUS
    colour: int = IVORY
    bottom: float = 0.0


@dataclass(frozen=True)
class DepthScene:
    """A camera over a board.

    Attributes:
        tilt: Of the view against the vertical, degrees.
        distance: Of the camera from the board's middle, mm.
        turn: Of the board about its middle, degrees.
        shift: Of the board on the table, mm.
    """

    tilt: float = 20.0
    distance: float = 900.0
    turn: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)
    posts: Sequence[Post] = field(default=())

    @property
    def camera_from_board(self) -> Transform:
        """Pose of the board in the colour camera's frame."""
        a = np.radians(self.tilt)
        back, up = np.array([0.0, -np.sin(a), np.cos(a)]), np.array([0.0, np.cos(a), np.sin(a)])
        rotation = np.stack([[1.0, 0.0, 0.0], -up, -back])  # rows: right, down, forwards, in the world's axes
        camera_from_world = Transform(rotation, -rotation @ (self.distance * back))
        c, s = np.cos(np.radians(self.turn)), np.sin(np.radians(self.turn))
        spin = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        middle = np.array([4 * SQUARE, 4 * SQUARE, 0.0])
        world_from_board = Transform(spin, np.array([*self.shift, 0.0]) - spin @ middle)
        return camera_from_world @ world_from_board

    @property
    def sighting(self) -> BoardSighting:
        """As a perfect finder would report it."""
        pose = self.camera_from_board
        corners = np.column_stack([OUTER_CORNERS * SQUARE, np.zeros(4)])
        pixels = COLOUR_CAMERA.project(pose @ corners)
        homography, _ = cv2.findHomography(OUTER_CORNERS, pixels)
        return BoardSighting(
            np.asarray(homography, np.float64),
            0.0,
            1.0,
            "exact",
            oriented=True,
            square=SQUARE,
            camera_from_board=pose,
        )

    def frame(
        self,
        time: float = 0.0,
        *,
        noise: float = 0.0,
        seed: int = 0,
        dark_step: float = 0.0,
        offset: float = 0.0,
        holes: Sequence[Post] = (),
    ) -> Frame:
        """Both pictures.

        Args:
            time: Of the frame, s.
            noise: Spread of depth, mm.
            seed: Of the noise.
            dark_step: By how much farther dark squares seem, mm.
            offset: Of all depths, mm.
            holes: What returns no depth.
        """
        rng = np.random.default_rng(seed)
        board_from_colour = self.camera_from_board.inverse()
        hit, _ = self._cast(COLOUR_CAMERA, board_from_colour, self.posts)
        colour = _COLOURS[hit].astype(np.int16) + rng.normal(0, 2.0, (*hit.shape, 3)).astype(np.int16)
        board_from_depth = board_from_colour @ BASELINE
        posts = [*self.posts, *holes]
        hit, depth = self._cast(DEPTH_CAMERA, board_from_depth, posts)
        depth = (
            depth + offset + np.where(hit == BROWN, dark_step, 0.0) + rng.normal(0, noise or 1e-9, hit.shape)
        )
        for hole in holes:
            depth[self._covered(DEPTH_CAMERA, board_from_depth, hole)] = 0.0
        return Frame(
            0, time, np.clip(colour, 0, 255).astype(np.uint8), depth.astype(np.float32),
            COLOUR_CAMERA, DEPTH_CAMERA, BASELINE,
        )  # fmt: skip

    @staticmethod
    def _rays(camera: Intrinsics, board_from_camera: Transform) -> tuple[Array, Array]:
        """Where the camera is, and (h, w, 3) directions that advance its z by 1 mm, board frame."""
        columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
        rays = camera.rays(np.stack([columns, rows], -1).astype(np.float64))
        return board_from_camera.translation, rays @ board_from_camera.rotation.T

    def _cast(
        self, camera: Intrinsics, board_from_camera: Transform, posts: Sequence[Post]
    ) -> tuple[npt.NDArray[np.int64], Array]:
        """(h, w) colour that each pixel sees, and its depth."""
        start, rays = self._rays(camera, board_from_camera)
        depth = -start[2] / rays[..., 2]
        x, y = (start[axis] + depth * rays[..., axis] for axis in (0, 1))
        u, v = x / SQUARE, y / SQUARE
        hit = np.where((np.floor(u) + np.floor(v)) % 2 == 0, BROWN, CREAM)
        out = np.maximum(np.abs(u - _HALF), np.abs(v - _HALF))
        table = out > _HALF + _EDGE
        hit = np.where(out > _HALF, EBONY, hit)
        depth = np.where(table, -(start[2] + _THICKNESS) / rays[..., 2], depth)
        hit = np.where(table, GREEN, hit)
        for post in posts:
            part = _around(camera, board_from_camera.inverse(), post)
            near = _cylinder(start, rays[part], post)
            hit[part] = np.where(near < depth[part], post.colour, hit[part])
            depth[part] = np.minimum(depth[part], near)
        return hit, depth

    def _covered(self, camera: Intrinsics, board_from_camera: Transform, post: Post) -> npt.NDArray[np.bool_]:
        start, rays = self._rays(camera, board_from_camera)
        out: npt.NDArray[np.bool_] = np.isfinite(_cylinder(start, rays, post))
        return out


def _around(camera: Intrinsics, camera_from_board: Transform, post: Post) -> tuple[slice, slice]:
    """Rows and columns that a post can be seen in."""
    box = [
        (post.x + i * post.radius, post.y + j * post.radius, z)
        for i in (-1, 1) for j in (-1, 1) for z in (post.bottom, post.height)
    ]  # fmt: skip
    pixels = camera.project(camera_from_board @ np.array(box))
    low = np.maximum(np.floor(pixels.min(axis=0)).astype(int) - 1, 0)
    high = np.maximum(np.ceil(pixels.max(axis=0)).astype(int) + 2, 0)
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


def _cylinder(start: Array, rays: Array, post: Post) -> Array:
    """(h, w) depth at which rays meet an upright cylinder; infinite where they miss it."""
    dx, dy, dz = rays[..., 0], rays[..., 1], rays[..., 2]
    ox, oy = start[0] - post.x, start[1] - post.y
    lid = (post.height - start[2]) / dz
    on_lid = (ox + lid * dx) ** 2 + (oy + lid * dy) ** 2 <= post.radius**2
    a, b, c = dx**2 + dy**2, ox * dx + oy * dy, ox**2 + oy**2 - post.radius**2
    root = b**2 - a * c
    side = (-b - np.sqrt(np.maximum(root, 0))) / np.maximum(a, 1e-12)
    level = start[2] + side * dz
    on_side = (root > 0) & (side > 0) & (level >= post.bottom) & (level <= post.height)
    return np.minimum(np.where(on_lid, lid, np.inf), np.where(on_side, side, np.inf))


def men(heights: Mapping[int, float], *, black: frozenset[int] = frozenset()) -> list[Post]:
    """Pieces of those heights in the middle of squares (python-chess numbers)."""
    return [
        Post(
            (square % 8 + 0.5) * SQUARE,
            (square // 8 + 0.5) * SQUARE,
            height,
            colour=EBONY if square in black else IVORY,
        )
        for square, height in heights.items()
    ]


def start_men() -> list[Post]:
    """The start position in sizes of a club set."""
    back = (55.0, 60.0, 70.0, 85.0, 95.0, 70.0, 60.0, 55.0)
    heights = {
        square: back[square % 8] if square // 8 in {0, 7} else 45.0 for square in (*range(16), *range(48, 64))
    }
    return men(heights, black=frozenset(range(48, 64)))
