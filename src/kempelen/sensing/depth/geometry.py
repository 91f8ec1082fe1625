"""Depth pixels as points over the board.

The depth camera's own measurement of the board says where the plane is, the colour picture where the squares
are on it: a constant error of a time-of-flight camera's distance then cancels, and no pose is needed.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.errors import BoardNotFoundError, CalibrationError
from kempelen.core.geometry import Array, Transform
from kempelen.sensing.depth.plane import Plane, fit_board_plane
from kempelen.sensing.sighting import OUTER_CORNERS, BoardSighting

MARGIN = 1.5
"""Squares around the board that are looked at too: a hand comes from there, taken pieces lie there."""

_CEILING = 260.0  # mm above the board: as high as a hand is looked for
_PLANE_POINTS = 6000
_PIXELS_PER_CELL = 2.2  # along a side, so that a cell has about five points
_CELLS = (4, 8)
_EDGE_ON = -1e-6  # rise of a ray towards the plane: above it the two never meet

Pixels = npt.NDArray[np.float32]
Cells = npt.NDArray[np.int32]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Cameras:
    """Of one frame's depth and colour pictures.

    Attributes:
        depth: Intrinsics of the depth picture.
        colour: Intrinsics of the colour picture.
        colour_from_depth: From the depth camera's frame to the colour camera's.
    """

    depth: Intrinsics
    colour: Intrinsics
    colour_from_depth: Transform

    @classmethod
    def of(cls, frame: Frame) -> "Cameras":
        """Of a frame; a depth picture registered to a colour picture of unknown intrinsics lends it its own.

        Raises:
            CalibrationError: there is no depth, or it cannot be related to the colour picture.
        """
        if frame.depth_camera is None:
            raise CalibrationError(
                "Nobody knows the intrinsics of the depth camera.",
                hint="Take its maker's values, or choose colour only.",
            )
        colour = frame.colour_camera
        if colour is None and frame.colour is not None:
            factor = frame.colour.shape[1] / frame.depth_camera.width
            colour = frame.depth_camera.scaled(factor)
        return cls(frame.depth_camera, colour or frame.depth_camera, frame.colour_from_depth)

    def same_as(self, other: "Cameras") -> bool:
        """Whether a geometry of these cameras holds for the other ones too."""
        return (
            self.depth == other.depth
            and self.colour == other.colour
            and np.array_equal(self.colour_from_depth.matrix, other.colour_from_depth.matrix)
        )


@dataclass(frozen=True, eq=False)
class BoardView:
    """The part of a depth picture that looks at the board, and what a depth means in each of its pixels.

    Board coordinates are affine in the measured depth z: ``z * gains + offsets``.

    Attributes:
        rows: Of the depth picture.
        columns: Of the depth picture.
        gains: (3, h, w) squares, squares and mm per mm of depth: x, y and height.
        offsets: (3,) squares, squares, mm.
        plane: The board, in the depth camera's frame.
        square: Side of a square, mm, as depth measures it.
        cells: Along the side of a square, of the grid that heights are collected in.
        foot: (2,) squares: the point of the board's plane under the depth camera.
        elevation: Of the camera as seen from the board's centre, radians.
    """

    rows: slice
    columns: slice
    gains: Pixels
    offsets: tuple[float, float, float]
    plane: Plane
    square: float
    cells: int
    foot: Array
    elevation: float

    @property
    def size(self) -> int:
        """Cells along a side of the whole grid, margins included."""
        return round((8 + 2 * MARGIN) * self.cells)

    @cached_property
    def bare(self) -> Cells:
        """(h, w) cell of the bare board that each pixel looks at; -1 outside the grid."""
        with np.errstate(divide="ignore"):
            depth = -self.offsets[2] / self.gains[2]
        depth[~np.isfinite(depth) | (depth <= 0)] = 0
        return self.cell_of(depth)[0]

    @cached_property
    def expected(self) -> Pixels:
        """(size, size) pixels that look at each cell of a bare board."""
        return self.count(self.bare.ravel())

    def cell_of(self, depth: Pixels) -> tuple[Cells, Pixels]:
        """(h, w) cell that each measured point is in, -1 outside the grid, and its height, mm."""
        x, y = (
            np.floor((depth * self.gains[axis] + (self.offsets[axis] + MARGIN)) * self.cells).astype(np.int32)
            for axis in (0, 1)
        )
        height = depth * self.gains[2] + np.float32(self.offsets[2])
        size = self.size
        outside = (x < 0) | (y < 0) | (x >= size) | (y >= size) | (depth <= 0)
        index = y * size + x
        index[outside] = -1
        return index, height

    def count(self, index: Cells, weights: Pixels | None = None) -> Pixels:
        """(size, size) how many of a list of cells are each cell, or the sum of their weights."""
        total = np.bincount(index + 1, weights=weights, minlength=self.size**2 + 1)[1:]
        return total.reshape(self.size, self.size).astype(np.float32)

    def crop(self, depth: Pixels) -> Pixels:
        """(h, w) the part of a depth picture that looks at the board."""
        return depth[self.rows, self.columns]


def view_board(frame: Frame, sighting: BoardSighting) -> BoardView:
    """Relate the depth picture of a frame to a board seen in its colour picture.

    Raises:
        CalibrationError: the frame has no depth, or nobody knows how it relates to the colour picture.
        BoardNotFoundError: the depth picture does not show the board that the colour picture shows.
    """
    cameras = Cameras.of(frame)
    plane = fit_board_plane(_board_points(depth_of(frame), cameras, sighting))
    return place_board(cameras, sighting, plane)


def depth_of(frame: Frame) -> Pixels:
    """The depth picture of a frame that must have one.

    Raises:
        CalibrationError: it has none, or one of another size than its camera's.
    """
    if frame.depth is None or frame.depth_camera is None:
        raise CalibrationError(
            "The frame has no depth picture with known intrinsics.",
            hint="Use a depth camera, or choose colour only.",
        )
    wanted = (frame.depth_camera.height, frame.depth_camera.width)
    if frame.depth.shape != wanted:
        raise CalibrationError(
            f"The depth picture has {frame.depth.shape} rows and columns, its intrinsics say {wanted}.",
            hint="Read the intrinsics of the mode that the camera runs in.",
        )
    return frame.depth


def place_board(cameras: Cameras, sighting: BoardSighting, plane: Plane) -> BoardView:
    """The view of a board whose plane is known, in the depth camera's frame."""
    origin, along = _lattice_on_plane(cameras, sighting, plane)
    square = float(np.sqrt(np.linalg.norm(along[0]) * np.linalg.norm(along[1])))
    to_squares = np.linalg.pinv(along.T)
    rows, columns = _window(cameras.depth, origin, along, plane.normal)
    pixels = np.stack(
        np.meshgrid(np.arange(columns.start, columns.stop), np.arange(rows.start, rows.stop)), -1
    )
    rays = cameras.depth.rays(pixels.astype(np.float64))
    axes = np.concatenate([to_squares, plane.normal[None]])
    middle = to_squares @ (np.zeros(3) - origin) - 4.0
    return BoardView(
        rows=rows,
        columns=columns,
        gains=np.ascontiguousarray(np.moveaxis(rays @ axes.T, -1, 0), dtype=np.float32),
        offsets=(*(to_squares @ -origin).tolist(), plane.offset),
        plane=plane,
        square=square,
        cells=_cells(cameras.depth, origin, along),
        foot=to_squares @ -origin,
        elevation=float(np.arctan2(plane.offset, square * np.linalg.norm(middle))),
    )


