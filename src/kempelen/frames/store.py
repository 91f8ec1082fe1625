"""Where a recording lies: a folder, or one file.

The one file is a ZIP archive without compression (the pictures are compressed already). It is read by its
local headers alone, front to back, so that one whose recorder was killed, and which has no directory at its
end, reads like any other up to its last whole member.
"""

import os
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Protocol, Self

from kempelen.core.errors import CameraError

_LOCAL = struct.Struct("<4s5H3I2H")  # APPNOTE 4.3.7, local file header
_MAGIC = b"PK\x03\x04"
_SIZES_FOLLOW = 8  # flag bit 3
ONE_FILE = ".zip"


class Sink(Protocol):
    """A place to write members to. Context manager."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def write(self, name: str, data: bytes) -> None:
        """Write one; when this has returned, the death of the process does not harm it."""
        ...


class Source(Protocol):
    """A place to read members from."""

    sizes: dict[str, int]

    def read(self, name: str) -> bytes:
        """One of ``sizes``; perhaps fewer bytes than promised there."""
        ...

    def close(self) -> None:
        """Done."""
        ...


def new_sink(path: Path) -> Sink:
    """One file for a name that ends in .zip, else a folder; neither may exist.

    Raises:
        CameraError: it does, or it cannot be made.
    """
    try:
        return FileSink(path) if path.suffix == ONE_FILE else FolderSink(path)
    except FileExistsError:
        raise CameraError(
            f"{path} exists already; a recording is never written over.",
            hint="Give another name, or remove it first.",
        ) from None
    except OSError as error:
        raise CameraError(
            f"{path} cannot be written: {error.strerror}.", hint="Check the path and its permissions."
        ) from None


def open_source(path: Path) -> Source:
    """Of a recording.

    Raises:
        CameraError: there is none.
    """
    try:
        return FolderSource(path) if path.is_dir() else FileSource(path)
    except OSError as error:
        raise CameraError(
            f"The recording {path} cannot be read: {error.strerror}.", hint="Check the path."
        ) from None


class FolderSink:
    """A folder of files."""

    def __init__(self, path: Path) -> None:
        path.mkdir(parents=True)
        self._path = path

    def __enter__(self) -> Self:
        """Made already."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing is open."""

    def write(self, name: str, data: bytes) -> None:
        """Whole or not at all."""
        part = self._path / f".{name}.part"
        part.write_bytes(data)
        part.replace(self._path / name)


class FileSink:
    """One ZIP file."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("x+b")
        self._zip = zipfile.ZipFile(self._file, "w", zipfile.ZIP_STORED)

    def __enter__(self) -> Self:
        """Open already."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """With a directory, for other programs."""
        self._zip.close()
        self._file.close()

    def write(self, name: str, data: bytes) -> None:
        """Handed to the system at once."""
        self._zip.writestr(name, data)
        self._file.flush()


class FolderSource:
    """A folder of files."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.sizes = {each.name: each.stat().st_size for each in path.iterdir() if each.is_file()}

    def read(self, name: str) -> bytes:
        """As it is now; empty when it has gone meanwhile."""
        with suppress(OSError):
            return (self._path / name).read_bytes()
        return b""

    def close(self) -> None:
        """Nothing is open."""


class FileSource:
    """One ZIP file, whole or not."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        self._offsets: dict[str, int] = {}
        self.sizes: dict[str, int] = {}
        for name, offset, size in _members(self._file):
            self._offsets[name], self.sizes[name] = offset, size

    def read(self, name: str) -> bytes:
        """As much as is there."""
        self._file.seek(self._offsets[name])
        return self._file.read(self.sizes[name])

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _members(file: IO[bytes]) -> Iterator[tuple[str, int, int]]:
    """Name, offset and size of each whole member; ends at the first thing that is none."""
    end = file.seek(0, os.SEEK_END)
    here = 0
    while here + _LOCAL.size <= end:
        file.seek(here)
        fields = _LOCAL.unpack(file.read(_LOCAL.size))
        magic, flags, method, packed, name_length, extra = (fields[i] for i in (0, 2, 3, 7, 9, 10))
        if magic != _MAGIC or flags & _SIZES_FOLLOW or method != zipfile.ZIP_STORED:
            return
        name = file.read(name_length).decode(errors="replace")
        here += _LOCAL.size + name_length + extra
        if here + packed > end:
            return
        yield name, here, packed
        here += packed


def checksum(data: bytes) -> int:
    """CRC-32."""
    return zlib.crc32(data)
