"""From the pinhole picture that is drawn to the pixels of a lens that bends."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Depth, Intrinsics
from kempelen.twin.cameras.models import CameraModel
from kempelen.twin.cameras.region import Region

Index = npt.NDArray[np.int32]
Slopes = npt.NDArray[np.float32]

_MARGIN = 4


@dataclass(frozen=True, slots=True, eq=False)
class DepthOptics:
    """What to draw for a depth camera, and where its rays then are.

    Attributes:
        canvas: Of the pinhole picture to draw: wide enough for all rays, as fine as the fine grid.
        fine: Grid points across a pixel.
        source: (fine h, fine w) flat index into the canvas of each point of the fine grid.
        slopes: (h, w, 2) x/z and y/z of each pixel's ray.
    """

    canvas: Intrinsics
    fine: int
    source: Index
    slopes: Slopes

    @classmethod
    def of(cls, model: CameraModel) -> Self:
        """For a model's depth camera."""
        lens, fine = model.depth, model.supersample
        slopes, dense = _slopes(lens, fine)
        focal = lens.fx * fine
        low = np.floor(dense.min(axis=(0, 1)) * focal) - _MARGIN
        size = (np.ceil(dense.max(axis=(0, 1)) * focal) - low + _MARGIN).astype(int)
        canvas = Intrinsics(int(size[0]), int(size[1]), focal, focal, float(-low[0]), float(-low[1]))
        pixel = np.rint(dense * np.float32(focal) - low.astype(np.float32)).astype(np.int32)
        return cls(canvas, fine, pixel[..., 1] * canvas.width + pixel[..., 0], slopes)

    def part(self, region: Region) -> "DepthOptics":
        """Of some pixels alone; the canvas is the same."""
        source, slopes = self.source[region.times(self.fine).slices], self.slopes[region.slices]
        return DepthOptics(self.canvas, self.fine, source, slopes)

    @property
    def extent(self) -> Region:
        """Of the canvas, what these pixels look at: its border is that of their rays."""
        source = self.source
        border = np.concatenate([source[0], source[-1], source[:, 0], source[:, -1]])
        rows, columns = np.divmod(border, self.canvas.width)
        return Region.around(np.stack([columns, rows], axis=-1).astype(float), self.canvas).grown(
            1, self.canvas.width, self.canvas.height
        )

    def on_grid(self, drawn: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
        """(fine h, fine w) of a picture (canvas h, canvas w)."""
        return np.ascontiguousarray(drawn).ravel().take(self.source)


def _slopes(lens: Intrinsics, fine: int) -> tuple[Slopes, Slopes]:
    """(h, w, 2) x/z and y/z of the pixels' rays, and (fine h, fine w, 2) of those between, interpolated."""
    rows, columns = np.mgrid[-1 : lens.height + 1, -1 : lens.width + 1]
    rays = lens.rays(np.stack([columns, rows], axis=-1).reshape(-1, 2))[:, :2]
    slopes = rays.reshape(*rows.shape, 2).astype(np.float32)
    dense = cv2.resize(slopes, None, fx=fine, fy=fine, interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(slopes[1:-1, 1:-1]), np.asarray(dense[fine:-fine, fine:-fine], np.float32)


def normals_angle(depth: Depth, slopes: Slopes, reach: int = 1) -> Depth:
    """(h, w) angle between each pixel's ray and the normal of the surface it meets, rad.

    Args:
        depth: (h, w) mm.
        slopes: (h, w, 2) of the rays.
        reach: Pixels to each side over which the surface is taken as flat.
    """
    points = np.concatenate([slopes * depth[..., None], depth[..., None]], axis=-1)
    across, down = np.zeros_like(points), np.zeros_like(points)
    across[:, reach:-reach] = points[:, 2 * reach :] - points[:, : -2 * reach]
    down[reach:-reach] = points[2 * reach :] - points[: -2 * reach]
    normal = np.cross(across, down)
    length = np.linalg.norm(normal, axis=-1) * np.linalg.norm(points, axis=-1)
    cosine = np.abs((normal * points).sum(axis=-1)) / np.maximum(length, 1e-6)
    out: Depth = np.arccos(np.clip(np.where(length > 0, cosine, 1.0), 0.0, 1.0)).astype(np.float32)
    return out
