"""Somebody else's ring, read by an asyncio program."""

import asyncio
import time
from contextlib import suppress
from types import TracebackType
from typing import Self

from kempelen.core.camera import Frame
from kempelen.core.errors import CameraError
from kempelen.frames.condition import CameraState, CameraStatus, silence
from kempelen.frames.ring import RingReader


async def arrival(reader: RingReader | None, news: asyncio.Event, seconds: float) -> None:
    """Until the ring has something new, ``news`` is set, or the time is over."""
    if reader is not None:
        asyncio.get_running_loop().add_reader(reader.fileno(), news.set)
    try:
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await news.wait()
    finally:
        if reader is not None and reader.fileno() >= 0:
            asyncio.get_running_loop().remove_reader(reader.fileno())


class AttachedCamera:
    """Async context manager: the frames of a ring that another program writes. For one task.

    Args:
        ring: Its name.
        patience: s to wait for its writer to start.
    """

    def __init__(self, ring: str, patience: float = 0.0) -> None:
        self.ring = ring
        self._reader = RingReader(ring, patience)
        self._status = CameraStatus(CameraState.STARTING, camera=f"ring {ring}")
        self._news = asyncio.Event()

    async def __aenter__(self) -> Self:
        """Attach.

        Raises:
            CameraError: nobody writes to it.
        """
        await asyncio.to_thread(self._reader.__enter__)
        self._tell(CameraState.RUNNING, "")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Detach."""
        self._reader.__exit__(kind, error, trace)
        self._tell(CameraState.CLOSED, "")

    @property
    def status(self) -> CameraStatus:
        """As of now."""
        if self._status.state is not CameraState.RUNNING:
            return self._status
        return silence(self._status, self._reader.age)

    async def newest(self, after: int = -1, within: float = 0.0) -> Frame | None:
        """The newest frame, where it lies in the ring; let go of it soon.

        Args:
            after: Only one with a higher sequence than this.
            within: s to wait for it.

        Returns:
            The frame; None when there was none in time: ``status`` says why.

        Raises:
            CameraError: its writer has ended.
        """
        deadline = time.monotonic() + within
        while True:
            self._news.clear()
            try:
                frame = self._reader.newest(after)
            except CameraError as error:
                self._tell(CameraState.LOST, str(error))
                raise
            left = deadline - time.monotonic()
            if frame is not None or left <= 0:
                return frame
            await arrival(self._reader, self._news, left)

    def _tell(self, state: CameraState, message: str) -> None:
        self._status = CameraStatus(state, message, self._status.camera)
