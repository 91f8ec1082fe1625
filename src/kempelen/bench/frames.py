"""`kempelen bench frames`: what it costs to hand a 40 MB frame to another process, in copies of its memory.

One hand-over lasts from before the writer begins to copy until the reader, in another process, has the frame
and has checked its first and last pixels. It is compared with what no shared memory can undercut: one plain
copy of as many bytes within a process (``memcpy``), taken in turns with the hand-overs, in the same run, and
into as many buffers as the ring has slots. The 95th percentiles of both are compared as well: other programs
on the machine delay both alike. Beside it, in turns with copies again, a ``multiprocessing`` queue, which
pickles, and a pipe that moves raw bytes into a buffer kept ready.
"""

import os
import time
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from multiprocessing.queues import Queue
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from kempelen.bench.result import BenchResult, Progress
from kempelen.core.camera import Frame
from kempelen.frames.layout import frame_bytes
from kempelen.frames.ring import RingReader, RingWriter, ring_name

RATE = 30.0
_COLOUR = (2048, 5120, 3)
_DEPTH = (1400, 1530)
_SLOTS = 4
_FRAMES = 300
_PEER_FRAMES = 30
_WARM = 5
_PATIENCE_S = 20.0
_MS = 1e6
_COLUMNS = ("way", "n", "p50_ms", "p95_ms", "over_p50", "over_p95")
Bytes = npt.NDArray[np.uint8]
Times = list[tuple[int, int]]
"""Number of a frame and ns."""


def run(*, seed: int, pgn: Path | None, data: Path | None, progress: Progress) -> BenchResult:
    """Measure the ring at 30 frames/s, then its peers.

    Args:
        seed: Of the pixels.
        pgn: Not used.
        data: Not used.
        progress: Told now and then.
    """
    del pgn, data
    bench = _Bench(np.random.default_rng(seed), progress)
    ring, ring_copies, missed = bench.ring()
    queue, queue_copies = bench.queue()
    pipe, pipe_copies = bench.pipe()
    figures = {
        "over_memcpy_p50": _ratio(ring, ring_copies, 50),
        "over_memcpy_p95": _ratio(ring, ring_copies, 95),
        "queue_over_memcpy": _ratio(queue, queue_copies, 50),
        "pipe_over_memcpy": _ratio(pipe, pipe_copies, 50),
        "frames": len(ring),
        "frames_missed": missed,
        "megabytes": round(bench.size / 1e6, 2),
        "frames_per_s": RATE,
        "load_of_machine": round(os.getloadavg()[0], 2),
    }
    rows = [
        _row("memcpy", ring_copies, ring_copies),
        _row("ring", ring, ring_copies),
        _row("raw pipe", pipe, pipe_copies),
        _row("pickle queue", queue, queue_copies),
        {
            "way": "thesis, 300 to 490",
            "n": "-",
            "p50_ms": 300.0,
            "p95_ms": 490.0,
            "over_p50": "-",
            "over_p95": "-",
        },
    ]
    return BenchResult("frames", figures, rows)


def _ratio(times: npt.NDArray[np.float64], copies: npt.NDArray[np.float64], percentile: float) -> float:
    return round(float(np.percentile(times, percentile) / np.percentile(copies, percentile)), 3)


def _row(way: str, times: npt.NDArray[np.float64], copies: npt.NDArray[np.float64]) -> dict[str, Any]:
    ms = [float(np.percentile(times, percentile)) for percentile in (50, 95)]
    over = [str(_ratio(times, copies, percentile)) for percentile in (50, 95)]
    return dict(zip(_COLUMNS, (way, str(len(times)), *ms, *over), strict=True))


