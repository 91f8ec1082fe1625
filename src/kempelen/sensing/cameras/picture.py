"""A single picture, with a depth picture if there is one, as if it were a camera."""

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import cv2
import numpy as np

from kempelen.core.camera import Depth, Frame, Intrinsics, Picture
from kempelen.core.errors import CameraError

_PERIOD = 1 / 30


class PictureCamera:
    """Shows one picture, once or for a while.

    Args:
        path: The colour picture: PNG, JPEG, or whatever else OpenCV reads.
        depth: A 16-bit PNG registered to it, 0 where nothing was measured.
        depth_unit: Of the depth picture, mm.
        intrinsics: Of the colour picture: keyword arguments of ``Intrinsics``.
        frames: How often it is shown, 30 times a second; 0 for ever.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        depth: str | Path | None = None,
        depth_unit: float = 1.0,
        intrinsics: Mapping[str, Any] | None = None,
        frames: int = 1,
    ) -> None:
        self.name = f"picture {path}"
        self._path = Path(path)
        self._depth = None if depth is None else Path(depth)
        self._unit = depth_unit
        self._intrinsics = None if intrinsics is None else Intrinsics(**intrinsics)
        self._frames = frames
        self.settings: dict[str, Any] = {"path": str(path), "frames": frames}

    def __enter__(self) -> Self:
        """Read the files.

        Raises:
            CameraError: one is absent, no picture, or does not fit the other.
        """
        self._shown = 0
        colour = read_colour(self._path)
        depth = None if self._depth is None else read_depth(self._depth, self._unit)
        camera = self._intrinsics
        if depth is not None and depth.shape != colour.shape[:2]:
            raise CameraError(
                f"{self._depth} is {_size(depth)}, but {self._path} is {_size(colour)}.",
                hint="The depth picture must be registered to the colour picture.",
            )
        if camera is not None and (camera.height, camera.width) != colour.shape[:2]:
            raise CameraError(
                f"The intrinsics are of a picture of {camera.width} x {camera.height} px, but {self._path} "
                f"is {_size(colour)}.",
                hint="Give those of this picture.",
            )
        depth_camera = camera if depth is not None else None
        self._frame = Frame(0, 0.0, colour, depth, camera, depth_camera)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing is open."""

    def read(self, timeout: float) -> Frame | None:
        """The picture again.

        Raises:
            EOFError: it was shown as often as asked for.
        """
        if self._frames and self._shown >= self._frames:
            raise EOFError(f"{self.name} has been shown.")
        if self._shown == 0:
            self._began = time.monotonic()
        wait = self._began + self._shown * _PERIOD - time.monotonic()
        time.sleep(min(max(wait, 0.0), timeout))
        if wait > timeout:
            return None
        frame = replace(self._frame, sequence=self._shown, time=self._shown * _PERIOD)
        self._shown += 1
        return frame


def read_colour(path: Path) -> Picture:
    """(height, width, 3) blue, green, red.

    Raises:
        CameraError: absent, or no picture.
    """
    picture = cv2.imdecode(_bytes(path), cv2.IMREAD_COLOR)
    if picture is None:
        raise CameraError(
            f"{path} is no picture, or a damaged one.", hint="Give a PNG or JPEG file that a viewer shows."
        )
    out: Picture = picture.astype(np.uint8, copy=False)
    out.setflags(write=False)
    return out


def read_depth(path: Path, unit: float = 1.0) -> Depth:
    """(height, width) mm.

    Args:
        path: A 16-bit picture of one channel.
        unit: Of its values, mm.

    Raises:
        CameraError: absent, no picture, or of another kind.
    """
    picture = cv2.imdecode(_bytes(path), cv2.IMREAD_UNCHANGED)
    if picture is None or picture.dtype != np.uint16 or picture.ndim != 2:  # noqa: PLR2004
        kind = "no picture" if picture is None else f"{picture.dtype} of shape {picture.shape}"
        raise CameraError(
            f"{path} is {kind}; a depth picture has one channel of 16 bits.",
            hint="Save depth as a 16-bit PNG, 1 mm a step, without colours.",
        )
    out: Depth = picture.astype(np.float32) * np.float32(unit)
    out.setflags(write=False)
    return out


def _bytes(path: Path) -> Any:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise CameraError(f"{path} cannot be read: {error.strerror}.", hint="Check the path.") from None
    if not data:
        raise CameraError(f"{path} is empty.", hint="Give a file that holds a picture.")
    return np.frombuffer(data, np.uint8)


def _size(array: Any) -> str:
    return f"{array.shape[1]} x {array.shape[0]} px"
