"""A camera that does what a test wants, good or bad; made by name in a camera's process."""

import os
import signal
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from kempelen.core.camera import Frame
from kempelen.core.errors import CameraError

SCRIPTED = "kempelen.testing.cameras:ScriptedCamera"


class ScriptedCamera:
    """Frames of one colour each: its number.

    Args:
        frames: Until the end.
        absent: Message of the error when it is opened.
        absent_until: File whose existence plugs it in.
        fails_at: Frame instead of which it fails.
        dies_at: Frame instead of which its process is killed.
        breaks_at: Frame instead of which it has a bug.
        grows_at: Frame from which pictures are larger.
        hangs_at: Frame instead of which it is deaf to everything.
    """

    def __init__(
        self,
        *,
        frames: int = 1_000_000,
        absent: str = "",
        absent_until: str = "",
        fails_at: int = -1,
        dies_at: int = -1,
        breaks_at: int = -1,
        grows_at: int = -1,
        hangs_at: int = -1,
    ) -> None:
        self.name = "scripted"
        self.settings: dict[str, Any] = {"frames": frames}
        self._frames = frames
        self._absent = absent
        self._until = absent_until
        self._fails_at = fails_at
        self._dies_at = dies_at
        self._breaks_at = breaks_at
        self._grows_at = grows_at
        self._hangs_at = hangs_at
        self._next = 0

    def __enter__(self) -> Self:
        """Open it, or not."""
        if self._absent or (self._until and not Path(self._until).exists()):
            raise CameraError(self._absent or "There is no such camera.", hint="Plug it in.")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing is open."""

    def read(self, timeout: float) -> Frame | None:
        """What the script says."""
        number = self._next
        self._next += 1
        if number == self._hangs_at:
            time.sleep(1000)
        if number == self._frames:
            raise EOFError
        if number == self._fails_at:
            raise CameraError("The camera was unplugged.", hint="Plug it in again.")
        if number == self._dies_at:
            sys.stderr.write("libcamera: bus error\n")
            sys.stderr.flush()
            os.kill(os.getpid(), signal.SIGKILL)
        if number == self._breaks_at:
            raise ZeroDivisionError
        time.sleep(min(timeout, 0.002))
        size = 8 if self._grows_at < 0 or number < self._grows_at else 64
        return Frame(number, number / 30, np.full((size, size, 3), number % 251, np.uint8))
