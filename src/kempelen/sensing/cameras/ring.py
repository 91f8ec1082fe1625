"""Frames of a ring that another process writes: the twin's cameras, or a camera that is already open."""

from types import TracebackType
from typing import Any, Self

from kempelen.core.camera import Frame
from kempelen.frames.ring import RingReader


class RingCamera:
    """The newest frame of a ring; a slow reader skips frames.

    A frame's arrays lie in the ring: let go of it soon, or copy it.

    Args:
        ring: Its name.
        patience: s to wait for its writer to start.
    """

    def __init__(self, ring: str, *, patience: float = 0.0) -> None:
        self.name = f"ring {ring}"
        self._reader = RingReader(ring, patience)
        self._last = -1
        self.settings: dict[str, Any] = {"ring": ring}

    def __enter__(self) -> Self:
        """Attach.

        Raises:
            CameraError: nobody writes to it.
        """
        self._reader.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Detach."""
        self._reader.__exit__(kind, error, trace)

    def read(self, timeout: float) -> Frame | None:
        """The newest frame that was not read yet.

        Raises:
            CameraError: its writer has ended.
        """
        frame = self._reader.newest(self._last, timeout)
        if frame is not None:
            self._last = frame.sequence
        return frame