class _Bench:
    """The frame, and the buffers it is copied to."""

    def __init__(self, rng: np.random.Generator, progress: Progress) -> None:
        self._context = get_context("spawn")
        self._progress = progress
        self._colour = rng.integers(0, 255, _COLOUR, dtype=np.uint8)
        self._depth = rng.random(_DEPTH, dtype=np.float32)
        self._source = np.concatenate([self._colour.ravel(), self._depth.view(np.uint8).ravel()])
        self._copies = [np.zeros_like(self._source) for _ in range(_SLOTS)]
        self.size = self._source.nbytes

    def _copy(self, number: int) -> float:
        """Ns of one plain copy."""
        target = self._copies[number % _SLOTS]
        began = time.monotonic_ns()
        np.copyto(target, self._source)
        return float(time.monotonic_ns() - began)

    def _turns(self, count: int, hand_over: Callable[[int], int], rate: float) -> tuple[Times, list[float]]:
        """Hand-overs and copies in turns, now the one first and now the other: starts, and copies, ns."""
        starts, copies = Times(), list[float]()
        due = time.monotonic()
        for number in range(count + _WARM):
            if number % 2:
                copies.append(self._copy(number))
            starts.append((number, hand_over(number)))
            if not number % 2:
                copies.append(self._copy(number))
            due = max(due + 1 / rate, time.monotonic()) if rate else time.monotonic()
            time.sleep(max(0.0, due - time.monotonic()))
        return starts[_WARM:], copies[_WARM:]

    def _together(
        self, starts: Times, ends: Times, copies: list[float]
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Ms from start to end, and of the copies."""
        ended = dict(ends)
        spans = [ended[number] - start for number, start in starts if number in ended]
        return np.array(spans) / _MS, np.array(copies) / _MS

    def _stamp(self, number: int) -> None:
        self._colour[0, 0, 0] = number % 256
        self._depth[-1, -1] = number

    def ring(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], int]:
        """Hand-overs through the ring and copies, ms, and how many frames the reader never saw."""
        self._progress("ring and memcpy", 0.0)
        first = Frame(0, 0.0, self._colour, self._depth)
        with RingWriter(ring_name("bench"), _SLOTS, frame_bytes(first)) as ring:
            ring.prefault()

            def hand_over(number: int) -> int:
                self._stamp(number)
                began = time.monotonic_ns()
                ring.write_frame(Frame(number, 0.0, self._colour, self._depth))
                return began

            last = _FRAMES + _WARM - 1
            with _Reader(self._context, read_ring, ring.name, last) as reader:
                starts, copies = self._turns(_FRAMES, hand_over, RATE)
                ends = reader.ends()
        spans, plain = self._together(starts, ends, copies)
        return spans, plain, len(starts) - len(spans)

    def queue(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """The same by a queue that pickles, one after the other."""
        self._progress("pickle queue", 0.6)
        queue = self._context.Queue()
        with _Reader(self._context, read_queue, queue, _PEER_FRAMES + _WARM) as reader:

            def hand_over(number: int) -> int:
                began = time.monotonic_ns()
                queue.put((number, self._source))
                reader.wait()
                return began

            starts, copies = self._turns(_PEER_FRAMES, hand_over, 0.0)
            ends = reader.ends()
        queue.close()
        queue.join_thread()
        return self._together(starts, ends, copies)

    def pipe(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """The same by a pipe, raw bytes into a buffer kept ready."""
        self._progress("raw pipe", 0.8)
        far, near = self._context.Pipe(duplex=False)
        with _Reader(self._context, read_pipe, far, _PEER_FRAMES + _WARM, self.size) as reader:
            far.close()

            def hand_over(_number: int) -> int:
                began = time.monotonic_ns()
                near.send_bytes(self._source.data)
                reader.wait()
                return began

            starts, copies = self._turns(_PEER_FRAMES, hand_over, 0.0)
            ends = reader.ends()
        near.close()
        return self._together(starts, ends, copies)


class _Reader:
    """A process that reads, and tells when it had what. Context manager: ready when entered."""

    def __init__(self, context: SpawnContext, target: Callable[..., None], *arguments: object) -> None:
        self._ours, self._its = context.Pipe()
        self._process = context.Process(target=target, args=(self._its, *arguments), daemon=True)

    def __enter__(self) -> Self:
        self._process.start()
        self._its.close()
        self.wait()
        return self

    def __exit__(self, *_error: object) -> None:
        self._process.join(_PATIENCE_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._ours.close()

    def wait(self) -> None:
        """For its next word."""
        self._heard()

    def ends(self) -> Times:
        """When it had which frame, ns."""
        ends: Times = self._heard()
        return ends

    def _heard(self) -> Any:
        if not self._ours.poll(_PATIENCE_S):
            raise TimeoutError(f"the bench's reader has not answered for {_PATIENCE_S:g} s")
        return self._ours.recv()


def read_ring(told: Connection, name: str, last: int) -> None:
    """The reader of the ring: a process of its own.

    Args:
        told: Where to say that it is ready, and at the end when it had which frame.
        name: Of the ring.
        last: Number of the last frame.
    """
    ends, after = Times(), -1
    with RingReader(name, _PATIENCE_S) as ring:
        ring.prefault()
        told.send("ready")
        while after < last and (frame := ring.newest(after, _PATIENCE_S)) is not None:
            after = frame.sequence
            _check(frame)
            ends.append((after, time.monotonic_ns()))
            del frame
    told.send(ends)


def _check(frame: Frame) -> None:
    """Its first and its last pixel are those of this frame."""
    if frame.colour is None or frame.depth is None:
        raise ValueError("a frame without pictures")
    if frame.colour[0, 0, 0] != frame.sequence % 256 or frame.depth[-1, -1] != frame.sequence:
        raise ValueError(f"frame {frame.sequence} is not what was written")


def read_queue(told: Connection, queue: "Queue[tuple[int, Bytes]]", count: int) -> None:
    """The reader of the queue: a process of its own.

    Args:
        told: As for the ring, and after each frame that it came.
        queue: Of numbers and pixels.
        count: How many come.
    """
    ends = Times()
    told.send("ready")
    for _ in range(count):
        number, pixels = queue.get(timeout=_PATIENCE_S)
        int(pixels[-1])
        ends.append((number, time.monotonic_ns()))
        told.send("next")
    told.send(ends)


def read_pipe(told: Connection, pipe: Connection, count: int, size: int) -> None:
    """The reader of the pipe: a process of its own.

    Args:
        told: As for the queue.
        pipe: Of pixels.
        count: How many frames come.
        size: Of one, bytes.
    """
    ends, buffer = Times(), np.zeros(size, np.uint8)
    told.send("ready")
    for number in range(count):
        pipe.recv_bytes_into(buffer)
        int(buffer[-1])
        ends.append((number, time.monotonic_ns()))
        told.send("next")
    told.send(ends)
