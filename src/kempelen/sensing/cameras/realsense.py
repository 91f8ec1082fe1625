"""Intel RealSense D4xx through librealsense."""

from dataclasses import replace
from types import TracebackType
from typing import Any, Self

import numpy as np

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.errors import CameraError
from kempelen.sensing.cameras.counting import Counter
from kempelen.sensing.cameras.lenses import fitted, inverse, rational
from kempelen.sensing.cameras.libraries import library
from kempelen.sensing.cameras.registration import rigid

_MM = 1000.0


class RealSenseCamera:
    """Colour and depth, each as its own camera took it, with the factory's calibration between them.

    Args:
        serial: Of the camera wanted; empty for any.
        colour: Width and height, pixels.
        depth: Width and height, pixels; 848 x 480 is what the D435's stereo does best.
        fps: Frames/s of both.
    """

    def __init__(
        self,
        serial: str = "",
        *,
        colour: tuple[int, int] = (1280, 720),
        depth: tuple[int, int] = (848, 480),
        fps: int = 30,
    ) -> None:
        self.name = f"RealSense {serial}".rstrip()
        self.settings: dict[str, Any] = {}
        self._serial = serial
        self._colour = colour
        self._depth = depth
        self._fps = fps

    def __enter__(self) -> Self:
        """Start both streams.

        Raises:
            CameraError: the library is missing, no such camera, in use, or it has no such mode.
        """
        rs = library(
            "pyrealsense2", "RealSense camera", "realsense", "a USB 3 port and librealsense's udev rules"
        )
        self._require_device(rs)
        wanted = rs.config()
        if self._serial:
            wanted.enable_device(self._serial)
        wanted.enable_stream(rs.stream.color, *self._colour, rs.format.bgr8, self._fps)
        wanted.enable_stream(rs.stream.depth, *self._depth, rs.format.z16, self._fps)
        self._pipeline = rs.pipeline()
        try:
            profile = self._pipeline.start(wanted)
        except RuntimeError as error:
            raise CameraError(
                f"The {self.name} does not start with colour {self._colour[0]} x {self._colour[1]} and depth "
                f"{self._depth[0]} x {self._depth[1]} px at {self._fps} frames/s: {error}.",
                hint="Use a USB 3 port, end other programs that use it, or ask for a smaller mode.",
            ) from error
        self._learn(rs, profile)
        self._counter = Counter()
        return self

    def _require_device(self, rs: Any) -> None:
        found = [device.get_info(rs.camera_info.serial_number) for device in rs.context().query_devices()]
        if not found or (self._serial and self._serial not in found):
            which = f"with serial number {self._serial} " if self._serial else ""
            raise CameraError(
                f"No RealSense camera {which}is connected.",
                hint=f"Connected: {', '.join(found) or 'none'}. Plug it into a USB 3 port.",
            )

    def _learn(self, rs: Any, profile: Any) -> None:
        """Intrinsics, registration and unit of the depth."""
        colour = profile.get_stream(rs.stream.color).as_video_stream_profile()
        depth = profile.get_stream(rs.stream.depth).as_video_stream_profile()
        self._colour_camera = _intrinsics(rs, colour.get_intrinsics())
        self._depth_camera = _intrinsics(rs, depth.get_intrinsics())
        between = depth.get_extrinsics_to(colour)
        rotation = np.reshape(between.rotation, (3, 3), order="F")  # librealsense stores it by columns
        self._colour_from_depth = rigid(rotation, np.array(between.translation) * _MM)
        device = profile.get_device()
        self._unit = np.float32(device.first_depth_sensor().get_depth_scale() * _MM)
        self.name = device.get_info(rs.camera_info.name)
        self.settings = {
            "serial": device.get_info(rs.camera_info.serial_number), "colour": list(self._colour),
            "depth": list(self._depth), "fps": self._fps, "depth_unit_mm": float(self._unit),
        }  # fmt: skip

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop both."""
        self._pipeline.stop()

    def read(self, timeout: float) -> Frame | None:
        """The next pair of pictures.

        Raises:
            CameraError: it was unplugged.
        """
        try:
            came, pair = self._pipeline.try_wait_for_frames(max(1, round(timeout * 1000)))
        except RuntimeError as error:
            raise CameraError(
                f"The {self.name} has failed: {error}.",
                hint="Plug it in again; it is opened again by itself.",
            ) from error
        if not came:
            return None
        colour, depth = pair.get_color_frame(), pair.get_depth_frame()
        if not colour or not depth:
            return None
        return self._frame(colour, depth)

    def _frame(self, colour: Any, depth: Any) -> Frame:
        # Copied: librealsense has few buffers, and starves when a reader keeps them.
        picture = np.array(colour.get_data(), dtype=np.uint8)
        measured = np.asarray(depth.get_data()).astype(np.float32) * self._unit
        for array in (picture, measured):
            array.setflags(write=False)
        return Frame(
            sequence=self._counter.count(depth.get_frame_number()),
            time=colour.get_timestamp() / 1000,
            colour=picture,
            depth=measured,
            colour_camera=self._colour_camera,
            depth_camera=self._depth_camera,
            colour_from_depth=self._colour_from_depth,
            depth_time=depth.get_timestamp() / 1000,
            dropped=self._counter.dropped,
        )


def _intrinsics(rs: Any, of: Any) -> Intrinsics:
    """Ours for those of a stream.

    Colour streams are described by the inverse model, which leads from the picture to the ideal direction.

    Raises:
        CameraError: a model that we cannot express.
    """
    camera = Intrinsics(of.width, of.height, of.fx, of.fy, of.ppx, of.ppy)
    k1, k2, p1, p2, k3 = (float(each) for each in of.coeffs)
    if not any((k1, k2, p1, p2, k3)):
        return camera
    if of.model == rs.distortion.brown_conrady:
        return replace(camera, distortion=(k1, k2, p1, p2, k3))
    if of.model == rs.distortion.inverse_brown_conrady:
        straighten = rational(np.array([k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]))
        return fitted(inverse(straighten), camera)[0]
    raise CameraError(
        f"This RealSense camera describes its lens by the model {of.model}, which is not supported.",
        hint="Use a camera of the D4xx series.",
    )
