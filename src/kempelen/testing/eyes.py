"""Eyes without a camera: observations as scripted, and a process's eye fed by a ring of a test's own."""

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

from kempelen.core.camera import Frame
from kempelen.core.senses import Observation
from kempelen.frames.condition import CameraState, CameraStatus
from kempelen.frames.ring import RingWriter, ring_name


class ScriptedSensor:
    """A `kempelen.core.senses.BoardSensor` that shows what it is told to show.

    Args:
        script: Observations; the last one is shown for ever.
    """

    def __init__(self, script: Iterable[Observation] = ()) -> None:
        self._script = deque(script)
        self._last: Observation | None = None

    def show(self, *observations: Observation) -> None:
        """From now on, these."""
        self._script.clear()
        self._script.extend(observations)

    async def observe(self) -> AsyncIterator[Observation]:
        """One at a time, as fast as they are asked for."""
        while True:
            await asyncio.sleep(0)
            if self._script:
                self._last = self._script.popleft()
            if self._last is not None:
                yield self._last


@dataclass
class OwnRing:
    """Frames that a test writes. Context manager.

    Attributes:
        ring: Name, empty while "unplugged".
        status: As an open camera's.
    """

    slot_bytes: int = 1 << 22
    ring: str = ""
    status: CameraStatus = field(default_factory=lambda: CameraStatus(CameraState.RUNNING))

    def __enter__(self) -> Self:
        self.plug_in()
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self.unplug()

    def plug_in(self) -> None:
        """A new ring under a new name."""
        self.ring = ring_name("test")
        self._writer: RingWriter | None = RingWriter(self.ring, 5, self.slot_bytes).__enter__()

    def unplug(self) -> None:
        """The ring's writer has gone."""
        if self._writer is not None:
            self._writer.__exit__(None, None, None)
            self._writer = None
            self.ring = ""

    def write(self, frame: Frame) -> None:
        """One frame."""
        if self._writer is None:
            raise RuntimeError("the camera is unplugged")
        self._writer.write_frame(frame)
