"""A depth picture as the colour camera would have taken it."""

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Depth, Frame, Intrinsics
from kempelen.core.errors import CameraError
from kempelen.core.geometry import Array, Transform

_MOST = 8  # pixels of colour that one of depth covers, each way, at most


class Registration:
    """Resamples depth into a colour camera, the nearest surface hiding those behind it.

    Everything that does not depend on the depth is worked out once.

    Args:
        depth_camera: Of the depth pictures.
        colour_camera: To see them from; distortion included on both sides.
        colour_from_depth: From the depth camera's frame to the colour camera's.
    """

    def __init__(
        self, depth_camera: Intrinsics, colour_camera: Intrinsics, colour_from_depth: Transform
    ) -> None:
        self.depth_camera = depth_camera
        self.colour_camera = colour_camera
        columns, rows = np.meshgrid(np.arange(depth_camera.width), np.arange(depth_camera.height))
        rays = depth_camera.rays(np.stack([columns, rows], axis=-1).reshape(-1, 2))
        self._turned = (rays @ colour_from_depth.rotation.T).astype(np.float32)
        self._shift = colour_from_depth.translation.astype(np.float32)
        ratio = max(colour_camera.fx / depth_camera.fx, colour_camera.fy / depth_camera.fy)
        self._footprint = min(_MOST, math.ceil(ratio))

    def apply(self, depth: Depth) -> Depth:
        """(height, width) mm of the colour camera; 0 where it sees nothing that was measured.

        Args:
            depth: (height, width) mm of the depth camera.

        Raises:
            CameraError: it has another size than the depth camera's pictures.
        """
        self._require(depth)
        pixels, along = self._project(depth)
        size = self._footprint
        corner = np.ceil(pixels - np.float32(size / 2)).astype(np.int32)
        height, width = self.colour_camera.height, self.colour_camera.width
        nearest = np.full(height * width, np.inf, dtype=np.float32)
        for right in range(size):
            for down in range(size):
                column, row = corner[:, 0] + right, corner[:, 1] + down
                inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
                np.minimum.at(nearest, (row * width + column)[inside], along[inside])
        nearest[np.isinf(nearest)] = 0
        return nearest.reshape(height, width)

    def project(self, depth: Depth) -> npt.NDArray[np.float32]:
        """(height, width, 2) column and row in the colour picture of each depth pixel, NaN without depth.

        No surface hides another here; it is what is needed to look up a colour or a square for a depth pixel,
        and takes a fraction of the time.

        Raises:
            CameraError: it has another size than the depth camera's pictures.
        """
        self._require(depth)
        out = np.full((depth.size, 2), np.nan, dtype=np.float32)
        out[self._measured(depth)] = self._project(depth)[0]
        return out.reshape(*depth.shape, 2)

    def _require(self, depth: Depth) -> None:
        camera = self.depth_camera
        if depth.shape != (camera.height, camera.width):
            raise CameraError(
                f"A depth picture of {depth.shape[1]} x {depth.shape[0]} px came from a camera of "
                f"{camera.width} x {camera.height} px.",
                hint="Give the intrinsics of the mode that the camera runs in.",
            )

    @staticmethod
    def _measured(depth: Depth) -> npt.NDArray[np.bool_]:
        flat = depth.ravel()
        return (flat > 0) & np.isfinite(flat)

    def _project(self, depth: Depth) -> tuple[npt.NDArray[np.float32], Depth]:
        """Pixels and z in the colour camera of what was measured, z > 0 assumed of what is in view."""
        measured = self._measured(depth)
        points = self._turned[measured] * depth.ravel()[measured, None] + self._shift
        along = np.maximum(points[:, 2], np.float32(1.0))
        camera = self.colour_camera
        if camera.distorted:
            points[:, 2] = along
            return camera.project(points).astype(np.float32), along
        flat = points[:, :2] / along[:, None]
        scale, centre = np.array([[camera.fx, camera.fy], [camera.cx, camera.cy]], dtype=np.float32)
        return (flat * scale + centre).astype(np.float32), along


def registered(frame: Frame, known: Registration | None = None) -> tuple[Frame, Registration]:
    """The frame with its depth seen from the colour camera, and what is worth keeping for the next one.

    Args:
        frame: With colour, depth and both cameras' intrinsics.
        known: From the frame before; used when it fits.

    Raises:
        CameraError: something of these is missing.
    """
    depth, seen, to = frame.depth, frame.depth_camera, frame.colour_camera
    if depth is None or seen is None or to is None:
        raise CameraError(
            "Depth cannot be registered: a frame lacks depth or the intrinsics of one of its cameras.",
            hint="Use a camera that gives both, or calibrate the colour camera.",
        )
    if known is None or known.depth_camera is not seen or known.colour_camera is not to:
        known = Registration(seen, to, frame.colour_from_depth)
    moved = replace(frame, depth=known.apply(depth), depth_camera=to, colour_from_depth=Transform.identity())
    return moved, known


def rotation_between(ours: Array, theirs: Array) -> Array:
    """(3, 3) rotation that turns (n, 3) directions onto others best, least squares.

    Source: Kabsch, Acta Crystallographica A32 (1976) 922.
    """
    left, _, right = np.linalg.svd(theirs.T @ ours)
    turn = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    out: Array = left @ turn @ right
    return out


def rigid(rotation: npt.ArrayLike, translation: Array) -> Transform:
    """From a camera's own memory, whose matrix has the accuracy of 32-bit numbers: the rotation next to it.

    Args:
        rotation: (3, 3) about.
        translation: (3,) mm.

    Raises:
        CalibrationError: it is a reflection.
    """
    left, _, right = np.linalg.svd(np.asarray(rotation, dtype=np.float64))
    return Transform(left @ right, translation)
