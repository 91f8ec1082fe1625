"""Webcams (USB video class) through Video4Linux and OpenCV."""

import os
import re
import time
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import cv2
import numpy as np

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.errors import CameraError
from kempelen.sensing.cameras.counting import PeriodCounter

DEVICES = Path("/dev")
CLASSES = Path("/sys/class/video4linux")
_NODE = re.compile(r"video(\d+)")


def list_devices() -> dict[int, str]:
    """Numbers and names of the video devices that deliver pictures.

    A webcam has a second node for its metadata: the kernel numbers the nodes of a device, and the first
    delivers the pictures.
    """
    found: dict[int, str] = {}
    for node in DEVICES.glob("video*"):
        match = _NODE.fullmatch(node.name)
        if match and _attribute(node.name, "index", "0") == "0":
            found[int(match[1])] = _attribute(node.name, "name", "video device")
    return dict(sorted(found.items()))


def _attribute(node: str, name: str, otherwise: str) -> str:
    try:
        return (CLASSES / node / name).read_text(encoding="utf-8").strip()
    except OSError:
        return otherwise


class UvcCamera:
    """A webcam.

    Args:
        device: Number N of /dev/videoN.
        width: Wanted, pixels.
        height: Wanted, pixels.
        fps: Wanted frames/s.
        fourcc: Wanted pixel format. MJPG fits 1080p at 30/s through USB 2; YUYV is not compressed, and slow.
        intrinsics: Of the picture, if they were calibrated: keyword arguments of ``Intrinsics``.
    """

    def __init__(
        self,
        device: int = 0,
        *,
        width: int = 1920,
        height: int = 1080,
        fps: float = 30.0,
        fourcc: str = "MJPG",
        intrinsics: Mapping[str, Any] | None = None,
    ) -> None:
        self.name = f"webcam /dev/video{device}"
        self.settings: dict[str, Any] = {}
        self._device = device
        self._wanted = (width, height, fps)
        self._fourcc = fourcc
        self._intrinsics = None if intrinsics is None else Intrinsics(**intrinsics)

    def __enter__(self) -> Self:
        """Open it and ask for the format; what it chose instead stands in ``settings``."""
        self._require_node()
        self._capture = cv2.VideoCapture()
        if not self._capture.open(self._device, cv2.CAP_V4L2):
            raise CameraError(
                f"{self.name} is no camera that can be opened: it delivers no pictures, or is in use.",
                hint=f"End other programs that use it (fuser /dev/video{self._device}). {_choice()}",
            )
        width, height, fps = self._wanted
        for setting, value in (
            (cv2.CAP_PROP_FOURCC, float(cv2.VideoWriter.fourcc(*self._fourcc))),
            (cv2.CAP_PROP_FRAME_WIDTH, float(width)),
            (cv2.CAP_PROP_FRAME_HEIGHT, float(height)),
            (cv2.CAP_PROP_FPS, float(fps)),
        ):
            self._capture.set(setting, value)
        self._note_settings()
        self._counter = PeriodCounter()
        return self

    def _require_node(self) -> None:
        node = DEVICES / f"video{self._device}"
        if not node.exists():
            raise CameraError(f"There is no {self.name}.", hint=f"Plug it in. {_choice()}")
        if not os.access(node, os.R_OK | os.W_OK):
            raise CameraError(
                f"This user may not open {self.name}.",
                hint="Add the user to the device's group: sudo usermod -aG video $USER, then log in again.",
            )

    def _note_settings(self) -> None:
        code = int(self._capture.get(cv2.CAP_PROP_FOURCC))
        self.settings = {
            "width": int(self._capture.get(cv2.CAP_PROP_FRAME_WIDTH)),
            "height": int(self._capture.get(cv2.CAP_PROP_FRAME_HEIGHT)),
            "fps": float(self._capture.get(cv2.CAP_PROP_FPS)),
            "fourcc": code.to_bytes(4, "little", signed=code < 0).decode("latin-1"),
        }

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        self._capture.release()

    def read(self, timeout: float) -> Frame | None:
        """The next picture.

        Raises:
            CameraError: it was unplugged, or its pictures have another format than asked for.
        """
        try:
            ready, _ = cv2.VideoCapture.waitAny([self._capture], max(1, round(timeout * 1e9)))
        except cv2.error as error:
            raise self._gone() from error
        if not ready:
            if not (DEVICES / f"video{self._device}").exists():
                raise self._gone()
            return None
        whole, picture = self._capture.retrieve()
        if not whole:
            return None  # a picture that was damaged on its way; its number is missed
        if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3:  # noqa: PLR2004
            raise CameraError(
                f"{self.name} delivers {picture.dtype} of shape {picture.shape}, not colour pictures.",
                hint="Choose another fourcc, MJPG or YUYV, or another camera.",
            )
        return self._frame(picture)

    def _frame(self, picture: Any) -> Frame:
        exposed = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000  # the driver's own stamp, if it gives one
        taken = exposed if exposed > 0 else time.monotonic()
        picture.setflags(write=False)
        return Frame(
            sequence=self._counter.count(taken),
            time=taken,
            colour=picture,
            colour_camera=self._fitting(picture.shape),
            dropped=self._counter.dropped,
        )

    def _fitting(self, shape: tuple[int, ...]) -> Intrinsics | None:
        """Those of the calibration, if the picture is of its size or of its shape."""
        known = self._intrinsics
        if known is None or known.width == shape[1]:
            return known
        scaled = known.scaled(shape[1] / known.width)
        return scaled if scaled.height == shape[0] else None

    def _gone(self) -> CameraError:
        return CameraError(f"{self.name} has gone.", hint="Plug it in again; it is opened again by itself.")


def _choice() -> str:
    found = list_devices()
    named = ", ".join(f"uvc:{number} ({name})" for number, name in found.items())
    return f"Cameras here: {named}." if named else "No video device is connected to this computer."
