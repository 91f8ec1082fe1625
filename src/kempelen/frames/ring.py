"""Frames from one process to others through shared memory, without a copy on the reader's side.

One writer, up to 16 readers, N slots. The writer copies each frame into a slot that nobody reads and that
is not the newest one, then names it the newest; readers take the newest one and keep it where it is, under
a *lease*. Neither side ever waits for the other:

* a reader that is slow sees fewer frames, the others all of them;
* a reader that is dead has no leases: the kernel tells (``frames.door``);
* when readers hold all slots, the frame that comes is lost and counted. A lease that is older than
  ``LEASE_S`` does not count any more then: its holder hangs, and would find ``still_valid`` false.

The slot's *generation* is odd while it is being written. A writer killed half-way has not named the slot:
nobody ever sees half a frame.

Why a lease is safe: the reader stores it *and then* finds its slot to be still the newest; the writer looks
at the leases *after* it has named another slot the newest. So one of the two sees the other's store, as in
Dekker's algorithm. Words are single stores; the order is kept by ``_fence``.
"""

import fcntl
import mmap
import os
import select
import threading
import time
import weakref
from collections import deque
from contextlib import suppress
from itertools import count
from types import TracebackType
from typing import Self

import numpy as np

from kempelen.core.camera import Frame
from kempelen.core.errors import CameraError
from kempelen.frames.door import Door, enter, peer
from kempelen.frames.layout import (
    HOLDS,
    MAX_SLOTS,
    Bytes,
    Control,
    FrameReader,
    Words,
    check_header,
    control_bytes,
    frame_bytes,
    lease,
    now_ms,
    pages,
    put,
    require_frame,
    write_header,
)

LEASE_S = 2.0
MIN_SLOTS = 3
_TRIES = 1000
_SEALS = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL  # no one can make a mapping fault
_NUMBERS = count()
_ATOMIC = threading.Lock()


def _fence() -> None:
    """Stores before it are seen by all before loads after it: a lock's atomic exchange is a full barrier."""
    with _ATOMIC:
        pass


def ring_name(what: str = "camera") -> str:
    """A name that nobody else uses."""
    return f"{what}-{os.getpid()}-{next(_NUMBERS)}"


