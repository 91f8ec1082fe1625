"""Kinect for Windows v2 through libfreenect2."""

import time
from types import TracebackType
from typing import Any, Self

import numpy as np

from kempelen.core.camera import Depth, Frame, Intrinsics, Picture
from kempelen.core.errors import CameraError
from kempelen.core.geometry import Array, Transform
from kempelen.sensing.cameras.counting import Counter
from kempelen.sensing.cameras.libraries import library
from kempelen.sensing.cameras.registration import rotation_between

_COLOUR = (1920, 1080)
_DEPTH = (512, 424)
_TICK = 1.25e-4  # s; of the device's time stamps
_DEPTH_Q, _COLOUR_Q = 0.01, 0.002199  # scales of the polynomials (libfreenect2, registration.cpp)
_TERMS = ((3, 0), (0, 3), (2, 1), (1, 2), (2, 0), (0, 2), (1, 1), (1, 0), (0, 1), (0, 0))
_GRID = 25
_APART = 1 / 60  # s; pictures closer than this belong together
_KINDS = 2
_CHANNELS = 3


class Kinect2Camera:
    """Colour 1920 x 1080 and depth 512 x 424, up to 30 Hz.

    The device delivers mirrored pictures; they are turned back here, intrinsics and all.
    """

    def __init__(self) -> None:
        self.name = "Kinect v2"
        self.settings: dict[str, Any] = {}

    def __enter__(self) -> Self:
        """Start it.

        Raises:
            CameraError: the library is missing, or no such camera.
        """
        self._freenect = library(
            "freenect2", "Kinect v2", "kinect2", "libfreenect2 with its udev rules, and a USB 3 port"
        )
        try:
            self._device = self._freenect.Device()
        except self._freenect.NoDeviceError as error:
            raise CameraError(
                "No Kinect v2 is connected, or another program uses it.",
                hint="Connect it by USB 3 and its own power supply, and install libfreenect2's udev rules.",
            ) from error
        self._device.start()
        self._learn()
        self._counter = Counter()
        self._newest: dict[Any, Any] = {}
        return self

    def _learn(self) -> None:
        """What the factory wrote into the camera."""
        infrared, colour = self._device.ir_camera_params, self._device.color_camera_params
        depth = Intrinsics(
            *_DEPTH, infrared.fx, infrared.fy, infrared.cx, infrared.cy,
            (infrared.k1, infrared.k2, infrared.p1, infrared.p2, infrared.k3),
        )  # fmt: skip
        seen = Intrinsics(*_COLOUR, colour.fx, colour.fy, colour.cx, colour.cy)
        pose, off = colour_from_depth(infrared, colour)
        self._depth_camera, self._colour_camera = mirrored(depth), mirrored(seen)
        self._pose = _mirrored_pose(pose)
        self.settings = {"colour": list(_COLOUR), "depth": list(_DEPTH), "registration_fit_px": round(off, 2)}

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop it."""
        self._device.stop()
        self._device.close()

    def read(self, timeout: float) -> Frame | None:
        """The next pair of pictures; each comes by itself, and both are numbered."""
        deadline = time.monotonic() + timeout
        wanted = (self._freenect.FrameType.Color, self._freenect.FrameType.Depth)
        while (left := deadline - time.monotonic()) > 0:
            try:
                kind, picture = self._device.get_next_frame(timeout=left)
            except self._freenect.NoFrameReceivedError:
                return None
            if kind in wanted:
                self._newest[kind] = picture
            if len(self._newest) == _KINDS and self._together():
                pair = [self._newest.pop(each) for each in wanted]
                return self._frame(*pair)
        return None

    def _together(self) -> bool:
        one, other = (picture.timestamp * _TICK for picture in self._newest.values())
        return bool(abs(one - other) <= _APART)

    def _frame(self, colour: Any, depth: Any) -> Frame:
        return Frame(
            sequence=self._counter.count(depth.sequence),
            time=colour.timestamp * _TICK,
            colour=self._picture(colour),
            depth=_measured(depth.to_array()),
            colour_camera=self._colour_camera,
            depth_camera=self._depth_camera,
            colour_from_depth=self._pose,
            depth_time=depth.timestamp * _TICK,
            dropped=self._counter.dropped,
        )

    def _picture(self, frame: Any) -> Picture:
        """Copied, since the library gives its own memory."""
        array = frame.to_array()[:, ::-1, :_CHANNELS]
        if frame.format is self._freenect.FrameFormat.RGBX:
            array = array[:, :, ::-1]
        picture: Picture = np.ascontiguousarray(array)
        picture.setflags(write=False)
        return picture


def _measured(array: Any) -> Depth:
    """What is not positive and finite was not measured."""
    depth: Depth = np.where(np.isfinite(array) & (array > 0), array, 0).astype(np.float32)[:, ::-1]
    depth = np.ascontiguousarray(depth)
    depth.setflags(write=False)
    return depth


def mirrored(camera: Intrinsics) -> Intrinsics:
    """Of the same camera with its pictures turned left to right."""
    k1, k2, p1, p2, k3 = camera.distortion
    return Intrinsics(
        camera.width, camera.height, camera.fx, camera.fy, camera.width - 1 - camera.cx, camera.cy,
        (k1, k2, p1, -p2, k3),
    )  # fmt: skip


def _mirrored_pose(pose: Transform) -> Transform:
    flip = np.diag([-1.0, 1.0, 1.0])
    return Transform(flip @ pose.rotation @ flip, flip @ pose.translation)


def colour_from_depth(infrared: Any, colour: Any) -> tuple[Transform, float]:
    """A rigid transform that says what the device's own registration says.

    The device holds polynomials for where a far point appears in the colour picture, and a shift along the
    rows that falls with the distance: that is a rotation, a shift along x, and what is left of the colour
    lens's distortion.

    Args:
        infrared: Parameters of the depth camera, as libfreenect2 gives them.
        colour: Those of the colour camera.

    Returns:
        The transform (mm), before the pictures are turned, and how far it is from the polynomials: RMS,
        pixels of colour.
    """
    columns, rows = np.meshgrid(np.linspace(0, _DEPTH[0] - 1, _GRID), np.linspace(0, _DEPTH[1] - 1, _GRID))
    x, y = (columns.ravel() - infrared.cx), (rows.ravel() - infrared.cy)
    rays = np.stack([x / infrared.fx, y / infrared.fy, np.ones_like(x)], axis=-1)
    wx = _polynomial(colour, "mx", x * _DEPTH_Q, y * _DEPTH_Q) / _COLOUR_Q
    wy = _polynomial(colour, "my", x * _DEPTH_Q, y * _DEPTH_Q) / _COLOUR_Q
    far = np.stack(
        [wx / colour.fx - colour.shift_m / colour.shift_d, wy / colour.fy, np.ones_like(x)], axis=-1
    )
    rotation = rotation_between(_unit(rays), _unit(far))
    turned = rays @ rotation.T
    off = (turned[:, :2] / turned[:, 2:] - far[:, :2]) * (colour.fx, colour.fy)
    shift = np.array([float(colour.shift_m), 0.0, 0.0])
    return Transform(rotation, shift), float(np.sqrt((off**2).sum(axis=1).mean()))


def _polynomial(colour: Any, name: str, x: Array, y: Array) -> Array:
    total: Array = np.zeros_like(x)
    for i, j in _TERMS:
        total = total + float(getattr(colour, f"{name}_x{i}y{j}")) * x**i * y**j
    return total


def _unit(vectors: Array) -> Array:
    out: Array = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return out
