"""How a ring lies in memory.

::

    header      magic, version, sizes, who writes, which slot is the newest
    cells       (READERS, HOLDS) leases: which slot a reader holds, since when; 0 is free
    slots       per slot its generation and what belongs to the frame beside the pixels
    pixels      page-aligned, one stretch of slot_bytes a slot: colour, then depth

All words are eight bytes and aligned, so that a store or a load of one is never seen half done.
"""

import mmap
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Depth, Frame, Intrinsics, Picture
from kempelen.core.errors import CameraError
from kempelen.core.geometry import Transform

MAGIC = b"KEMPRING"
VERSION = 1
READERS = 16
HOLDS = 8
MAX_SLOTS = 255
ALIGNMENT = 64  # of a frame's depth behind its colour: a cache line

_HEADER = np.dtype([
    ("magic", "S8"), ("version", "<u8"), ("slots", "<u8"), ("slot_bytes", "<u8"), ("pid", "<u8"),
    ("newest", "<u8"), ("lost", "<u8"), ("beat", "<u8"),
])  # fmt: skip
_OPTICS = np.dtype([("colour", "<f8", 11), ("depth", "<f8", 11), ("colour_from_depth", "<f8", 12)])
_SLOT = np.dtype([
    ("generation", "<u8"), ("sequence", "<i8"), ("time", "<f8"), ("depth_time", "<f8"), ("dropped", "<i8"),
    ("colour", "<i8", 2), ("depth", "<i8", 2), ("optics", _OPTICS),
])  # fmt: skip
_CELLS = READERS * HOLDS * 8

Bytes = npt.NDArray[np.uint8]
Words = npt.NDArray[np.uint64]


def control_bytes(slots: int) -> int:
    """Of everything before the pixels, in whole pages."""
    return pages(_HEADER.itemsize + _CELLS + slots * _SLOT.itemsize)