def _board_points(depth: Pixels, cameras: Cameras, sighting: BoardSighting) -> Array:
    """(n, 3) measured points that the colour picture shows inside the board."""
    step = max(1, round(float(np.sqrt(depth.size / 40_000))))
    v, u = np.nonzero(depth[::step, ::step] > 0)
    points = cameras.depth.rays(np.stack([u, v], -1) * step) * depth[v * step, u * step, None]
    seen = cameras.colour_from_depth @ points
    ahead = seen[:, 2] > 0
    points, seen = points[ahead], seen[ahead]
    where = sighting.board_points(cameras.colour.project(seen))
    inside = points[((where > OUTER_CORNERS.min()) & (where < OUTER_CORNERS.max())).all(axis=1)]
    sample: Array = inside[:: max(1, len(inside) // _PLANE_POINTS)]
    return sample


def _lattice_on_plane(cameras: Cameras, sighting: BoardSighting, plane: Plane) -> tuple[Array, Array]:
    """a1's outer corner (3,) and the steps along files and ranks (2, 3), mm, in the depth camera's frame."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(9.0), np.arange(9.0)))
    depth_from_colour = cameras.colour_from_depth.inverse()
    rays = cameras.colour.rays(sighting.pixels(np.stack([x, y], -1))) @ depth_from_colour.rotation.T
    start = depth_from_colour.translation
    away = rays @ plane.normal
    if (away > _EDGE_ON).any():
        raise BoardNotFoundError(
            "The board's plane, as depth measures it, lies edge-on to the colour camera.",
            hint="Depth and colour do not belong together, or the camera is too low.",
        )
    points = start - rays * ((start @ plane.normal + plane.offset) / away)[:, None]
    design = np.stack([np.ones_like(x), x, y], -1)
    fitted = np.linalg.lstsq(design, points, rcond=None)[0]
    return fitted[0], fitted[1:]


def _window(camera: Intrinsics, origin: Array, along: Array, normal: Array) -> tuple[slice, slice]:
    """Rows and columns that can show anything up to the ceiling over the board and its margin."""
    edge = np.linspace(-MARGIN, 8 + MARGIN, 5)
    x, y = (axis.ravel() for axis in np.meshgrid(edge, edge))
    ground = origin + np.stack([x, y], -1) @ along
    solid = np.concatenate([ground, ground + _CEILING * normal])
    pixels = camera.project(solid[solid[:, 2] > 1.0])
    low = np.floor(pixels.min(axis=0)).astype(int)
    high = np.ceil(pixels.max(axis=0)).astype(int) + 1
    columns = slice(max(int(low[0]), 0), min(int(high[0]), camera.width))
    rows = slice(max(int(low[1]), 0), min(int(high[1]), camera.height))
    if rows.stop <= rows.start or columns.stop <= columns.start:
        raise BoardNotFoundError(
            "The depth camera does not look at the board that the colour camera sees.",
            hint="The transform between the two cameras is wrong: calibrate them.",
        )
    return rows, columns


def _cells(camera: Intrinsics, origin: Array, along: Array) -> int:
    """As fine a grid as the depth picture has points for."""
    middle = origin + 4 * along.sum(axis=0)
    corners = camera.project(np.stack([middle, middle + along[0], middle + along[1]]))
    (ax, ay), (bx, by) = corners[1] - corners[0], corners[2] - corners[0]
    side = float(np.sqrt(abs(ax * by - ay * bx)))
    even = 2 * round(side / _PIXELS_PER_CELL / 2)  # the margin is a whole number of cells
    return int(np.clip(even, *_CELLS))
