"""Stand-ins for the libraries of cameras' makers: the calls that our drivers make, with their signatures.

Each follows the library's own documentation: OpenCV 4/5 ``VideoCapture``, pyrealsense2 2.5x, pyk4a 1.5,
freenect2 0.2. They record what was asked of them.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from types import ModuleType, SimpleNamespace
from typing import Any

import cv2
import numpy as np


@dataclass
class Bench:
    """What is plugged in, and what was called.

    Attributes:
        present: Whether the camera is there.
        calls: Names of the calls, in their order.
        options: What was asked for.
        silent: Whether no frame comes for now.
        numbers: Of the frames that come, for libraries that number them.
    """

    present: bool = True
    calls: list[str] = field(default_factory=list)
    options: dict[str, Any] = field(default_factory=dict)
    silent: bool = False
    numbers: list[int] = field(default_factory=lambda: list(range(10, 500)))
    frame: int = 0

    def next(self) -> int:
        """Number of the frame that comes now."""
        self.frame += 1
        return self.numbers[self.frame - 1]


# --- OpenCV ---------------------------------------------------------------------------------------------


def video_capture(bench: Bench, shape: tuple[int, ...] = (12, 16, 3)) -> Any:  # noqa: C901 - a class, method by method
    """A class like ``cv2.VideoCapture`` on Video4Linux."""

    class VideoCapture:
        def __init__(self) -> None:
            self._settings: dict[int, float] = {}
            self.opened = False

        def open(self, device: int, backend: int) -> bool:
            bench.calls.append(f"open {device}")
            assert backend == cv2.CAP_V4L2
            self.opened = bench.present
            return self.opened

        def set(self, setting: int, value: float) -> bool:
            bench.calls.append(f"set {setting}")
            self._settings[setting] = value
            return True

        def get(self, setting: int) -> float:
            if setting == cv2.CAP_PROP_POS_MSEC:
                return bench.frame * 1000 / 30
            return self._settings.get(setting, 0.0)

        def retrieve(self) -> tuple[bool, Any]:
            return True, np.full(shape, bench.frame, np.uint8)

        def release(self) -> None:
            bench.calls.append("release")
            self.opened = False

        @staticmethod
        def waitAny(streams: list[Any], timeoutNs: int) -> tuple[bool, list[int]]:  # noqa: N802, N803 - its names
            assert timeoutNs > 0
            if not all(stream.opened for stream in streams):
                raise cv2.error("closed")
            if not bench.present:
                raise cv2.error("poll failed")
            if bench.silent:
                return False, []
            bench.next()
            return True, [0]

    return VideoCapture


# --- RealSense ------------------------------------------------------------------------------------------


_FASTEST = 60


class _Profile:
    def __init__(self, mode: tuple[Any, ...], model: str, coefficients: list[float]) -> None:
        width, height = mode[:2]
        self._intrinsics = SimpleNamespace(
            width=width, height=height, fx=600.0, fy=601.0, ppx=width / 2, ppy=height / 2,
            model=model, coeffs=coefficients,
        )  # fmt: skip

    def as_video_stream_profile(self) -> "_Profile":
        return self

    def get_intrinsics(self) -> SimpleNamespace:
        return self._intrinsics

    def get_extrinsics_to(self, _other: "_Profile") -> SimpleNamespace:
        # by columns: a turn by +30 degrees about z
        c, s = float(np.float32(np.cos(np.pi / 6))), float(np.float32(np.sin(np.pi / 6)))
        return SimpleNamespace(rotation=[c, s, 0, -s, c, 0, 0, 0, 1.0], translation=[0.015, 0.0, 0.001])


class _Image:
    def __init__(self, number: int, data: Any, time: float) -> None:
        self._number, self._data, self._time = number, data, time

    def get_data(self) -> Any:
        return self._data

    def get_frame_number(self) -> int:
        return self._number

    def get_timestamp(self) -> float:
        return self._time


def pyrealsense2(bench: Bench, coefficients: tuple[float, ...] = (0.0,) * 5) -> Any:
    """A module like ``pyrealsense2`` with one D435 on it."""
    module: Any = ModuleType("pyrealsense2")
    module.stream = SimpleNamespace(color="color", depth="depth")
    module.format = SimpleNamespace(bgr8="bgr8", z16="z16")
    module.camera_info = SimpleNamespace(serial_number="serial", name="name")
    module.distortion = SimpleNamespace(
        none="none", brown_conrady="brown_conrady", inverse_brown_conrady="inverse_brown_conrady",
        modified_brown_conrady="modified_brown_conrady", ftheta="ftheta",
    )  # fmt: skip
    device = SimpleNamespace(
        get_info=lambda which: {"serial": "0123", "name": "Intel RealSense D435"}[which],
        first_depth_sensor=lambda: SimpleNamespace(get_depth_scale=lambda: 0.0001),
    )

    class Config:
        def enable_device(self, serial: str) -> None:
            bench.options["serial"] = serial

        def enable_stream(self, stream: str, width: int, height: int, form: str, rate: int) -> None:
            bench.options[stream] = (width, height, form, rate)

    class Pipeline:
        def start(self, _config: Config) -> SimpleNamespace:
            bench.calls.append("start")
            if bench.options["color"][3] > _FASTEST:
                raise RuntimeError("Couldn't resolve requests")
            profiles = {
                "color": _Profile(bench.options["color"], "inverse_brown_conrady", list(coefficients)),
                "depth": _Profile(bench.options["depth"], "brown_conrady", [0.0] * 5),
            }
            return SimpleNamespace(get_stream=profiles.__getitem__, get_device=lambda: device)

        def try_wait_for_frames(self, timeout_ms: int) -> tuple[bool, Any]:
            assert isinstance(timeout_ms, int)
            if not bench.present:
                raise RuntimeError("device disconnected")
            if bench.silent:
                return False, None
            number = bench.next()
            (cw, ch), (dw, dh) = bench.options["color"][:2], bench.options["depth"][:2]
            colour = _Image(number + 7, np.full((ch, cw, 3), number % 256, np.uint8), number * 33.0)
            depth = _Image(number, np.full((dh, dw), 8000 + number, np.uint16), number * 33.0 + 4)
            return True, SimpleNamespace(get_color_frame=lambda: colour, get_depth_frame=lambda: depth)

        def stop(self) -> None:
            bench.calls.append("stop")

    module.config, module.pipeline = Config, Pipeline
    module.context = lambda: SimpleNamespace(query_devices=lambda: [device] if bench.present else [])
    return module


# --- Azure Kinect ---------------------------------------------------------------------------------------


class K4AException(Exception):  # noqa: N818 - its name
    """Of pyk4a."""


class K4ATimeoutException(K4AException):
    """Of pyk4a."""


class CalibrationType(Enum):
    """Of pyk4a."""

    DEPTH = 0
    COLOR = 1


class _Calibration:
    def get_camera_matrix(self, camera: CalibrationType) -> Any:
        f, cx, cy = (900.0, 958.0, 547.0) if camera is CalibrationType.COLOR else (504.0, 320.0, 330.0)
        return np.array([[f, 0, cx], [0, f, cy], [0, 0, 1]])

    def get_distortion_coefficients(self, camera: CalibrationType) -> Any:
        if camera is CalibrationType.COLOR:
            return np.array(
                [0.722746, -2.88559, 0.000783, -0.000143, 1.632723, 0.602199, -2.719626, 1.565053]
            )
        return np.array([3.130577, 2.324939, 0.000081, -0.000051, 0.130416, 3.458652, 3.350115, 0.662942])

    def get_extrinsic_parameters(self, source: CalibrationType, target: CalibrationType) -> Any:
        assert (source, target) == (CalibrationType.DEPTH, CalibrationType.COLOR)
        c, s = np.float32(np.cos(0.1)), np.float32(np.sin(0.1))  # tilted about x
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.array([[-0.032, -0.002, 0.004]])


def pyk4a(bench: Bench) -> Any:
    """A module like ``pyk4a`` with one camera on it."""
    module: Any = ModuleType("pyk4a")

    class PyK4A:
        calibration = _Calibration()

        def __init__(self, config: Any = None, device_id: int = 0) -> None:
            bench.options |= vars(config) | {"device_id": device_id}

        def start(self) -> None:
            bench.calls.append("start")
            if not bench.present:
                raise K4AException

        def stop(self) -> None:
            bench.calls.append("stop")

        def get_capture(self, timeout: int = -1) -> Any:
            assert isinstance(timeout, int)
            if not bench.present:
                raise K4AException
            if bench.silent:
                raise K4ATimeoutException
            number = bench.next()
            colour = np.full((1080, 1920, 3), number % 256, np.uint8)
            return SimpleNamespace(
                color=np.dstack([colour, np.full((1080, 1920), 255, np.uint8)]),
                depth=np.full((576, 640), 700 + number, np.uint16),
                color_timestamp_usec=number * 33333, depth_timestamp_usec=number * 33333 - 160,
            )  # fmt: skip

    module.K4AException, module.K4ATimeoutException = K4AException, K4ATimeoutException
    module.CalibrationType, module.PyK4A, module.Config = CalibrationType, PyK4A, SimpleNamespace
    module.ColorResolution = SimpleNamespace(RES_1080P=2)
    module.ImageFormat = SimpleNamespace(COLOR_BGRA32=3)
    module.DepthMode = SimpleNamespace(NFOV_UNBINNED=2)
    module.FPS = SimpleNamespace(FPS_30=2)
    return module


# --- Kinect v2 ------------------------------------------------------------------------------------------

COLOUR_SHIFT = 52.0


def colour_parameters() -> SimpleNamespace:
    """Of a device whose two cameras look the same way, 52 mm apart, without distortion.

    Where depth pixel (x, y) of focal length 365 appears far away: fx/365 times as far from the centre.
    """
    names = [f"m{axis}_x{i}y{j}" for axis in "xy" for i in range(4) for j in range(4 - i)]
    numbers = dict.fromkeys(names, 0.0)
    scale = 0.002199 / 0.01 * 1081.0 / 365.0
    numbers["mx_x1y0"] = numbers["my_x0y1"] = scale
    numbers["mx_x0y0"] = COLOUR_SHIFT / 863.0 * 1081.0 * 0.002199  # undoes shift_m / shift_d
    return SimpleNamespace(
        fx=1081.0, fy=1081.0, cx=960.0, cy=540.0, shift_m=COLOUR_SHIFT, shift_d=863.0, **numbers
    )


class FrameType(Enum):
    """Of freenect2."""

    Color = 1
    Ir = 2
    Depth = 4


class FrameFormat(Enum):
    """Of freenect2."""

    Float = 2
    BGRX = 4
    RGBX = 5


class NoDeviceError(RuntimeError):
    """Of freenect2."""


class NoFrameReceivedError(RuntimeError):
    """Of freenect2."""


def _kinect_frames(bench: Bench) -> Iterator[tuple[FrameType, Any]]:
    while True:
        number = bench.next()
        colour = np.zeros((1080, 1920, 4), np.uint8)
        colour[:, :5] = (number % 256, 1, 2, 255)  # on the left, in the mirror
        depth = np.full((424, 512), 900.0 + number, np.float32)
        depth[0, 0], depth[0, 1], depth[0, 2] = np.nan, -1.0, np.inf
        ticks = number * 267
        yield FrameType.Ir, _kinect_frame(depth, FrameFormat.Float, number, ticks)
        yield FrameType.Depth, _kinect_frame(depth, FrameFormat.Float, number, ticks)
        yield FrameType.Color, _kinect_frame(colour, FrameFormat.BGRX, number, ticks + 8)


def freenect2(bench: Bench) -> Any:
    """A module like ``freenect2`` with one Kinect on it."""
    module: Any = ModuleType("freenect2")

    class Device:
        ir_camera_params = SimpleNamespace(
            fx=365.0, fy=365.0, cx=255.0, cy=205.0, k1=0.09, k2=-0.27, k3=0.095, p1=0.001, p2=0.002
        )
        color_camera_params = colour_parameters()

        def __init__(self) -> None:
            if not bench.present:
                raise NoDeviceError
            self._frames = _kinect_frames(bench)

        def start(self) -> None:
            bench.calls.append("start")

        def stop(self) -> None:
            bench.calls.append("stop")

        def close(self) -> None:
            bench.calls.append("close")

        def get_next_frame(self, timeout: float | None = None) -> Any:
            assert timeout is not None
            if bench.silent:
                raise NoFrameReceivedError
            return next(self._frames)

    module.FrameType, module.FrameFormat, module.Device = FrameType, FrameFormat, Device
    module.NoDeviceError, module.NoFrameReceivedError = NoDeviceError, NoFrameReceivedError
    return module


def _kinect_frame(array: Any, form: Enum, number: int, ticks: int) -> SimpleNamespace:
    return SimpleNamespace(to_array=lambda: array, format=form, sequence=number, timestamp=ticks)
