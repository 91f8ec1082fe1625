"""Recordings: frames on disk, each with its times and optics.

``manifest.json``
    version, unit of the depth, format of the colour, the camera's name, intrinsics and registration.
``NNNNNN.colour.png`` or ``.jpg``
    the colour picture, lossless unless JPEG was asked for.
``NNNNNN.depth.png``
    16 bits, 0.1 mm; 0 where nothing was measured, and from 6.55 m on.
``NNNNNN.json``
    sequence, times, dropped frames, size and CRC-32 of the pictures; optics where they have changed. Written
    last: a frame without it was never finished.
``end.json``
    how many frames there are. Absent when the recorder was killed: everything up to then can be read.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import cv2
import numpy as np

from kempelen.core.camera import Depth, Frame, Intrinsics, Picture
from kempelen.core.errors import CalibrationError, CameraError
from kempelen.core.geometry import Transform
from kempelen.frames.layout import require_frame
from kempelen.frames.store import checksum, new_sink, open_source

VERSION = 1
FORMAT = "kempelen recording"
DEPTH_UNIT = 0.1  # mm
ColourFormat = Literal["png", "jpg"]
_DEEPEST = 65535
_QUALITY = [cv2.IMWRITE_JPEG_QUALITY, 95]
_FRAME = re.compile(r"(\d{6,})\.json")


class RecordingWriter:
    """Context manager: writes frames as they come. What was written stays readable however it ends.

    Args:
        path: A folder, or one file if its name ends in .zip. It must not exist.
        colour_format: ``png`` (lossless) or ``jpg`` (a tenth of the size).
        camera: Name of the camera, for the manifest.
    """

    def __init__(self, path: Path, colour_format: ColourFormat = "png", camera: str = "") -> None:
        self._path = path
        self._format = colour_format
        self._name = camera
        self._optics: dict[str, Any] | None = None
        self.frames = 0

    def __enter__(self) -> Self:
        """Make the folder or the file.

        Raises:
            CameraError: it exists, or cannot be made.
        """
        self._sink = new_sink(self._path)
        self._sink.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write how many frames there are."""
        try:
            if self._optics is None:
                self._begin(_optics(Frame(0, 0.0)))
            self._sink.write("end.json", _json({"frames": self.frames}))
        finally:
            self._sink.__exit__(kind, error, trace)

    def write(self, frame: Frame) -> None:
        """Add a frame.

        Raises:
            CameraError: it is not what a camera delivers, or the disk is full.
        """
        self.add(self.encoded(frame))

    def encoded(self, frame: Frame) -> "EncodedFrame":
        """A frame for ``add``: the slow part, which may be done by several threads at once.

        Raises:
            CameraError: it is not what a camera delivers.
        """
        require_frame(frame)
        pictures = {}
        if frame.colour is not None:
            options = _QUALITY if self._format == "jpg" else []
            pictures[f"colour.{self._format}"] = _encode(f".{self._format}", frame.colour, options)
        if frame.depth is not None:
            pictures["depth.png"] = _encode(".png", depth_to_units(frame.depth), [])
        described = {
            "sequence": frame.sequence, "time": frame.time, "depth_time": frame.depth_time,
            "dropped": frame.dropped,
            "members": {
                name: {"bytes": len(data), "crc32": checksum(data)} for name, data in pictures.items()
            },
        }  # fmt: skip
        return EncodedFrame(described, pictures, _optics(frame))

    def add(self, frame: "EncodedFrame") -> None:
        """Write a frame that was encoded; in the order of their sequences.

        Raises:
            CameraError: the disk is full.
        """
        number = f"{self.frames:06d}"
        try:
            if self._optics is None:
                self._begin(frame.optics)
            for name, data in frame.pictures.items():
                self._sink.write(f"{number}.{name}", data)
            changed = {} if frame.optics == self._optics else {"optics": frame.optics}
            self._sink.write(f"{number}.json", _json({**frame.described, **changed}))
        except OSError as error:
            raise CameraError(
                f"Frame {self.frames} cannot be added to {self._path}: {error.strerror}.",
                hint="Make room on the disk; the frames before it are kept.",
            ) from None
        self.frames += 1

    def _begin(self, optics: dict[str, Any]) -> None:
        self._optics = optics
        manifest = {
            "format": FORMAT, "version": VERSION, "camera": self._name, "colour_format": self._format,
            "depth_unit_mm": DEPTH_UNIT, "optics": optics,
        }  # fmt: skip
        self._sink.write("manifest.json", _json(manifest))


