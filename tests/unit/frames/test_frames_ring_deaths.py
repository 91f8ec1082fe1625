import gc
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from kempelen.core.errors import CameraError
from kempelen.frames.ring import RingReader, RingWriter, ring_name
from kempelen.testing.rings import numbered, until

PREAMBLE = """
import os, signal, sys, time
import numpy as np
from kempelen.core.camera import Frame
from kempelen.frames.ring import RingReader, RingWriter
def frame(number):
    return Frame(number, 0.0, np.full((200, 200, 3), number % 251, np.uint8))
"""
READER_THAT_HOLDS = (
    PREAMBLE
    + """
with RingReader(sys.argv[1]) as reader:
    held = reader.newest()
    print(held.sequence, flush=True)
    sys.stdin.read()
"""
)
WRITER_KILLED_HALFWAY = (
    PREAMBLE
    + """
from kempelen.frames import layout, ring
def half(control, slot, pixels, new, lost):
    if new.sequence == 5:
        pixels[:60000] = 77
        os.kill(os.getpid(), signal.SIGKILL)
    layout.put(control, slot, pixels, new, lost)
ring.put = half
with RingWriter(sys.argv[1], 3, 120000) as writer:
    while not writer.readers:
        time.sleep(0.001)
    for number in range(9):
        writer.write_frame(frame(number))
"""
)
WRITER_AT_FULL_SPEED = (
    PREAMBLE
    + """
with RingWriter(sys.argv[1], 3, 120000) as writer:
    number = 0
    while not writer.readers:
        time.sleep(0.001)
    while writer.readers:
        writer.write_frame(frame(number))
        number += 1
"""
)


class running:  # noqa: N801 - reads as a word in a with statement
    """A program of our own, ended with the block."""

    def __init__(self, program: str, *arguments: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", program, *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    def __enter__(self) -> "subprocess.Popen[bytes]":
        return self._process

    def __exit__(self, *_error: object) -> None:
        self._process.kill()
        self._process.communicate()


def memories() -> set[str]:
    """Memory without a name that this process has open or mapped."""
    lines = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    return {line.split()[4] for line in lines if "memfd:kempelen" in line}


class TestDeaths:
    def test_an_ended_writer_is_told_after_its_last_frame_was_had(self) -> None:
        writer = RingWriter(ring_name("test"), 3, 10_000)
        writer.__enter__()
        with RingReader(writer.name) as reader:
            writer.write_frame(numbered(4))
            writer.__exit__(None, None, None)
            got = reader.newest(3)
            assert got is not None
            assert got.sequence == 4
            with pytest.raises(CameraError, match=f"process {os.getpid()}\\) has ended"):
                reader.newest(4, timeout=30)
            assert got.colour is not None
            assert (got.colour == 4).all()

    def test_a_writer_killed_while_writing_leaves_only_whole_frames_and_no_memory(self) -> None:
        name = ring_name("killed")
        with running(WRITER_KILLED_HALFWAY, name), RingReader(name, patience=30) as reader:
            seen = list[int]()
            with suppress(CameraError):
                while True:
                    got = reader.newest(seen[-1] if seen else -1, timeout=30)
                    assert got is not None
                    assert got.colour is not None
                    assert (got.colour == got.sequence).all()
                    seen.append(got.sequence)
            assert seen[-1] == 4
        with RingWriter(name, 3, 100):  # nothing of the dead one is in the way
            pass

    def test_a_killed_reader_s_leases_end_with_it(self, writer: RingWriter) -> None:
        writer.write_frame(numbered(1))
        with running(READER_THAT_HOLDS, writer.name) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == b"1\n"
            assert writer._control.held()
            process.send_signal(signal.SIGKILL)
            until(lambda: not writer._control.held())
        assert writer.readers == 0
        assert writer.write_frame(numbered(2))

    def test_a_stopped_reader_does_not_stop_the_others(self, writer: RingWriter) -> None:
        writer.write_frame(numbered(1))
        with running(READER_THAT_HOLDS, writer.name) as process, RingReader(writer.name) as reader:
            assert process.stdout is not None
            process.stdout.readline()
            process.send_signal(signal.SIGSTOP)
            for number in range(2, 1000):  # more than its socket holds bytes to wake it
                assert writer.write_frame(numbered(number))
            got = reader.newest()
            assert got is not None
            assert got.sequence == 999

    def test_nothing_is_left_in_memory(self) -> None:
        before = memories()
        for _ in range(3):
            with RingWriter(ring_name("test"), 3, 10_000) as writer, RingReader(writer.name) as reader:
                writer.write_frame(numbered(1))
                assert reader.newest() is not None
            del writer, reader
        gc.collect()
        assert memories() <= before


class TestStress:
    def test_no_torn_frame_is_ever_seen(self) -> None:
        name = ring_name("stress")
        with running(WRITER_AT_FULL_SPEED, name), RingReader(name, patience=30) as reader:
            after, seen = -1, 0
            while after < 3000:
                got = reader.newest(after, timeout=30)
                assert got is not None
                assert got.colour is not None
                low, high = int(got.colour.min()), int(got.colour.max())
                assert low == high == got.sequence % 251
                assert reader.still_valid(got)
                after, seen = got.sequence, seen + 1
        assert seen > 10
