"""Azure Kinect through the Azure Kinect SDK and pyk4a."""

from types import TracebackType
from typing import Any, Self

import cv2
import numpy as np

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.errors import CameraError
from kempelen.core.geometry import Array
from kempelen.sensing.cameras.counting import PeriodCounter
from kempelen.sensing.cameras.lenses import fitted, rational
from kempelen.sensing.cameras.libraries import library
from kempelen.sensing.cameras.registration import rigid

_MM = 1000.0
_WIDTH, _HEIGHT = 1920, 1080
_DEPTH_WIDTH, _DEPTH_HEIGHT = 640, 576


class AzureKinectCamera:
    """Colour 1920 x 1080 and depth 640 x 576 (narrow view, unbinned), 30 Hz, taken together.

    The colour lens bends lines in a way that our polynomial misses by pixels in the corners: its pictures are
    rectified here. Depth must not be interpolated; its lens is met within a fiftieth of a pixel.

    Args:
        device: Number of the camera, from 0.
    """

    def __init__(self, device: int = 0) -> None:
        self.name = f"Azure Kinect {device}"
        self.settings: dict[str, Any] = {}
        self._device = device

    def __enter__(self) -> Self:
        """Start it.

        Raises:
            CameraError: the library is missing, or no such camera.
        """
        self._k4a = library(
            "pyk4a", "Azure Kinect", "azure-kinect", "Microsoft's Azure Kinect SDK (libk4a 1.4)"
        )
        k4a = self._k4a
        self._camera = k4a.PyK4A(
            k4a.Config(
                color_resolution=k4a.ColorResolution.RES_1080P,
                color_format=k4a.ImageFormat.COLOR_BGRA32,
                depth_mode=k4a.DepthMode.NFOV_UNBINNED,
                camera_fps=k4a.FPS.FPS_30,
                synchronized_images_only=True,
            ),
            device_id=self._device,
        )
        try:
            self._camera.start()
        except k4a.K4AException as error:
            raise CameraError(
                f"The {self.name} does not start.",
                hint="Connect it by USB 3 and its own power supply, and end other programs that use it.",
            ) from error
        self._learn(self._camera.calibration)
        self._counter = PeriodCounter()
        return self

    def _learn(self, calibration: Any) -> None:
        """What the factory wrote into the camera."""
        colour, depth = self._k4a.CalibrationType.COLOR, self._k4a.CalibrationType.DEPTH
        pinhole, bent = _pinhole(calibration, colour, _WIDTH, _HEIGHT), _bent(calibration, colour)
        self._straight = cv2.initUndistortRectifyMap(
            pinhole.matrix, bent, np.eye(3), pinhole.matrix, (_WIDTH, _HEIGHT), cv2.CV_16SC2
        )
        self._colour_camera = pinhole
        depth_lens = rational(_bent(calibration, depth))
        self._depth_camera, off = fitted(
            depth_lens, _pinhole(calibration, depth, _DEPTH_WIDTH, _DEPTH_HEIGHT)
        )
        rotation, translation = calibration.get_extrinsic_parameters(depth, colour)
        self._colour_from_depth = rigid(rotation, np.ravel(translation) * _MM)
        self.settings = {
            "device": self._device, "colour": [_WIDTH, _HEIGHT],
            "depth": [_DEPTH_WIDTH, _DEPTH_HEIGHT], "fps": 30,
            "colour_rectified": True, "depth_lens_fit_px": round(off, 3),
        }  # fmt: skip

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop it."""
        self._camera.stop()

    def read(self, timeout: float) -> Frame | None:
        """The next pair of pictures.

        Raises:
            CameraError: it was unplugged.
        """
        try:
            pair = self._camera.get_capture(timeout=max(1, round(timeout * 1000)))
        except self._k4a.K4ATimeoutException:
            return None
        except self._k4a.K4AException as error:
            raise CameraError(
                f"The {self.name} has failed.", hint="Plug it in again; it is opened again by itself."
            ) from error
        if pair.color is None or pair.depth is None:
            return None
        return self._frame(pair)

    def _frame(self, pair: Any) -> Frame:
        bgr = cv2.cvtColor(pair.color, cv2.COLOR_BGRA2BGR)
        picture = cv2.remap(bgr, *self._straight, cv2.INTER_LINEAR).astype(np.uint8, copy=False)
        measured = pair.depth.astype(np.float32)
        for array in (picture, measured):
            array.setflags(write=False)
        taken = pair.color_timestamp_usec / 1e6
        return Frame(
            sequence=self._counter.count(taken),
            time=taken,
            colour=picture,
            depth=measured,
            colour_camera=self._colour_camera,
            depth_camera=self._depth_camera,
            colour_from_depth=self._colour_from_depth,
            depth_time=pair.depth_timestamp_usec / 1e6,
            dropped=self._counter.dropped,
        )


def _pinhole(calibration: Any, which: Any, width: int, height: int) -> Intrinsics:
    """One of the cameras, without its distortion."""
    matrix = np.asarray(calibration.get_camera_matrix(which), dtype=np.float64)
    fx, fy, cx, cy = (float(matrix[index]) for index in ((0, 0), (1, 1), (0, 2), (1, 2)))
    return Intrinsics(width, height, fx, fy, cx, cy)


def _bent(calibration: Any, which: Any) -> Array:
    """(8,) coefficients of its distortion."""
    return np.asarray(calibration.get_distortion_coefficients(which), dtype=np.float64)
