"""The plane that a board lies in, from depth, and pictures as seen square on to it.

The plane itself is fitted by :func:`kempelen.sensing.depth.plane.fit_board_plane` (RANSAC, then one-sided
least
squares: men stand on a board, nothing hangs under it).
"""

import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.geometry import Array
from kempelen.sensing.board.lattice import apply, inverse
from kempelen.sensing.depth.plane import Plane, fit_board_plane
from kempelen.sensing.sighting import OUTER_CORNERS

_POINTS = 12000  # a sample of the picture is enough: the plane's error falls with the root
_SCATTER = 0.006  # of the distance: what depth cameras of this kind scatter about a plane
_LEAST_SCATTER = 3.0  # mm


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
    """The plane that most of (n, 3) points lie on, men standing on it allowed for.

    Raises:
        BoardNotFoundError: too few points, or no plane among them.
    """
    distance = float(np.median(points[:, 2])) if len(points) else 0.0
    return fit_board_plane(points, max(_LEAST_SCATTER, _SCATTER * distance))


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
    reach = 1.5 * np.array(
        [camera.width, camera.height]
    )  # a horizon's corner would need a picture without end
    flat = np.clip(np.where(np.isfinite(flat), flat, 0.0), -reach, reach)
    low, high = flat.min(axis=0), flat.max(axis=0)
    origin = middle + scale * (low[0] * across + low[1] * down)
    homography = camera.matrix @ np.column_stack([scale * across, scale * down, origin])
    return homography / homography[2, 2], np.ceil(high - low).astype(np.int64)
