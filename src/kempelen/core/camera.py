"""What a camera is and what it gives: intrinsics, frames, and the protocol of a driver.

The camera frame is the usual one of computer vision: x to the right, y down, z along the view; mm. Pixel
coordinates are (column, row), the centre of the first pixel at (0, 0).
"""

from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Protocol, Self

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import CalibrationError
from kempelen.core.geometry import Array, Transform

Picture = npt.NDArray[np.uint8]
Depth = npt.NDArray[np.float32]

_UNDISTORT_STEPS = 12


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A pinhole with Brown-Conrady distortion.

    Attributes:
        width: Pixels.
        height: Pixels.
        fx: Focal length in pixel widths.
        fy: Focal length in pixel heights.
        cx: Column of the principal point.
        cy: Row of the principal point.
        distortion: k1, k2, p1, p2, k3, in OpenCV's order.

    Raises:
        CalibrationError: a size or a focal length that no camera has.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        numbers = (self.fx, self.fy, self.cx, self.cy, *self.distortion)
        if self.width < 1 or self.height < 1 or not np.isfinite(numbers).all() or min(self.fx, self.fy) <= 0:
            raise CalibrationError(
                f"These intrinsics describe no camera: {self.width} x {self.height} px, focal lengths "
                f"{self.fx:g} and {self.fy:g} px.",
                hint="Sizes and focal lengths are positive and finite: take its maker's values.",
            )

    @classmethod
    def of_view(cls, width: int, height: int, horizontal_radians: float) -> Self:
        """An undistorted camera with square pixels and that horizontal field of view."""
        focal = width / 2 / float(np.tan(horizontal_radians / 2))
        return cls(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)

    @property
    def matrix(self) -> Array:
        """(3, 3) camera matrix."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def distorted(self) -> bool:
        """Whether straight lines come out bent."""
        return any(self.distortion)

    def project(self, points: npt.ArrayLike) -> Array:
        """(n, 2) pixels, distortion included, of (n, 3) points of the camera frame with z > 0."""
        points = np.asarray(points, dtype=np.float64)
        return self._pixels(self._distort(points[..., :2] / points[..., 2:3]))

    def rays(self, pixels: npt.ArrayLike) -> Array:
        """(n, 3) directions with z = 1 of (n, 2) pixels, distortion removed."""
        seen = (np.asarray(pixels, dtype=np.float64) - (self.cx, self.cy)) / (self.fx, self.fy)
        ideal = seen
        if self.distorted:
            for _ in range(_UNDISTORT_STEPS):  # fixed point: what distortion adds is subtracted
                ideal = seen - (self._distort(ideal) - ideal)
        return np.concatenate([ideal, np.ones((*ideal.shape[:-1], 1))], axis=-1)

    def scaled(self, factor: float) -> "Intrinsics":
        """Of the same camera with its picture resized by ``factor``."""
        return replace(
            self,
            width=max(1, round(self.width * factor)),
            height=max(1, round(self.height * factor)),
            fx=self.fx * factor,
            fy=self.fy * factor,
            cx=(self.cx + 0.5) * factor - 0.5,
            cy=(self.cy + 0.5) * factor - 0.5,
        )

    def _pixels(self, ideal: Array) -> Array:
        out: Array = ideal * (self.fx, self.fy) + (self.cx, self.cy)
        return out

    def _distort(self, ideal: Array) -> Array:
        if not self.distorted:
            return ideal
        k1, k2, p1, p2, k3 = self.distortion
        x, y = ideal[..., 0], ideal[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return np.stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            ],
            axis=-1,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """What a camera saw at one time; colour, depth, or both. The arrays are read-only.

    Attributes:
        sequence: Number since the camera was opened; a gap means frames that nobody saw.
        time: Of the exposure, s, on the camera's own monotonic clock; only differences mean anything.
        colour: (height, width, 3) blue, green, red; None for a pure depth camera.
        depth: (height, width) distance along the camera's z, mm, 0 where nothing was measured; None for a
            colour camera.
        colour_camera: Intrinsics of ``colour``; None when nobody knows them.
        depth_camera: Intrinsics of ``depth``; None without depth.
        colour_from_depth: From the depth camera's frame to the colour camera's. Identity for a depth
            picture that is registered to the colour picture.
        depth_time: When the depth was taken, as ``time``; None for the same instant.
        dropped: Frames that the source lost since it was opened, as far as it knows.
    """

    sequence: int
    time: float
    colour: Picture | None = None
    depth: Depth | None = None
    colour_camera: Intrinsics | None = None
    depth_camera: Intrinsics | None = None
    colour_from_depth: Transform = field(default_factory=Transform.identity)
    depth_time: float | None = None
    dropped: int = 0

    @property
    def skew(self) -> float:
        """How much later the depth was taken than the colour, s."""
        return 0.0 if self.depth_time is None else self.depth_time - self.time


class Camera(Protocol):
    """A driver for one camera: blocking, made to run in a process of its own. Constructors do no I/O."""

    name: str

    def __enter__(self) -> Self:
        """Open the camera.

        Raises:
            CameraError: no such camera, no permission, in use, a wrong format, a missing library.
        """
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        ...

    def read(self, timeout: float) -> Frame | None:
        """The next frame; None when ``timeout`` s passed without one.

        Raises:
            CameraError: the camera was unplugged, or a recording is damaged.
            EOFError: a recording or a picture has ended.
        """
        ...
