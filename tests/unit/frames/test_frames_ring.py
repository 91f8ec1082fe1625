import fcntl
import gc
import os
import socket
import threading

import numpy as np
import pytest

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.errors import CameraError
from kempelen.core.geometry import Transform
from kempelen.frames import layout, ring
from kempelen.frames.door import address
from kempelen.frames.ring import RingReader, RingWriter, ring_name
from kempelen.testing.rings import SHAPE, numbered, until


def hold(writer: RingWriter, reader: RingReader, count: int) -> list[Frame | None]:
    """So many frames, written and read."""
    held = []
    for number in range(count):
        writer.write_frame(numbered(number))
        held.append(reader.newest())
    return held


class TestFrames:
    def test_everything_about_a_frame_arrives(self, writer: RingWriter) -> None:
        colour, depth = (
            Intrinsics.of_view(60, 40, 1.2),
            Intrinsics(30, 20, 31.0, 32.0, 14.5, 9.5, (0.1, -0.2, 0.3, 0.4, 0.5)),
        )
        sent = Frame(
            7,
            1.25,
            numbered(7).colour,
            numbered(7).depth,
            colour,
            depth,
            Transform.about_z(0.3, (52.0, 1.0, -2.0)),
            1.26,
            3,
        )
        with RingReader(writer.name) as reader:
            assert writer.write_frame(sent)
            got = reader.newest()
            assert got is not None
            for name in ("sequence", "time", "colour_camera", "depth_camera", "depth_time", "dropped"):
                assert getattr(got, name) == getattr(sent, name)
            assert np.array_equal(got.colour_from_depth.matrix, sent.colour_from_depth.matrix)
            assert got.colour is not None
            assert got.depth is not None
            assert np.array_equal(got.colour, np.full(SHAPE, 7))
            assert np.array_equal(got.depth, np.full((20, 30), 7))

    @pytest.mark.parametrize("what", ["colour", "depth"])
    def test_one_of_both_is_enough(self, writer: RingWriter, what: str) -> None:
        whole = numbered(1)
        half = Frame(1, 0.0, whole.colour) if what == "colour" else Frame(1, 0.0, depth=whole.depth)
        with RingReader(writer.name) as reader:
            writer.write_frame(half)
            got = reader.newest()
            assert got is not None
            assert (got.colour is None, got.depth is None) == (what == "depth", what == "colour")
            assert got.colour_camera is None
            assert got.depth_time is None

    def test_a_reader_cannot_write_on_it(self, writer: RingWriter) -> None:
        with RingReader(writer.name) as reader:
            writer.write_frame(numbered(1))
            got = reader.newest()
            assert got is not None
            assert got.colour is not None
            with pytest.raises(ValueError, match="read-only"):
                got.colour[0] = 0
            with pytest.raises(ValueError, match="WRITEABLE"):
                got.colour.setflags(write=True)

    def test_nothing_is_copied_on_the_reader_s_side(self, writer: RingWriter) -> None:
        with RingReader(writer.name) as one, RingReader(writer.name) as other:
            writer.write_frame(numbered(1))
            first, second = one.newest(), other.newest()
            assert first is not None
            assert second is not None
            assert first.colour is not None
            assert second.colour is not None
            writer._pixels[0][0] = 99
            assert first.colour[0, 0, 0] == second.colour[0, 0, 0] == 99

    def test_the_newest_wins(self, writer: RingWriter) -> None:
        with RingReader(writer.name) as reader:
            for number in range(20):
                writer.write_frame(numbered(number))
            got = reader.newest()
            assert got is not None
            assert got.sequence == 19
            assert reader.newest(19) is None

    def test_waiting_ends_when_a_frame_comes(self, writer: RingWriter) -> None:
        with RingReader(writer.name) as reader:
            assert reader.newest(timeout=0.001) is None
            later = threading.Timer(0.02, writer.write_frame, [numbered(5)])
            later.start()
            got = reader.newest(4, timeout=30)
            later.join()
            assert got is not None
            assert got.sequence == 5

    def test_a_frame_too_large_is_refused_with_both_sizes(self, writer: RingWriter) -> None:
        with pytest.raises(CameraError, match=r"36032 bytes .* hold 12288 bytes"):
            writer.write_frame(Frame(0, 0.0, np.zeros((100, 120, 3), np.uint8)))

    @pytest.mark.parametrize(
        "wrong",
        [
            Frame(0, 0.0),
            Frame(0, 0.0, np.zeros((4, 4), np.uint8)),
            Frame(0, 0.0, depth=np.zeros((4, 4), np.uint16)),
        ],
    )
    def test_what_no_camera_delivers_is_refused(self, writer: RingWriter, wrong: Frame) -> None:
        with pytest.raises(CameraError, match=r"frame"):
            writer.write_frame(wrong)