@dataclass(frozen=True, slots=True)
class EncodedFrame:
    """A frame as it is written: its description, its pictures by name, its optics."""

    described: dict[str, Any]
    pictures: dict[str, bytes]
    optics: dict[str, Any]


def _encode(ending: str, array: Any, options: list[int]) -> bytes:
    whole, encoded = cv2.imencode(ending, np.ascontiguousarray(array), options)
    if not whole:
        raise CameraError(f"A picture of shape {array.shape} cannot be encoded as {ending}.", hint="Use png.")
    data: bytes = encoded.tobytes()
    return data


class Recording:
    """Context manager: the frames of a recording by number.

    Args:
        path: Folder or file.

    Attributes:
        camera: Name of the camera that was recorded.
        complete: Whether it was closed in an orderly way.
        problems: What is missing, one sentence each.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.camera = ""
        self.complete = False
        self.problems: list[str] = []

    def __enter__(self) -> Self:
        """Open it and see what is there.

        Raises:
            CameraError: it is no recording, of another version, or holds no whole frame.
        """
        self._source = open_source(self.path)
        try:
            self._manifest = self._read_manifest()
            self._take_stock()
        except BaseException:
            self._source.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        self._source.close()

    def __len__(self) -> int:
        return len(self._numbers)

    def _read_manifest(self) -> Mapping[str, Any]:
        manifest = self._document("manifest.json") if "manifest.json" in self._source.sizes else {}
        if manifest.get("format") != FORMAT:
            raise CameraError(
                f"{self.path} is no recording: it has no manifest.json of one.",
                hint="Recordings are made by `kempelen record`.",
            )
        if manifest.get("version") != VERSION:
            raise CameraError(
                f"The recording {self.path} is of version {manifest.get('version')}; this program reads "
                f"version {VERSION}.",
                hint="Read it with the version of Kempelen that wrote it.",
            )
        self.camera = str(manifest.get("camera", ""))
        return manifest

    def _take_stock(self) -> None:
        found = sorted(int(match[1]) for name in self._source.sizes if (match := _FRAME.fullmatch(name)))
        self._numbers = found
        self.complete = "end.json" in self._source.sizes
        if not self.complete:
            self.problems.append(
                f"The recording {self.path} was cut short: {len(found)} whole frames are left of it."
            )
        wanted = self._document("end.json").get("frames") if self.complete else None
        expected = wanted if isinstance(wanted, int) else max(found, default=-1) + 1
        if missing := sorted(set(range(expected)) - set(found)):
            self.problems.append(
                f"The recording {self.path} lacks {len(missing)} frames, the first is number {missing[0]}."
            )
        if not found:
            raise CameraError(
                f"The recording {self.path} holds no whole frame.", hint="Record again, for longer."
            )

    def frame(self, index: int) -> Frame:
        """The frame at a place, from 0 to ``len() - 1``.

        Raises:
            CameraError: it is damaged; others may not be.
        """
        number = self._numbers[index]
        described = self._document(f"{number:06d}.json")
        try:
            return self._frame(number, described)
        except (KeyError, TypeError, ValueError, AttributeError, CalibrationError) as error:
            raise self._damaged(number, f"its description cannot be understood ({error})") from None

    def time(self, index: int) -> float:
        """When the frame at a place was taken, s."""
        time = self._document(f"{self._numbers[index]:06d}.json").get("time")
        if not isinstance(time, int | float):
            raise self._damaged(self._numbers[index], "it has no time")
        return float(time)

    def _frame(self, number: int, described: Mapping[str, Any]) -> Frame:
        colour: Picture | None = None
        depth: Depth | None = None
        for what, expected in described["members"].items():
            picture = self._decode(number, what, expected)
            if what.startswith("colour"):
                colour = picture.astype(np.uint8, copy=False)
            else:
                depth = picture.astype(np.float32) * np.float32(self._manifest["depth_unit_mm"])
        for array in (colour, depth):
            if array is not None:
                array.setflags(write=False)
        frame = Frame(
            sequence=int(described["sequence"]),
            time=float(described["time"]),
            colour=colour,
            depth=depth,
            depth_time=described["depth_time"],
            dropped=int(described["dropped"]),
            **_optics_from(described.get("optics", self._manifest["optics"])),
        )
        require_frame(frame)
        return frame

    def _decode(self, number: int, what: str, expected: Mapping[str, int]) -> Any:
        data = self._read(f"{number:06d}.{what}")
        if len(data) != expected["bytes"]:
            raise self._damaged(number, f"{what} has {len(data)} of {expected['bytes']} bytes")
        if checksum(data) != expected["crc32"]:
            raise self._damaged(number, f"{what} was changed after it was recorded")
        flags = cv2.IMREAD_UNCHANGED if what.startswith("depth") else cv2.IMREAD_COLOR
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
        if picture is None:
            raise self._damaged(number, f"{what} is no picture")
        return picture

    def _damaged(self, number: int, why: str) -> CameraError:
        return CameraError(
            f"Frame {number} of the recording {self.path} is damaged: {why}.",
            hint="Record again, or go on without this frame.",
        )

    def _read(self, name: str) -> bytes:
        return self._source.read(name) if name in self._source.sizes else b""

    def _document(self, name: str) -> Mapping[str, Any]:
        try:
            document = json.loads(self._read(name))
        except ValueError:
            document = {}
        return document if isinstance(document, dict) else {}


def depth_to_units(depth: Depth) -> Any:
    """(h, w) uint16 of 0.1 mm; 0 for what does not fit."""
    units = np.rint(depth / np.float32(DEPTH_UNIT))
    return np.where((units > 0) & (units <= _DEEPEST), units, 0).astype(np.uint16)


def _json(document: Mapping[str, Any]) -> bytes:
    return json.dumps(document, indent=1).encode() + b"\n"


def _optics(frame: Frame) -> dict[str, Any]:
    pose = frame.colour_from_depth
    return {
        "colour_camera": _camera(frame.colour_camera),
        "depth_camera": _camera(frame.depth_camera),
        "colour_from_depth": {
            "rotation": pose.rotation.tolist(),
            "translation_mm": pose.translation.tolist(),
        },
    }


def _camera(camera: Intrinsics | None) -> dict[str, Any] | None:
    return None if camera is None else asdict(camera)


def _optics_from(described: Mapping[str, Any]) -> dict[str, Any]:
    """The optical fields of a frame from how a manifest gives them.

    Raises:
        KeyError: something is missing.
        CalibrationError: the numbers describe no camera.
    """
    pose = described["colour_from_depth"]
    return {
        "colour_camera": _intrinsics(described["colour_camera"]),
        "depth_camera": _intrinsics(described["depth_camera"]),
        "colour_from_depth": Transform(np.array(pose["rotation"]), np.array(pose["translation_mm"])),
    }


def _intrinsics(numbers: Mapping[str, Any] | None) -> Intrinsics | None:
    if numbers is None:
        return None
    k1, k2, p1, p2, k3 = numbers["distortion"]
    width, height, *rest = (numbers[name] for name in ("width", "height", "fx", "fy", "cx", "cy"))
    fx, fy, cx, cy = rest
    return Intrinsics(width, height, fx, fy, cx, cy, (k1, k2, p1, p2, k3))
