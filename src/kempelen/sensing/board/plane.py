"""The plane that a board lies in, from depth, and pictures as seen square on to it.

The board's own plane is fitted by :func:`kempelen.sensing.depth.plane.fit_board_plane` (MSAC, then one-sided
least squares: men stand on a board, nothing hangs under it).
"""

import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.errors import BoardNotFoundError
from kempelen.core.geometry import Array
from kempelen.sensing.board.lattice import apply, inverse
from kempelen.sensing.depth.plane import Plane, consensus, facing, fit_board_plane
from kempelen.sensing.sighting import OUTER_CORNERS

_POINTS = 12000  # a sample of the picture is enough: the plane's error falls with the root
_SCATTER = 0.006  # of the distance: what depth cameras of this kind scatter about a plane
_LEAST_SCATTER = 3.0  # mm
_DEVIATIONS = 3.0
_SCORED = 2000  # points that a plane through three of them is judged by
_ROUNDS = 5
_LEAST_SHARE = 0.2  # of the points on one plane
_FEWEST = 60


def depth_points(frame: Frame, image_from_board: Array | None = None) -> Array:
    """(n, 3) mm, colour camera's frame: a regular sample of what the depth camera measured.

    Args:
        frame: With depth and its intrinsics.
        image_from_board: Where the board is in the colour picture, for points on it alone; all when None.
    """
    if frame.depth is None or frame.depth_camera is None:
        return np.empty((0, 3))
    step = max(1, round(float(np.sqrt(frame.depth.size / _POINTS))))
    coarse = frame.depth[::step, ::step]
    rows, columns = np.nonzero(np.isfinite(coarse) & (coarse > 0))
    rays = frame.depth_camera.rays(np.column_stack([columns, rows]) * float(step))
    points = frame.colour_from_depth @ (rays * coarse[rows, columns].astype(np.float64)[:, None])
    if image_from_board is None or frame.colour_camera is None:
        return points
    places, _ = apply(inverse(image_from_board), frame.colour_camera.project(points))
    low, high = OUTER_CORNERS.min(), OUTER_CORNERS.max()
    on_board = ((places > low) & (places < high)).all(axis=1)
    out: Array = points[on_board]
    return out


def find_plane(points: Array) -> Plane:
    """The board's plane from (n, 3) points on it, men standing there allowed for.

    Raises:
        BoardNotFoundError: too few points, or no plane among them.
    """
    return fit_board_plane(points, _scatter(points))


def find_table(points: Array) -> Plane:
    """The plane that most of a scene lies on: a consensus of triples, then total least squares.

    Args:
        points: (n, 3) mm, colour camera's frame: table, floor, walls, whatever stands there.

    Raises:
        BoardNotFoundError: too few points, or no plane among them.
    """
    if len(points) < _FEWEST:
        raise BoardNotFoundError(
            f"The depth picture has {len(points)} points, at least {_FEWEST} are needed.",
            hint="Move the camera into its range of distances, and keep sunlight off the table.",
        )
    scatter = _scatter(points)
    plane = consensus(points[:: max(1, len(points) // _SCORED)], scatter)
    for _ in range(_ROUNDS):
        near = np.abs(plane.heights(points)) < _DEVIATIONS * scatter
        if near.mean() < _LEAST_SHARE:
            raise BoardNotFoundError(
                f"No table in the depth picture: {near.mean():.0%} of its points lie in one plane, at least "
                f"{_LEAST_SHARE:.0%} are needed.",
                hint="Point the camera at the table, from 0.4 to 2 m.",
            )
        plane = _least_squares(points[near])
    return plane


def _scatter(points: Array) -> float:
    distance = float(np.median(points[:, 2])) if len(points) else 0.0
    return max(_LEAST_SCATTER, _SCATTER * distance)


def _least_squares(points: Array) -> Plane:
    """Total least squares: the normal is the direction of least spread."""
    middle = points.mean(axis=0)
    squares, vectors = np.linalg.eigh((points - middle).T @ (points - middle))
    normal: Array = vectors[:, 0]
    noise = float(np.sqrt(max(squares[0], 0.0) / len(points)))
    return facing(normal, -float(normal @ middle), noise)


def meet(plane: Plane, rays: Array) -> Array:
    """(n, 3) mm, where rays (n, 3) from the camera meet a plane; NaN for those that never do."""
    slope = rays @ plane.normal
    ahead = slope < -1e-9  # noqa: PLR2004 - the normal points to the camera
    distance = np.where(ahead, -plane.offset / np.where(ahead, slope, -1.0), np.nan)
    out: Array = rays * distance[:, None]
    return out


def plane_axes(plane: Plane) -> tuple[Array, Array]:
    """Two orthonormal directions in a plane, (3,) each: a picture's right and down."""
    across = np.array([1.0, 0.0, 0.0]) - plane.normal * float(plane.normal[0])
    across = across / np.linalg.norm(across)
    return across, np.cross(across, plane.normal)


def image_from_plane(plane: Plane, camera: Intrinsics) -> tuple[Array, npt.NDArray[np.int64]]:
    """Homography from a picture square on to the plane to the camera's, and that picture's width and height.

    Its pixels are as fine as the camera's are where the view's middle meets the plane; distortion is left
    out.
    """
    across, down = plane_axes(plane)
    edge = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]])
    seen = meet(plane, camera.rays(edge * (camera.width - 1, camera.height - 1)))
    middle = seen[4] if np.isfinite(seen[4]).all() else plane.normal * -plane.offset
    scale = float(middle[2]) / camera.fx
    flat = np.column_stack([(seen - middle) @ across, (seen - middle) @ down]) / scale
    # the corner at a horizon would need a picture without end
    reach = 1.5 * np.array([camera.width, camera.height])
    flat = np.clip(np.where(np.isfinite(flat), flat, 0.0), -reach, reach)
    low, high = flat.min(axis=0), flat.max(axis=0)
    origin = middle + scale * (low[0] * across + low[1] * down)
    homography = camera.matrix @ np.column_stack([scale * across, scale * down, origin])
    return homography / homography[2, 2], np.ceil(high - low).astype(np.int64)
