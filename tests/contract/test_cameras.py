import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from kempelen.core.camera import Frame, Intrinsics
from kempelen.frames.layout import frame_bytes
from kempelen.frames.recording import RecordingWriter
from kempelen.frames.ring import RingWriter, ring_name
from kempelen.sensing.cameras import uvc
from kempelen.sensing.cameras.azure import AzureKinectCamera
from kempelen.sensing.cameras.kinect2 import Kinect2Camera
from kempelen.sensing.cameras.picture import PictureCamera
from kempelen.sensing.cameras.realsense import RealSenseCamera
from kempelen.sensing.cameras.recording import RecordingCamera
from kempelen.sensing.cameras.ring import RingCamera
from kempelen.testing import camera_libraries as libraries
from kempelen.testing.contracts.camera import CameraContract, CameraRig


def frame(number: int) -> Frame:
    optics = Intrinsics.of_view(16, 12, 1.0)
    return Frame(
        number, number / 1000, np.full((12, 16, 3), number, np.uint8), np.full((12, 16), number, np.float32),
        optics, optics,
    )  # fmt: skip


class TestUvc(CameraContract):
    @pytest.fixture
    def rig(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[CameraRig]:
        bench = libraries.Bench()
        monkeypatch.setattr(uvc, "DEVICES", tmp_path)
        monkeypatch.setattr(cv2, "VideoCapture", libraries.video_capture(bench))
        (tmp_path / "video0").touch()

        def unplug() -> None:
            bench.present = False
            (tmp_path / "video0").unlink()

        yield CameraRig(uvc.UvcCamera, lambda: uvc.UvcCamera(3), unplug)
        assert bench.calls[-1:] in ([], ["release"])


class TestRealSense(CameraContract):
    @pytest.fixture
    def rig(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[CameraRig]:
        bench = libraries.Bench()
        monkeypatch.setitem(sys.modules, "pyrealsense2", libraries.pyrealsense2(bench))
        yield CameraRig(
            lambda: RealSenseCamera(colour=(32, 24), depth=(16, 12)),
            lambda: RealSenseCamera("999"),
            lambda: setattr(bench, "present", False),
        )
        assert bench.calls.count("start") == bench.calls.count("stop")


class TestAzure(CameraContract):
    @pytest.fixture
    def rig(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[CameraRig]:
        bench = libraries.Bench()
        monkeypatch.setitem(sys.modules, "pyk4a", libraries.pyk4a(bench))

        def absent() -> AzureKinectCamera:
            bench.present = False
            return AzureKinectCamera()

        yield CameraRig(AzureKinectCamera, absent, lambda: setattr(bench, "present", False))
        assert bench.calls.count("start") - bench.calls.count("stop") in {0, 1}


class TestKinect2(CameraContract):
    @pytest.fixture
    def rig(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[CameraRig]:
        bench = libraries.Bench()
        monkeypatch.setitem(sys.modules, "freenect2", libraries.freenect2(bench))

        def absent() -> Kinect2Camera:
            bench.present = False
            return Kinect2Camera()

        yield CameraRig(Kinect2Camera, absent, None)
        assert bench.calls.count("start") == bench.calls.count("close")


@pytest.mark.parametrize("name", ["clip", "clip.zip"])
class TestRecording(CameraContract):
    @pytest.fixture
    def rig(self, tmp_path: Path, name: str) -> CameraRig:
        with RecordingWriter(tmp_path / name) as writer:
            for number in range(6):
                writer.write(frame(number))
        return CameraRig(
            lambda: RecordingCamera(tmp_path / name), lambda: RecordingCamera(tmp_path / "none"), None
        )


class TestPicture(CameraContract):
    @pytest.fixture
    def rig(self, tmp_path: Path) -> CameraRig:
        cv2.imwrite(str(tmp_path / "board.png"), np.full((12, 16, 3), 3, np.uint8))
        return CameraRig(
            lambda: PictureCamera(tmp_path / "board.png", frames=0),
            lambda: PictureCamera(tmp_path / "none.png"),
            None,
        )


class TestRing(CameraContract):
    @pytest.fixture
    def rig(self) -> Iterator[CameraRig]:
        ring = RingWriter(ring_name("test"), 6, frame_bytes(frame(0)))
        ring.__enter__()
        state = {"open": True, "number": 0}

        class Fed(RingCamera):
            """Each read finds a frame that was written for it."""

            def read(self, timeout: float) -> Frame | None:
                if state["open"]:
                    ring.write_frame(frame(state["number"]))
                    state["number"] += 1
                return super().read(timeout)

        def unplug() -> None:
            ring.__exit__(None, None, None)
            state["open"] = False

        yield CameraRig(lambda: Fed(ring.name), lambda: RingCamera("nobody"), unplug)
        if state["open"]:
            ring.__exit__(None, None, None)