class TestLeases:
    def test_what_is_held_is_not_written_over(self, writer: RingWriter) -> None:
        with RingReader(writer.name) as reader:
            writer.write_frame(numbered(1))
            held = reader.newest()
            assert held is not None
            for number in range(2, 50):
                assert writer.write_frame(numbered(number))
            assert reader.still_valid(held)
            assert held.colour is not None
            assert (held.colour == 1).all()

    def test_letting_go_gives_the_slot_back(self, writer: RingWriter) -> None:
        with RingReader(writer.name) as reader:
            writer.write_frame(numbered(1))
            held = reader.newest()
            assert writer._control.held()
            depth = held.depth if held else None
            del held
            gc.collect()
            assert writer._control.held()
            del depth
            assert not writer._control.held()

    def test_with_all_slots_held_frames_are_lost_and_counted_and_nobody_waits(
        self, writer: RingWriter
    ) -> None:
        with RingReader(writer.name) as reader:
            held = hold(writer, reader, 4)
            assert not writer.write_frame(numbered(4))
            assert writer.lost == reader.lost == 1
            del held[1:3]
            assert writer.write_frame(numbered(5))
            got = reader.newest(3)
            assert got is not None
            assert got.dropped == 1

    def test_a_lease_that_is_too_old_is_passed_over_and_its_holder_can_tell(
        self, writer: RingWriter, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        with RingReader(writer.name) as reader:
            held = hold(writer, reader, 4)
            monkeypatch.setattr(ring, "LEASE_S", -1.0)
            assert writer.write_frame(numbered(4))
            valid = [reader.still_valid(each) for each in held if each]
            assert valid == [False, True, True, True]

    def test_who_holds_too_much_is_told(self) -> None:
        with RingWriter(ring_name("test"), 20, 10_000) as writer, RingReader(writer.name) as reader:
            held = hold(writer, reader, 8)
            writer.write_frame(numbered(8))
            with pytest.raises(CameraError, match="holds 8 frames"):
                reader.newest()
            assert len(held) == 8

    def test_a_frame_kept_beyond_its_reader_does_not_release_the_next_reader_s_lease(
        self, writer: RingWriter
    ) -> None:
        writer.write_frame(numbered(1))
        with RingReader(writer.name) as reader:
            old = reader.newest()
        until(lambda: writer.readers == 0)
        with RingReader(writer.name) as reader:
            new = reader.newest()
            del old
            assert writer._control.held()
            del new
            assert not writer._control.held()


class TestMeeting:
    def test_nobody_writes(self) -> None:
        with (
            pytest.raises(CameraError, match="Nobody writes to a ring named 'nothing'"),
            RingReader("nothing"),
        ):
            pass

    def test_a_reader_may_come_first(self) -> None:
        name = ring_name("test")
        writer = RingWriter(name, 3, 10_000)
        later = threading.Timer(0.05, writer.__enter__)
        later.start()
        with RingReader(name, patience=30) as reader:
            later.join()
            writer.write_frame(numbered(1))
            assert reader.newest() is not None
        writer.__exit__(None, None, None)

    def test_two_writers_of_one_name(self, writer: RingWriter) -> None:
        with pytest.raises(CameraError, match="Another program writes"), RingWriter(writer.name, 3, 100):
            pass

    @pytest.mark.parametrize(("slots", "size"), [(2, 100), (256, 100), (3, 0)])
    def test_sizes_that_make_no_ring(self, slots: int, size: int) -> None:
        with pytest.raises(CameraError, match="cannot be"), RingWriter("small", slots, size):
            pass

    @pytest.mark.parametrize("name", ["", "x" * 81, "two\nlines"])
    def test_names_that_are_none(self, name: str) -> None:
        with pytest.raises(CameraError, match="no name of a ring"), RingReader(name):
            pass

    def test_sixteen_readers_and_not_one_more(self, writer: RingWriter) -> None:
        readers = [RingReader(writer.name) for _ in range(17)]
        for reader in readers[:16]:
            reader.__enter__()
        with pytest.raises(CameraError, match="16 readers already"):
            readers[16].__enter__()
        writer.write_frame(numbered(3))
        frames = [reader.newest() for reader in readers[:16]]
        assert all(each and each.sequence == 3 for each in frames)
        readers[0].__exit__(None, None, None)
        until(lambda: writer.readers == 15)
        with readers[16]:
            assert readers[16].newest() is not None
        for reader in readers[1:16]:
            reader.__exit__(None, None, None)

    def test_no_readers_at_all(self, writer: RingWriter) -> None:
        for number in range(10):
            assert writer.write_frame(numbered(number))

    @pytest.mark.parametrize(
        ("change", "message"),
        [({"magic": b"SOMETHNG"}, "no ring of frames"), ({"version": 9}, "of version 9")],
    )
    def test_something_else_answers(
        self, writer: RingWriter, change: dict[str, object], message: str
    ) -> None:
        for name, value in change.items():
            writer._control.header[name] = value
        with pytest.raises(CameraError, match=message), RingReader(writer.name):
            pass

    def test_what_hangs_up_at_once_is_no_writer(self) -> None:
        name = ring_name("rude")
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as rude:
            rude.bind(address(name))
            rude.listen(1)

            def be_rude() -> None:
                visitor, _ = rude.accept()
                visitor.close()

            hang_up = threading.Thread(target=be_rude)
            hang_up.start()
            with pytest.raises(CameraError, match="Nobody writes"), RingReader(name):
                pass
            hang_up.join()

    def test_the_memory_cannot_be_cut_off_under_a_reader(self, writer: RingWriter) -> None:
        with pytest.raises(PermissionError):
            os.ftruncate(writer._memory, 0)
        assert fcntl.fcntl(writer._memory, fcntl.F_GET_SEALS) & fcntl.F_SEAL_SHRINK


def test_a_layout_is_whole_words() -> None:
    assert layout._SLOT.itemsize % 8 == layout._HEADER.itemsize % 8 == 0
