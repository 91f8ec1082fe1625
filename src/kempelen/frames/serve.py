"""The inside of a camera's process: a driver's frames go into a ring.

The process ends when its owner says so or is gone; a driver that hangs in its library at that time is
given a moment and then left behind.
"""

import importlib
import os
import threading
import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import Any, Self

from kempelen.core.camera import Camera, Frame
from kempelen.core.errors import CameraError, KempelenError
from kempelen.frames.channel import Channel, Message
from kempelen.frames.layout import frame_bytes
from kempelen.frames.ring import RingWriter, ring_name

_READ_S = 0.2
_STATUS_S = 1.0
_GRACE_S = 3.0
_FAILED = 1


def make_camera(factory: str, options: Mapping[str, Any]) -> Camera:
    """A driver by its dotted name, ``package.module:factory``; no I/O yet.

    Raises:
        CameraError: there is nothing of that name, or it does not take these options.
    """
    module, _, name = factory.partition(":")
    try:
        camera: Camera = getattr(importlib.import_module(module), name)(**options)
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        given = ", ".join(f"{key}={value!r}" for key, value in options.items()) or "no options"
        raise CameraError(
            f"The camera driver '{factory}' cannot be made with {given}: {error}.",
            hint="Check the camera's options, and that its package is installed.",
        ) from error
    return camera


def serve(channel: Channel) -> int:
    """Run the camera that the owner asks for; returns the exit code."""
    order = channel.receive()
    if order is None:
        return _FAILED
    orders = _Orders(channel)
    with _Output(channel, order.fields["slots"], order.fields["first"]) as output:
        try:
            with make_camera(order.fields["factory"], order.fields["options"]) as camera:
                _pump(camera, output, orders)
        except EOFError:
            channel.send("ended")
        except KempelenError as error:
            channel.send("error", message=error.message, hint=error.hint)
        orders.closed.wait()  # the last frame stays until the owner has had it
    return 0


def _pump(camera: Camera, output: "_Output", orders: "_Orders") -> None:
    """Until the owner has had enough.

    Raises:
        EOFError: the recording has ended.
        CameraError: the camera has failed.
    """
    told = time.monotonic()
    while not orders.closed.is_set():
        frame = camera.read(_READ_S)
        if frame is not None:
            output.write(frame, camera.name)
        for order in orders.waiting():
            if order.kind == "options":
                output.channel.send("options", **getattr(camera, "settings", {}))
        if time.monotonic() - told >= _STATUS_S:
            output.tell()
            told = time.monotonic()


class _Orders:
    """What the owner wants: read by a thread, since drivers block.

    Attributes:
        closed: Set when the owner has had enough, or is gone.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._queue = SimpleQueue[Message]()
        self.closed = threading.Event()
        threading.Thread(target=self._listen, name="orders", daemon=True).start()

    def _listen(self) -> None:
        while (order := self._channel.receive()) is not None and order.kind != "close":
            self._queue.put(order)
        self.closed.set()
        time.sleep(_GRACE_S)
        os._exit(_FAILED)  # the driver hangs: nothing else ends it, and nobody needs it

    def waiting(self) -> list[Message]:
        """Those not yet answered."""
        orders = []
        try:
            while True:
                orders.append(self._queue.get_nowait())
        except Empty:
            return orders


class _Output:
    """The ring, made when the first frame says how large it must be, and made anew for larger ones."""

    def __init__(self, channel: Channel, slots: int, first: int) -> None:
        self.channel = channel
        self._slots = slots
        self._first = first
        self._size = 0
        self._ring: RingWriter | None = None
        self._stack = ExitStack()
        self._frames = 0
        self._dropped = 0

    def __enter__(self) -> Self:
        """Nothing yet."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Readers see the end."""
        self._stack.close()

    def write(self, frame: Frame, camera: str) -> None:
        """Hand a frame over."""
        frame = replace(frame, sequence=frame.sequence + self._first)
        if self._ring is None or frame_bytes(frame) > self._size:
            self._ring = self._open(frame, camera)
        self._ring.write_frame(frame)
        self._frames += 1
        self._dropped = frame.dropped

    def _open(self, frame: Frame, camera: str) -> RingWriter:
        self._stack.close()
        self._size = frame_bytes(frame)
        ring = self._stack.enter_context(RingWriter(ring_name(), self._slots, self._size))
        self.channel.send("opened", ring=ring.name, name=camera)
        return ring

    def tell(self) -> None:
        """How it is going."""
        lost = self._ring.lost if self._ring is not None else 0
        self.channel.send("status", frames=self._frames, dropped=self._dropped, lost=lost)
