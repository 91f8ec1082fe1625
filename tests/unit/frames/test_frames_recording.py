import json
import os
import signal
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.errors import CameraError
from kempelen.core.geometry import Transform
from kempelen.frames.recording import Recording, RecordingWriter, depth_to_units
from kempelen.sensing.cameras.recording import RecordingCamera

PLACES = ["clip", "clip.zip"]
RNG = np.random.default_rng(5)
COLOUR = RNG.integers(0, 255, (12, 16, 3), dtype=np.uint8)
OPTICS = Intrinsics(16, 12, 20.0, 21.0, 7.5, 5.5, (0.1, -0.2, 0.003, 0.004, 0.05))


def frame(number: int, optics: Intrinsics | None = OPTICS) -> Frame:
    depth = np.full((6, 8), 900.04 + number, np.float32)
    depth[0, 0] = 0
    small = Intrinsics.of_view(8, 6, 1.0)
    return Frame(
        number * 2, 100 + number / 1000, COLOUR + np.uint8(number), depth, optics, small,
        Transform.about_z(0.1, (52.0, 0.5, -1.0)), 100.004 + number / 1000, number,
    )  # fmt: skip


def record(path: Path, count: int = 5, colour_format: str = "png") -> Path:
    with RecordingWriter(path, colour_format, "test camera") as writer:  # type: ignore[arg-type]
        for number in range(count):
            writer.write(frame(number))
    return path


@pytest.mark.parametrize("name", PLACES)
class TestBothPlaces:
    def test_everything_comes_back(self, tmp_path: Path, name: str) -> None:
        with Recording(record(tmp_path / name)) as recording:
            assert (len(recording), recording.complete, recording.problems) == (5, True, [])
            assert recording.camera == "test camera"
            for number in range(5):
                got, sent = recording.frame(number), frame(number)
                for field in ("sequence", "time", "depth_time", "dropped", "colour_camera", "depth_camera"):
                    assert getattr(got, field) == getattr(sent, field)
                assert np.array_equal(got.colour_from_depth.matrix, sent.colour_from_depth.matrix)
                assert got.colour is not None
                assert sent.colour is not None
                assert got.depth is not None
                assert sent.depth is not None
                assert np.array_equal(got.colour, sent.colour)
                assert np.abs(got.depth - sent.depth).max() <= 0.051
                assert got.depth[0, 0] == 0
                assert recording.time(number) == sent.time

    def test_optics_may_change(self, tmp_path: Path, name: str) -> None:
        with RecordingWriter(tmp_path / name) as writer:
            writer.write(frame(0))
            writer.write(frame(1, None))
        with Recording(tmp_path / name) as recording:
            assert recording.frame(0).colour_camera == OPTICS
            assert recording.frame(1).colour_camera is None

    def test_it_is_never_written_over(self, tmp_path: Path, name: str) -> None:
        record(tmp_path / name)
        with pytest.raises(CameraError, match="exists already"):
            record(tmp_path / name)

    def test_a_killed_recorder_leaves_all_whole_frames(self, tmp_path: Path, name: str) -> None:
        path = tmp_path / name
        program = (
            "import os, signal, sys\nfrom pathlib import Path\n"
            f"sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
            "from test_frames_recording import frame\n"
            "from kempelen.frames.recording import RecordingWriter\n"
            "writer = RecordingWriter(Path(sys.argv[1])).__enter__()\n"
            "for number in range(4): writer.write(frame(number))\n"
            "writer._sink.write('000004.colour.png', b'half of it')\n"
            "os.kill(os.getpid(), signal.SIGKILL)\n"
        )
        ended = subprocess.run([sys.executable, "-c", program, str(path)], check=False)
        assert ended.returncode == -signal.SIGKILL
        with Recording(path) as recording:
            assert len(recording) == 4
            assert not recording.complete
            assert "cut short: 4 whole frames" in recording.problems[0]
            assert recording.frame(3).sequence == 6

    def test_one_without_a_frame(self, tmp_path: Path, name: str) -> None:
        record(tmp_path / name, 0)
        with pytest.raises(CameraError, match="holds no whole frame"), Recording(tmp_path / name):
            pass

    def test_played_as_a_camera_and_around(self, tmp_path: Path, name: str) -> None:
        record(tmp_path / name, 3)
        with RecordingCamera(tmp_path / name, speed=0, loop=True) as camera:
            frames = [camera.read(1.0) for _ in range(8)]
        sequences = [each.sequence for each in frames if each]
        times = [each.time for each in frames if each]
        assert sequences == [0, 2, 4, 5, 7, 9, 10, 12]
        assert times == sorted(times)
        with RecordingCamera(tmp_path / name, speed=0) as camera:
            for _ in range(3):
                camera.read(1.0)
            with pytest.raises(EOFError):
                camera.read(1.0)


class TestPace:
    def test_a_frame_comes_when_it_is_due(self, tmp_path: Path) -> None:
        with RecordingWriter(tmp_path / "clip") as writer:
            writer.write(Frame(0, 0.0, COLOUR))
            writer.write(Frame(1, 1000.0, COLOUR))
        with RecordingCamera(tmp_path / "clip") as camera:
            assert camera.read(0.0) is not None
            assert camera.read(0.001) is None
        with RecordingCamera(tmp_path / "clip", speed=1e9) as camera:
            assert camera.read(0.0) is not None
            assert camera.read(0.1) is not None


