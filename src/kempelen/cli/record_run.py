"""Records until it is told to stop, and shows how far it is."""

import asyncio
import math
import time
from collections import deque
from contextlib import suppress
from pathlib import Path

from rich.console import Console
from rich.status import Status

from kempelen.app.cameras import OpenCamera, open_camera
from kempelen.app.config import load_config
from kempelen.core.errors import CameraError
from kempelen.frames.recording import EncodedFrame, RecordingWriter

_LOOK_S = 0.5
_PATIENCE_S = 10.0
_AHEAD = 2  # frames being encoded; each keeps a slot of the ring


def run_record(
    camera: str, out: Path, seconds: float | None, frames: int | None, *, jpeg: bool, config: Path | None
) -> None:
    """From the first frame on, until the time is over, there are frames enough, the camera ends, or Ctrl-C.

    Raises:
        ConfigError: ``camera`` names none.
        CameraError: it cannot be opened or shows nothing, or ``out`` cannot be written.
    """
    console = Console(stderr=True)
    opened = open_camera(camera, load_config(config))
    writer = RecordingWriter(out, "jpg" if jpeg else "png", camera)
    recorder = Recorder(opened, writer, seconds, frames)
    try:
        with console.status(f"Opening {camera} …") as status, suppress(KeyboardInterrupt):
            asyncio.run(recorder.run(status))
    finally:
        console.print(recorder.summary(out), markup=False, highlight=False, soft_wrap=True)


class Recorder:
    """One recording.

    Args:
        camera: Not yet entered.
        writer: Not yet entered: it is made when the camera has opened.
        seconds: How long; None for no limit.
        frames: How many; None for no limit.
    """

    def __init__(
        self, camera: OpenCamera, writer: RecordingWriter, seconds: float | None, frames: int | None
    ) -> None:
        self._camera = camera
        self._writer = writer
        self._seconds = math.inf if seconds is None else seconds
        self._frames = math.inf if frames is None else frames
        self._first = self._last = -1
        self._taken = 0
        self._pending = deque[asyncio.Task[EncodedFrame]]()

    async def run(self, status: Status | None = None) -> None:
        """Until the end.

        Args:
            status: Where progress is shown.

        Raises:
            CameraError: the camera was lost, or the disk is full; what was recorded is kept.
        """
        async with self._camera as camera:
            with self._writer as writer:
                try:
                    with suppress(EOFError):
                        await self._record(camera, status)
                finally:
                    while self._pending:
                        writer.add(await self._pending.popleft())

    async def _record(self, camera: OpenCamera, status: Status | None) -> None:
        heard = began = time.monotonic()
        while self._taken < self._frames and time.monotonic() - began < self._seconds:
            if await self._step(camera):
                heard = time.monotonic()
                began = heard if self._taken == 1 else began
            elif time.monotonic() - heard > _PATIENCE_S:
                raise CameraError(
                    f"No frame came for {_PATIENCE_S:g} s. {camera.status.message}".rstrip(),
                    hint="Check the camera; what was recorded is kept.",
                )
            if status is not None:
                status.update(f"{self._progress()}   Ctrl-C ends it.")

    async def _step(self, camera: OpenCamera) -> bool:
        """One frame, if one comes; it is encoded while the next ones come."""
        frame = await camera.newest(self._last, _LOOK_S)
        if frame is None:
            return False
        self._first = frame.sequence if self._first < 0 else self._first
        self._last = frame.sequence
        self._taken += 1
        self._pending.append(asyncio.create_task(asyncio.to_thread(self._writer.encoded, frame)))
        if len(self._pending) > _AHEAD:
            self._writer.add(await self._pending.popleft())
        return True

    def _progress(self) -> str:
        """Frames written, and those that came too fast."""
        missed = self._last - self._first + 1 - self._taken if self._first >= 0 else 0
        lost = f", {missed} missed" if missed else ""
        return f"{self._writer.frames} frames{lost}"

    def summary(self, out: Path) -> str:
        """What there is now."""
        if not self._writer.frames:
            return "Nothing was recorded."
        return f"{out}: {self._progress()}. Play it: --camera recording:{out}"
