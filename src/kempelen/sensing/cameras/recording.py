"""A recording played as if it were a camera."""

import time
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from kempelen.core.camera import Frame
from kempelen.core.errors import CameraError
from kempelen.frames.recording import Recording

_LAST_GAP = 1 / 30  # s; between the last frame and the first of the next round


class RecordingCamera:
    """Plays the frames of a recording, all of them, in order.

    A damaged frame is an error that names it; reading again goes on with the frame after it.

    Args:
        path: Folder or file.
        speed: 1 for the pace of the recording, N for N times as fast, 0 for as fast as it is read.
        loop: Whether to start again at its end; sequences and times go on rising.
    """

    def __init__(self, path: str | Path, *, speed: float = 1.0, loop: bool = False) -> None:
        self.name = f"recording {path}"
        self._recording = Recording(Path(path))
        self._speed = speed
        self._loop = loop
        self.settings: dict[str, Any] = {"speed": speed, "loop": loop}

    @property
    def problems(self) -> list[str]:
        """What is missing of it, one sentence each."""
        return self._recording.problems

    def __enter__(self) -> Self:
        """Open it.

        Raises:
            CameraError: it is none, of another version, or empty.
        """
        self._recording.__enter__()
        self._next = 0
        self._began: tuple[float, float] | None = None  # on the wall's clock and on the recording's
        self._later, self._further, self._skipped = 0.0, 0, 0
        self._last: Frame | None = None
        self.settings |= {"frames": len(self._recording), "complete": self._recording.complete}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        self._recording.__exit__(kind, error, trace)

    def read(self, timeout: float) -> Frame | None:
        """The next frame when its time has come.

        Raises:
            CameraError: this frame is damaged.
            EOFError: that was the last one.
        """
        if self._next == len(self._recording):
            self._rewind()
        if not self._due(timeout):
            return None
        self._next += 1
        try:
            frame = self._recording.frame(self._next - 1)
        except CameraError:
            self._skipped += 1
            raise
        frame = replace(
            frame,
            sequence=frame.sequence + self._further,
            time=frame.time + self._later,
            depth_time=None if frame.depth_time is None else frame.depth_time + self._later,
            dropped=frame.dropped + self._skipped,
        )
        self._last = frame
        return frame

    def _rewind(self) -> None:
        if not self._loop or self._last is None:
            raise EOFError(f"{self.name} has been played.")
        first = self._recording.frame(0)
        self._later = self._last.time + _LAST_GAP - first.time
        self._further = self._last.sequence + 1 - first.sequence
        self._next = 0

    def _due(self, timeout: float) -> bool:
        """Wait for the next frame's time; whether it has come."""
        if self._speed <= 0:
            return True
        now, taken = time.monotonic(), self._recording.time(self._next) + self._later
        if self._began is None:
            self._began = (now, taken)
        wait = self._began[0] + (taken - self._began[1]) / self._speed - now
        time.sleep(min(max(wait, 0.0), timeout))
        return wait <= timeout