class TestDamage:
    @pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.8])
    def test_a_file_cut_off_anywhere_gives_its_whole_frames(self, tmp_path: Path, share: float) -> None:
        path = record(tmp_path / "clip.zip", 10)
        os.truncate(path, int(path.stat().st_size * share))
        try:
            with Recording(path) as recording:
                assert not recording.complete
                for index in range(len(recording)):
                    assert recording.frame(index).sequence == index * 2
        except CameraError as error:
            assert share < 0.1, error  # noqa: PT017 - which of both is right depends on the share

    def test_a_damaged_picture_is_named_and_the_others_play_on(self, tmp_path: Path) -> None:
        path = record(tmp_path / "clip")
        picture = path / "000002.colour.png"
        data = bytearray(picture.read_bytes())
        data[60] ^= 1
        picture.write_bytes(data)
        with RecordingCamera(path, speed=0) as camera:
            camera.read(0)
            camera.read(0)
            with pytest.raises(CameraError, match=r"Frame 2 of .* colour\.png was changed"):
                camera.read(0)
            following = camera.read(0)
        assert following is not None
        assert following.sequence == 6
        assert following.dropped == 3 + 1

    def test_a_truncated_picture_is_named_with_its_sizes(self, tmp_path: Path) -> None:
        path = record(tmp_path / "clip")
        size = (path / "000001.depth.png").stat().st_size
        os.truncate(path / "000001.depth.png", 20)
        with Recording(path) as recording, pytest.raises(CameraError, match=f"Frame 1 .* 20 of {size} bytes"):
            recording.frame(1)

    @pytest.mark.parametrize("text", ["", "[]", "{", '{"members": {"colour.png": 3}}', '{"members": {}}'])
    def test_a_description_that_is_none(self, tmp_path: Path, text: str) -> None:
        path = record(tmp_path / "clip")
        (path / "000001.json").write_text(text)
        with Recording(path) as recording:
            with pytest.raises(CameraError, match="frame|Frame 1"):
                recording.frame(1)
            assert recording.frame(2).sequence == 4

    def test_missing_frames_are_counted(self, tmp_path: Path) -> None:
        path = record(tmp_path / "clip")
        (path / "000001.json").unlink()
        (path / "000003.json").unlink()
        with Recording(path) as recording:
            assert len(recording) == 3
            assert "lacks 2 frames, the first is number 1" in recording.problems[0]

    @pytest.mark.parametrize(
        ("manifest", "message"),
        [
            ("", "is no recording"),
            ("{}", "is no recording"),
            ('{"format": "kempelen recording", "version": 7}', "version 7"),
        ],
    )
    def test_what_is_no_recording(self, tmp_path: Path, manifest: str, message: str) -> None:
        path = record(tmp_path / "clip")
        (path / "manifest.json").write_text(manifest)
        with pytest.raises(CameraError, match=message), Recording(path):
            pass

    def test_other_files(self, tmp_path: Path) -> None:
        (tmp_path / "noise.zip").write_bytes(RNG.bytes(5000))
        with zipfile.ZipFile(tmp_path / "packed.zip", "w", zipfile.ZIP_DEFLATED) as packed:
            packed.writestr("manifest.json", json.dumps({"format": "kempelen recording", "version": 1}))
        for name in ("noise.zip", "packed.zip", "none.zip", "none"):
            with pytest.raises(CameraError, match=name), Recording(tmp_path / name):
                pass

    def test_a_full_or_forbidden_place(self, tmp_path: Path) -> None:
        (tmp_path / "file").write_text("in the way")
        with pytest.raises(CameraError, match="cannot be written"):
            record(tmp_path / "file" / "clip")


class TestDepth:
    def test_units_of_a_tenth(self) -> None:
        depth = np.array([[0.0, 0.04, 0.06, 1000.04, 6553.5, 6554.0, -5.0, np.nan, np.inf]], np.float32)
        with np.errstate(invalid="ignore"):
            units = depth_to_units(depth)
        assert units.tolist() == [[0, 0, 1, 10000, 65535, 0, 0, 0, 0]]

    def test_jpeg_is_smaller_and_near(self, tmp_path: Path) -> None:
        smooth = np.tile(np.linspace(0, 255, 320, dtype=np.uint8)[None, :, None], (240, 1, 3))
        with RecordingWriter(tmp_path / "clip", "jpg") as writer:
            writer.write(Frame(0, 0.0, smooth))
        with Recording(tmp_path / "clip") as recording:
            got = recording.frame(0).colour
        assert got is not None
        assert (tmp_path / "clip" / "000000.colour.jpg").exists()
        assert np.abs(got.astype(int) - smooth).max() <= 4

    def test_a_file_opens_in_other_programs(self, tmp_path: Path) -> None:
        with zipfile.ZipFile(record(tmp_path / "clip.zip", 2)) as opened:
            assert opened.testzip() is None
            assert "000001.depth.png" in opened.namelist()