class RingWriter:
    """The side that has frames. Context manager.

    Args:
        name: For readers; see ``ring_name``.
        slots: 3 or more: the newest, one being written, one for each frame that a reader holds.
        slot_bytes: Size of the largest frame (``frames.layout.frame_bytes``). Memory is taken when it is
            first written to.
    """

    def __init__(self, name: str, slots: int, slot_bytes: int) -> None:
        self.name = name
        self._slots = slots
        self._slot_bytes = pages(slot_bytes)
        self._count = 0

    def __enter__(self) -> Self:
        """Take the memory and open the door.

        Raises:
            CameraError: the name is in use, or the sizes make no ring.
        """
        if not MIN_SLOTS <= self._slots <= MAX_SLOTS or self._slot_bytes < 1:
            raise CameraError(
                f"A ring of {self._slots} slots of {self._slot_bytes} bytes cannot be; wanted are "
                f"{MIN_SLOTS} to {MAX_SLOTS} slots of 1 byte or more.",
                hint="Ask for 4 slots of the size of a frame.",
            )
        start = control_bytes(self._slots)
        total = start + self._slots * self._slot_bytes
        memory = os.memfd_create(f"kempelen-{self.name}", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        try:
            os.ftruncate(memory, total)
            fcntl.fcntl(memory, fcntl.F_ADD_SEALS, _SEALS)
            self._map(mmap.mmap(memory, total), start)
            self._door = Door(self.name, memory, self._forget)
        except BaseException:
            os.close(memory)
            raise
        self._memory = memory
        return self

    def _map(self, memory: mmap.mmap, start: int) -> None:
        self._control = Control(memory, self._slots)
        write_header(self._control, self._slots, self._slot_bytes, os.getpid())
        pixels = np.frombuffer(memory, np.uint8, offset=start)
        self._pixels = list(pixels.reshape(self._slots, self._slot_bytes))
        self._order = deque(range(self._slots))  # the one written longest ago first

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Readers see the end; what they hold stays theirs."""
        self._door.close()
        os.close(self._memory)

    @property
    def readers(self) -> int:
        """How many are attached."""
        return self._door.readers

    @property
    def lost(self) -> int:
        """Frames that found all slots held by readers."""
        return int(self._control.lost[0])

    def prefault(self) -> None:
        """Take all the memory now, so that the first frames are not slower than the others."""
        for slot in self._pixels:
            slot[:: mmap.PAGESIZE] = 0

    def write_frame(self, frame: Frame) -> bool:
        """Copy a frame into the ring and wake the readers.

        Returns:
            Whether it was kept; False when readers hold all slots: it is lost and counted.

        Raises:
            CameraError: it is larger than a slot, or not what a camera delivers.
        """
        require_frame(frame)
        if (size := frame_bytes(frame)) > self._slot_bytes:
            raise CameraError(
                f"A frame of {size} bytes does not fit into the ring '{self.name}', whose slots hold "
                f"{self._slot_bytes} bytes.",
                hint="Open the ring with larger slots.",
            )
        slot = self._free_slot()
        if slot is None:
            self._control.lost[0] += np.uint64(1)
            return False
        self._write(slot, frame)
        self._door.wake()
        return True

    def _free_slot(self) -> int | None:
        """The one written longest ago of those that are neither the newest nor being read."""
        held = self._control.held()
        newest = self._order[-1] if self._count else None
        for slot in self._order:
            if slot != newest and slot not in held:
                return slot
        stale = now_ms() - int(LEASE_S * 1000)
        for slot in self._order:
            if slot != newest and held[slot] < stale:
                return slot
        return None

    def _write(self, slot: int, frame: Frame) -> None:
        control, one = self._control, np.uint64(1)
        control.generation[slot] += one
        _fence()
        put(control, slot, self._pixels[slot], frame, self.lost)
        _fence()
        control.generation[slot] += one
        self._count += 1
        control.beat[0] = time.monotonic_ns()
        control.newest[0] = (self._count << 8) | slot
        _fence()
        self._order.remove(slot)
        self._order.append(slot)

    def _forget(self, row: int) -> None:
        """A reader is gone, and his leases with him."""
        self._control.cells[row] = 0


class RingReader:
    """A side that wants frames. Context manager, for one thread.

    A frame's arrays lie in the ring and are read-only; the frame is leased as long as one of them is alive,
    and no longer: drop it, or copy what is to be kept.

    Args:
        name: Of the ring.
        patience: s to wait for a writer that is still starting.
    """

    def __init__(self, name: str, patience: float = 0.0) -> None:
        self.name = name
        self._patience = patience
        self._seen = (0, -1)  # the word that named the newest frame last time, and that frame's sequence

    def __enter__(self) -> Self:
        """Attach.

        Raises:
            CameraError: nobody writes to a ring of that name, it is of another version, or has readers
                enough.
        """
        self._socket, memory, row = enter(self.name, self._patience)
        try:
            self._map(memory, row)
        except BaseException:
            self._socket.close()
            raise
        finally:
            os.close(memory)
        self._writer = peer(self._socket)[0]
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)
        self._ended = False
        return self

    def _map(self, memory: int, row: int) -> None:
        flags = mmap.MAP_SHARED
        with mmap.mmap(memory, mmap.PAGESIZE, flags, mmap.PROT_READ) as header:
            slots, slot_bytes = check_header(header, self.name)
        start = control_bytes(slots)
        self._control = Control(mmap.mmap(memory, start, flags, mmap.PROT_READ | mmap.PROT_WRITE), slots)
        view = mmap.mmap(memory, slots * slot_bytes, flags, mmap.PROT_READ, offset=start)
        self._view, self._slot_bytes = view, slot_bytes
        self._leases = _Leases(self._control.cells[row])
        self._frames = FrameReader()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Detach; frames that are still held stay readable, but are leased no more."""
        self._leases.end()
        self._socket.close()

    @property
    def writer(self) -> int:
        """Process that writes."""
        return self._writer

    @property
    def age(self) -> float:
        """How long ago the newest frame was written, s; from the ring's start as long as there is none."""
        return (time.monotonic_ns() - int(self._control.beat[0])) / 1e9

    @property
    def lost(self) -> int:
        """Frames that found all slots held by readers."""
        return int(self._control.lost[0])

    def fileno(self) -> int:
        """Readable when there is something new or the writer is gone: for ``loop.add_reader``."""
        return self._socket.fileno()

    def newest(self, after: int = -1, timeout: float = 0.0) -> Frame | None:
        """The newest frame, where it lies.

        Args:
            after: Only one with a higher sequence than this.
            timeout: s to wait for it.

        Returns:
            The frame; None when there was none in time.

        Raises:
            CameraError: the writer is gone and there is no such frame, or this reader holds too many.
        """
        deadline = time.monotonic() + timeout
        while (frame := self._take(after)) is None:
            if self._ended:
                raise CameraError(
                    f"The program that wrote the ring '{self.name}' (process {self._writer}) has ended.",
                    hint="Start it again: it may have said why it ended.",
                )
            left = deadline - time.monotonic()
            if not self._poll.poll(max(left, 0.0) * 1000) and left <= 0:
                return None
            self._listen()
        return frame

    def still_valid(self, frame: Frame) -> bool:
        """Whether the frame is what it was: False once a lease of more than ``LEASE_S`` was passed over."""
        taken = self._leases.taken.get(_buffer(frame))
        return taken is not None and int(self._control.generation[taken[0]]) == taken[1]

    def prefault(self) -> None:
        """Map all the memory now, so that the first frames are not slower than the others."""
        np.frombuffer(self._view, np.uint8)[:: mmap.PAGESIZE].max()

    def _listen(self) -> None:
        """Take in what the writer has sent: only that it did, or that it is gone, matters."""
        with suppress(BlockingIOError):
            while self._socket.recv(1):
                pass
            self._ended = True

    def _take(self, after: int) -> Frame | None:
        newest = self._control.newest
        for _ in range(_TRIES):
            word = int(newest[0])
            known, sequence = self._seen
            if not word or (word == known and sequence <= after):
                return None
            slot = word & 255
            cell = self._leases.take(slot, self.name)
            _fence()
            if int(newest[0]) == word:
                return self._leased(word, cell, after)
            self._leases.drop(cell)
        raise CameraError(
            f"The ring '{self.name}' is written faster than it can be read.", hint="Ask for fewer frames/s."
        )

    def _leased(self, word: int, cell: int, after: int) -> Frame | None:
        slot = word & 255
        buffer = np.frombuffer(self._view, np.uint8, self._slot_bytes, slot * self._slot_bytes)
        self._leases.keep(cell, buffer, slot, int(self._control.generation[slot]))
        frame = self._frames.get(self._control, slot, buffer)
        self._seen = (word, frame.sequence)
        return frame if frame.sequence > after else None


class _Leases:
    """A reader's row of cells."""

    def __init__(self, cells: Words) -> None:
        self._cells = cells
        self._free = deque(range(HOLDS))
        self._ours = True
        self.taken: dict[int, tuple[int, int]] = {}  # slot and generation by the buffer's identity

    def take(self, slot: int, name: str) -> int:
        """A cell that says that ``slot`` is being read."""
        if not self._free:
            raise CameraError(
                f"A program holds {HOLDS} frames of the ring '{name}'; more is not allowed.",
                hint="Copy what is to be kept, and let go of the frames.",
            )
        cell = self._free.popleft()
        self._cells[cell] = lease(slot)
        return cell

    def keep(self, cell: int, buffer: Bytes, slot: int, generation: int) -> None:
        """Until the last view of ``buffer`` is gone."""
        self.taken[id(buffer)] = (slot, generation)
        weakref.finalize(buffer, self._gone, cell, id(buffer)).atexit = False

    def _gone(self, cell: int, buffer: int) -> None:
        del self.taken[buffer]
        self.drop(cell)

    def drop(self, cell: int) -> None:
        """Leave the slot to the writer."""
        if self._ours:
            self._cells[cell] = 0
        self._free.append(cell)

    def end(self) -> None:
        """The row is another reader's from now on."""
        self._cells[:] = 0
        self._ours = False


def _buffer(frame: Frame) -> int:
    """Identity of what a frame's arrays are views of."""
    array = frame.colour if frame.colour is not None else frame.depth
    return id(None if array is None else array.base)
