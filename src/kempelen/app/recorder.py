"""Recording what a camera sees, until it is told to stop."""

import asyncio
import math
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress

from kempelen.app.cameras import OpenCamera
from kempelen.core.errors import CameraError
from kempelen.frames.recording import EncodedFrame, RecordingWriter

_LOOK_S = 0.5
_PATIENCE_S = 10.0
_AHEAD = 2  # frames being encoded; each keeps a slot of the ring


def _nobody(progress: str) -> None:
    """Nobody wants to know."""
    del progress


class Recorder:
    """One recording.

    Args:
        camera: Not yet entered.
        writer: Not yet entered: it is made when the camera has opened.
        seconds: How long; None for no limit.
        frames: How many; None for no limit.
    """

    def __init__(
        self,
        camera: OpenCamera,
        writer: RecordingWriter,
        seconds: float | None = None,
        frames: int | None = None,
    ) -> None:
        self._camera = camera
        self._writer = writer
        self._seconds = math.inf if seconds is None else seconds
        self._frames = math.inf if frames is None else frames
        self._first = self._last = -1
        self._taken = 0
        self._pending = deque[asyncio.Task[EncodedFrame]]()

    @property
    def frames(self) -> int:
        """Written so far."""
        return self._writer.frames

    async def run(self, tell: Callable[[str], None] = _nobody) -> None:
        """Until the end.

        Args:
            tell: Takes the progress, in words.

        Raises:
            CameraError: the camera was lost, or the disk is full; what was recorded is kept.
        """
        async with self._camera as camera:
            with self._writer as writer:
                try:
                    with suppress(EOFError):
                        await self._record(camera, tell)
                finally:
                    while self._pending:
                        writer.add(await self._pending.popleft())

    async def _record(self, camera: OpenCamera, tell: Callable[[str], None]) -> None:
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
            tell(self.progress())

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

    def progress(self) -> str:
        """Frames written, and those that came too fast."""
        missed = self._last - self._first + 1 - self._taken if self._first >= 0 else 0
        lost = f", {missed} missed" if missed else ""
        return f"{self._writer.frames} frames{lost}"


class Tape:
    """A recording that runs in the background.

    Args:
        recorder: To be run.
        name: Of the file.
        ended: Called when it has ended, by itself or not.
    """

    def __init__(self, recorder: Recorder, name: str, ended: Callable[[], None]) -> None:
        self.name = name
        self._recorder = recorder
        self._task = asyncio.create_task(recorder.run(), name="recording")
        self._task.add_done_callback(lambda _: ended())

    @property
    def running(self) -> bool:
        """Whether it still records."""
        return not self._task.done()

    async def end(self) -> None:
        """Write what is there, and stop.

        Raises:
            CameraError: it had ended before, for this reason; what was recorded is kept.
        """
        self._task.cancel()
        (outcome,) = await asyncio.gather(self._task, return_exceptions=True)
        if isinstance(outcome, CameraError):
            raise outcome