def pages(size: int) -> int:
    """``size`` rounded up to whole pages."""
    return -(-size // mmap.PAGESIZE) * mmap.PAGESIZE


def frame_bytes(frame: Frame) -> int:
    """What a slot must hold for a frame of this size."""
    colour = 0 if frame.colour is None else frame.colour.nbytes
    depth = 0 if frame.depth is None else frame.depth.nbytes
    return _aligned(colour) + depth


def _aligned(size: int) -> int:
    return -(-size // ALIGNMENT) * ALIGNMENT


class Control:
    """The words before the pixels.

    Args:
        memory: The mapped stretch, at least ``control_bytes(slots)`` long.
        slots: How many there are.
    """

    def __init__(self, memory: mmap.mmap, slots: int) -> None:
        header = np.frombuffer(memory, _HEADER, 1)
        self.header = header
        self.newest: Words = header["newest"]
        self.lost: Words = header["lost"]
        self.beat: Words = header["beat"]
        cells = np.frombuffer(memory, np.uint64, READERS * HOLDS, _HEADER.itemsize)
        self.cells: Words = cells.reshape(READERS, HOLDS)
        self.slots = np.frombuffer(memory, _SLOT, slots, _HEADER.itemsize + _CELLS)
        self.generation: Words = self.slots["generation"]

    def held(self) -> dict[int, int]:
        """When each slot that somebody reads was taken last, ms."""
        cells = self.cells[self.cells != 0]
        return {int(cell & np.uint64(255)) - 1: int(cell >> np.uint64(8)) for cell in np.sort(cells)}


def lease(slot: int) -> np.uint64:
    """The word that says that a slot is being read from now on."""
    return np.uint64((now_ms() << 8) | (slot + 1))


def now_ms() -> int:
    """Of the clock that all processes share."""
    return time.monotonic_ns() // 1_000_000


def check_header(memory: mmap.mmap, name: str) -> tuple[int, int]:
    """Number of slots and their size.

    Raises:
        CameraError: this is no ring, or one of another version.
    """
    header = np.frombuffer(memory[: _HEADER.itemsize], _HEADER, 1)[0]
    if header["magic"] != MAGIC:
        raise CameraError(
            f"What answers as '{name}' is no ring of frames: it begins with {bytes(header['magic'])!r}.",
            hint="End the program that uses this name.",
        )
    if header["version"] != VERSION:
        raise CameraError(
            f"The ring '{name}' is of version {header['version']}, this program reads version {VERSION}.",
            hint="Run both sides from the same installation of Kempelen.",
        )
    return int(header["slots"]), int(header["slot_bytes"])


def write_header(control: Control, slots: int, slot_bytes: int, pid: int) -> None:
    """Of a new ring, which holds no frame yet."""
    control.header[0] = (MAGIC, VERSION, slots, slot_bytes, pid, 0, 0, time.monotonic_ns())


def require_frame(frame: Frame) -> None:
    """Refuse what no camera delivers.

    Raises:
        CameraError: neither colour nor depth, or arrays of a wrong type or shape.
    """
    colour, depth = frame.colour, frame.depth
    if colour is None and depth is None:
        raise CameraError("A frame has neither colour nor depth.", hint="Correct the camera's driver.")
    for name, array, dtype, ending in (("colour", colour, np.uint8, (3,)), ("depth", depth, np.float32, ())):
        if array is None:
            continue
        if array.dtype != dtype or array.ndim != 2 + len(ending) or array.shape[2:] != ending:
            wanted = ", ".join(["height", "width", *map(str, ending)])
            raise CameraError(
                f"A frame's {name} is {array.dtype} of shape {array.shape}; wanted is "
                f"{np.dtype(dtype)} of shape ({wanted}).",
                hint="Correct the camera's driver.",
            )


def put(control: Control, slot: int, pixels: Bytes, frame: Frame, lost: int) -> None:
    """Copy a frame into its slot.

    Args:
        control: Of the ring.
        slot: Index.
        pixels: (slot_bytes,) of that slot.
        frame: Checked, and known to fit.
        lost: Frames that the ring itself has lost so far.
    """
    record = control.slots[slot]
    shapes = [(0, 0) if array is None else array.shape[:2] for array in (frame.colour, frame.depth)]
    depth_time = np.nan if frame.depth_time is None else frame.depth_time
    record["sequence"], record["time"], record["depth_time"] = frame.sequence, frame.time, depth_time
    record["dropped"] = frame.dropped + lost
    record["colour"], record["depth"] = shapes
    record["optics"] = _optics(frame)
    colour, depth = _views(pixels, shapes)
    if frame.colour is not None and colour is not None:
        np.copyto(colour, frame.colour)
    if frame.depth is not None and depth is not None:
        np.copyto(depth, frame.depth)


def _views(pixels: Bytes, shapes: list[tuple[int, ...]]) -> tuple[Picture | None, Depth | None]:
    """Colour and depth where they lie."""
    (rows, columns), (depth_rows, depth_columns) = shapes
    end = rows * columns * 3
    start = _aligned(end)
    stop = start + depth_rows * depth_columns * 4
    colour = pixels[:end].reshape(rows, columns, 3) if end else None
    depth = pixels[start:stop].view(np.float32).reshape(depth_rows, depth_columns) if stop > start else None
    return colour, depth


def _optics(frame: Frame) -> tuple[Any, ...]:
    pose = frame.colour_from_depth
    return (
        _numbers(frame.colour_camera),
        _numbers(frame.depth_camera),
        (*pose.rotation.ravel(), *pose.translation),
    )


def _numbers(camera: Intrinsics | None) -> tuple[float, ...]:
    if camera is None:
        return (0.0,) * 11
    return (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion)


def _camera(numbers: npt.NDArray[np.float64]) -> Intrinsics | None:
    width, height, fx, fy, cx, cy, k1, k2, p1, p2, k3 = map(float, numbers)
    if not width:
        return None
    return Intrinsics(int(width), int(height), fx, fy, cx, cy, (k1, k2, p1, p2, k3))


@dataclass(slots=True)
class FrameReader:
    """Makes frames of slots; remembers the optics, which hardly ever change."""

    _known: bytes = b""
    _colour: Intrinsics | None = None
    _depth: Intrinsics | None = None
    _pose: Transform | None = None

    def get(self, control: Control, slot: int, pixels: Bytes) -> Frame:
        """The frame in a slot, its arrays where they lie in ``pixels``."""
        record = control.slots[slot]
        pose = self._learn(record["optics"])
        colour, depth = _views(pixels, [tuple(map(int, record[name])) for name in ("colour", "depth")])
        depth_time = float(record["depth_time"])
        return Frame(
            sequence=int(record["sequence"]),
            time=float(record["time"]),
            colour=colour,
            depth=depth,
            colour_camera=self._colour,
            depth_camera=self._depth,
            colour_from_depth=pose,
            depth_time=None if np.isnan(depth_time) else depth_time,
            dropped=int(record["dropped"]),
        )

    def _learn(self, optics: Any) -> Transform:
        described = optics.tobytes()
        if self._pose is None or described != self._known:
            pose = optics["colour_from_depth"]
            self._pose = Transform(pose[:9].reshape(3, 3), pose[9:])
            self._colour, self._depth = _camera(optics["colour"]), _camera(optics["depth"])
            self._known = described
        return self._pose
