import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from kempelen.core.camera import Camera, Frame, Intrinsics
from kempelen.core.errors import CameraError
from kempelen.sensing.cameras import uvc
from kempelen.sensing.cameras.azure import AzureKinectCamera
from kempelen.sensing.cameras.counting import Counter, PeriodCounter
from kempelen.sensing.cameras.kinect2 import Kinect2Camera, mirrored
from kempelen.sensing.cameras.lenses import fitted, inverse, rational
from kempelen.sensing.cameras.picture import PictureCamera
from kempelen.sensing.cameras.realsense import RealSenseCamera
from kempelen.testing import camera_libraries as libraries


def first(camera: Camera) -> Frame:
    frame = camera.read(2.0)
    assert frame is not None
    return frame


@pytest.mark.parametrize(
    ("camera", "line"),
    [
        (RealSenseCamera(), "pip install 'kempelen[realsense]'"),
        (Kinect2Camera(), "pip install 'kempelen[kinect2]'"),
        (AzureKinectCamera(), "pip install 'kempelen[azure-kinect]'"),
    ],
)
@pytest.mark.parametrize("broken", [False, True])
def test_a_missing_library_is_told_with_the_line_that_installs_it(
    camera: Camera, line: str, broken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def without(name: str) -> None:
        if broken:
            raise ImportError("libusb-1.0.so.0: cannot open shared object file")
        raise ModuleNotFoundError(f"No module named '{name}'", name=name)

    monkeypatch.setattr("kempelen.sensing.cameras.libraries.importlib.import_module", without)
    with pytest.raises(CameraError, match="libusb" if broken else "is not installed") as caught, camera:
        pass
    assert line in caught.value.hint


class TestWebcam:
    @pytest.fixture
    def bench(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> libraries.Bench:
        bench = libraries.Bench()
        (tmp_path / "dev").mkdir()
        (tmp_path / "dev" / "video0").touch()
        monkeypatch.setattr(uvc, "DEVICES", tmp_path / "dev")
        monkeypatch.setattr(uvc, "CLASSES", tmp_path / "class")
        monkeypatch.setattr(cv2, "VideoCapture", libraries.video_capture(bench))
        return bench

    def test_the_format_comes_before_the_size(self, bench: libraries.Bench) -> None:
        with uvc.UvcCamera(width=640, height=480, fps=15) as camera:
            assert camera.settings == {"width": 640, "height": 480, "fps": 15.0, "fourcc": "MJPG"}
        order = [
            cv2.CAP_PROP_FOURCC, cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT, cv2.CAP_PROP_FPS
        ]  # fmt: skip
        assert bench.calls == ["open 0", *(f"set {each}" for each in order), "release"]

    def test_no_picture_in_time(self, bench: libraries.Bench) -> None:
        with uvc.UvcCamera() as camera:
            bench.silent = True
            assert camera.read(0.01) is None

    def test_what_is_there_instead_is_listed(self, bench: libraries.Bench, tmp_path: Path) -> None:
        for name, index in (("video0", "0"), ("video1", "1"), ("video4", "0")):
            (tmp_path / "dev" / name).touch()
            (tmp_path / "class" / name).mkdir(parents=True)
            (tmp_path / "class" / name / "index").write_text(f"{index}\n")
            (tmp_path / "class" / name / "name").write_text(f"Cam {name}\n")
        assert uvc.list_devices() == {0: "Cam video0", 4: "Cam video4"}
        with pytest.raises(CameraError, match="There is no webcam /dev/video7") as caught, uvc.UvcCamera(7):
            pass
        assert "uvc:0 (Cam video0), uvc:4 (Cam video4)" in caught.value.hint
        assert bench.calls == []

    def test_one_in_use(self, bench: libraries.Bench) -> None:
        bench.present = False
        with pytest.raises(CameraError, match="in use"), uvc.UvcCamera():
            pass

    def test_one_that_is_forbidden(self, bench: libraries.Bench, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(os, "access", lambda *_: False)
        with pytest.raises(CameraError, match="may not open") as caught, uvc.UvcCamera():
            pass
        assert "usermod -aG video" in caught.value.hint
        assert bench.calls == []

    def test_a_grey_camera(self, bench: libraries.Bench, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(cv2, "VideoCapture", libraries.video_capture(bench, (12, 16)))
        with uvc.UvcCamera() as camera, pytest.raises(CameraError, match="not colour pictures"):
            camera.read(1.0)

    @pytest.mark.parametrize(("width", "height", "fits"), [(16, 12, True), (32, 24, True), (32, 30, False)])
    def test_a_calibration_of_another_size(
        self, bench: libraries.Bench, width: int, height: int, fits: bool
    ) -> None:
        numbers: Mapping[str, Any] = {
            "width": width, "height": height, "fx": 40.0, "fy": 40.0, "cx": 15.5, "cy": 11.5
        }  # fmt: skip
        with uvc.UvcCamera(intrinsics=numbers) as camera:
            optics = first(camera).colour_camera
        assert (optics is not None) == fits
        assert optics is None or (optics.width, optics.height, optics.fx) == (16, 12, 40.0 * 16 / width)
        assert bench.frame == 1


class TestRealSense:
    @pytest.fixture
    def bench(self, monkeypatch: pytest.MonkeyPatch) -> libraries.Bench:
        bench = libraries.Bench()
        monkeypatch.setitem(sys.modules, "pyrealsense2", libraries.pyrealsense2(bench))
        return bench

    def test_units_registration_and_times(self, bench: libraries.Bench) -> None:
        with RealSenseCamera("0123", colour=(32, 24), depth=(16, 12)) as camera:
            frame = first(camera)
            assert camera.name == "Intel RealSense D435"
        assert bench.options["serial"] == "0123"
        assert bench.options["color"] == (32, 24, "bgr8", 30)
        assert bench.options["depth"] == (16, 12, "z16", 30)
        assert frame.depth is not None
        assert np.allclose(frame.depth, 801.0)  # 8010 steps of 0.1 mm
        assert frame.colour_from_depth.yaw == pytest.approx(np.pi / 6)
        assert frame.colour_from_depth.translation.tolist() == [15.0, 0.0, 1.0]
        assert frame.skew == pytest.approx(0.004)

    def test_lost_frames_are_counted(self, bench: libraries.Bench) -> None:
        bench.numbers = [5, 6, 9, 2, 3]  # three lost, then the device was reset
        with RealSenseCamera(colour=(32, 24), depth=(16, 12)) as camera:
            frames = [first(camera) for _ in range(5)]
        assert [frame.sequence for frame in frames] == [0, 1, 4, 5, 6]
        assert [frame.dropped for frame in frames] == [0, 0, 2, 2, 2]

    def test_a_mode_that_it_has_not(self, bench: libraries.Bench) -> None:
        with pytest.raises(CameraError, match="at 90 frames/s: Couldn't resolve"), RealSenseCamera(fps=90):
            pass
        assert bench.calls == ["start"]

    def test_another_serial_number(self, bench: libraries.Bench) -> None:
        with pytest.raises(CameraError, match="serial number 77") as caught, RealSenseCamera("77"):
            pass
        assert "Connected: 0123" in caught.value.hint
        assert bench.calls == []

    def test_a_bent_lens_described_the_other_way_round(self, monkeypatch: pytest.MonkeyPatch) -> None:
        coefficients = (-0.055, 0.066, 0.001, -0.0005, -0.02)
        fake = libraries.pyrealsense2(libraries.Bench(), coefficients)
        monkeypatch.setitem(sys.modules, "pyrealsense2", fake)
        with RealSenseCamera(colour=(1280, 720), depth=(16, 12)) as camera:
            optics = first(camera).colour_camera
        assert optics is not None
        bent = np.array([[-0.9, -0.5], [0.0, 0.0], [0.7, -0.3]])
        ideal = rational(np.array([*coefficients, 0, 0, 0]))(bent)
        pixels = optics.project(np.column_stack([ideal, np.ones(3)]))
        assert np.abs(pixels - (bent * (600, 601) + (640, 360))).max() < 0.3


class TestAzure:
    def test_one_pair(self, monkeypatch: pytest.MonkeyPatch) -> None:
        bench = libraries.Bench()
        monkeypatch.setitem(sys.modules, "pyk4a", libraries.pyk4a(bench))
        with AzureKinectCamera(1) as camera:
            frame = first(camera)
            bench.silent = True
            assert camera.read(0.01) is None
            assert camera.settings["depth_lens_fit_px"] < 0.1
        assert bench.options["device_id"] == 1
        assert bench.options["synchronized_images_only"]
        assert frame.colour is not None
        assert frame.colour.shape == (1080, 1920, 3)
        assert (frame.colour[300:800, 300:1600] == 10).all()
        assert frame.colour_camera is not None
        assert not frame.colour_camera.distorted
        assert frame.depth is not None
        assert (frame.depth == 710).all()
        assert frame.colour_from_depth.translation.tolist() == [-32.0, -2.0, 4.0]
        assert frame.colour_from_depth.tilt == pytest.approx(0.1)
        assert frame.skew == pytest.approx(-160e-6)


class TestKinect2:
    @pytest.fixture
    def bench(self, monkeypatch: pytest.MonkeyPatch) -> libraries.Bench:
        bench = libraries.Bench()
        monkeypatch.setitem(sys.modules, "freenect2", libraries.freenect2(bench))
        return bench

    def test_pictures_are_turned_back_and_what_is_no_number_is_nothing(self, bench: libraries.Bench) -> None:
        with Kinect2Camera() as camera:
            frame = first(camera)
        assert frame.colour is not None
        assert frame.depth is not None
        assert frame.colour[0, -1].tolist() == [10, 1, 2]
        assert frame.colour[0, 0].tolist() == [0, 0, 0]
        assert frame.depth[0, -3:].tolist() == [0, 0, 0]
        assert (frame.depth[1:] == 910).all()
        assert bench.calls == ["start", "stop", "close"]
        assert frame.skew == pytest.approx(-8 * 1.25e-4)

    def test_registration_is_that_of_the_device(self, bench: libraries.Bench) -> None:
        with Kinect2Camera() as camera:
            frame = first(camera)
            assert camera.settings["registration_fit_px"] < 0.01
        assert np.allclose(frame.colour_from_depth.rotation, np.eye(3), atol=1e-6)
        assert np.allclose(frame.colour_from_depth.translation, [-libraries.COLOUR_SHIFT, 0, 0])
        assert frame.depth_camera is not None
        assert frame.depth_camera.cx == 511 - 255.0
        assert bench.frame == 1

    def test_a_mirrored_camera_sees_the_mirror_image(self) -> None:
        camera = Intrinsics(512, 424, 365.0, 366.0, 255.0, 205.0, (0.09, -0.27, 0.01, 0.02, 0.09))
        points = np.array([[100.0, 50.0, 900.0], [-300.0, 120.0, 1100.0]])
        seen = camera.project(points)
        turned = mirrored(camera).project(points * (-1, 1, 1))
        assert np.allclose(turned, np.column_stack([511 - seen[:, 0], seen[:, 1]]))
        assert mirrored(mirrored(camera)) == camera

    def test_no_frame_in_time(self, bench: libraries.Bench) -> None:
        with Kinect2Camera() as camera:
            bench.silent = True
            assert camera.read(0.01) is None
            assert camera.read(0.0) is None


class TestPicture:
    def test_colour_and_depth(self, tmp_path: Path) -> None:
        cv2.imwrite(str(tmp_path / "c.png"), np.full((4, 6, 3), (1, 2, 3), np.uint8))
        cv2.imwrite(str(tmp_path / "d.png"), np.full((4, 6), 1234, np.uint16))
        optics = {"width": 6, "height": 4, "fx": 5.0, "fy": 5.0, "cx": 2.5, "cy": 1.5}
        with PictureCamera(tmp_path / "c.png", depth=tmp_path / "d.png", intrinsics=optics) as camera:
            frame = first(camera)
            with pytest.raises(EOFError):
                camera.read(1.0)
        assert frame.colour is not None
        assert frame.depth is not None
        assert frame.colour[0, 0].tolist() == [1, 2, 3]
        assert (frame.depth == 1234.0).all()
        assert frame.depth_camera == frame.colour_camera == Intrinsics(6, 4, 5.0, 5.0, 2.5, 1.5)

    @pytest.mark.parametrize(
        ("depth", "message"),
        [
            (np.zeros((4, 6), np.uint8), "uint8"),
            (np.zeros((4, 6, 3), np.uint16), "one channel"),
            (np.zeros((5, 6), np.uint16), "6 x 5 px, but"),
        ],
    )
    def test_depth_that_is_none(self, tmp_path: Path, depth: Any, message: str) -> None:
        cv2.imwrite(str(tmp_path / "c.png"), np.zeros((4, 6, 3), np.uint8))
        cv2.imwrite(str(tmp_path / "d.png"), depth)
        with (
            pytest.raises(CameraError, match=message),
            PictureCamera(tmp_path / "c.png", depth=tmp_path / "d.png"),
        ):
            pass

    @pytest.mark.parametrize("content", [b"", b"no picture", b"\x89PNG\r\n\x1a\n"])
    def test_files_that_are_no_pictures(self, tmp_path: Path, content: bytes) -> None:
        (tmp_path / "c.png").write_bytes(content)
        with pytest.raises(CameraError, match=r"c\.png"), PictureCamera(tmp_path / "c.png"):
            pass

    def test_intrinsics_of_another_picture(self, tmp_path: Path) -> None:
        cv2.imwrite(str(tmp_path / "c.png"), np.zeros((4, 6, 3), np.uint8))
        optics = {"width": 60, "height": 40, "fx": 5.0, "fy": 5.0, "cx": 2.5, "cy": 1.5}
        with (
            pytest.raises(CameraError, match="60 x 40 px, but"),
            PictureCamera(tmp_path / "c.png", intrinsics=optics),
        ):
            pass


class TestLenses:
    def test_a_polynomial_is_its_own_fit(self) -> None:
        coefficients = (0.09, -0.27, 0.001, -0.002, 0.095)
        camera = Intrinsics(512, 424, 365.0, 365.0, 255.0, 205.0)
        found, off = fitted(rational(np.array([*coefficients, 0, 0, 0])), camera)
        assert np.allclose(found.distortion, coefficients)
        assert off < 1e-9

    def test_there_and_back(self) -> None:
        bend = rational(np.array([0.05, -0.06, 0.001, 0.0005, 0.02, 0, 0, 0]))
        ideal = np.array([[0.4, -0.3], [-0.6, 0.2]])
        assert np.allclose(inverse(bend)(bend(ideal)), ideal)


class TestCounting:
    def test_numbers(self) -> None:
        counter = Counter()
        assert [counter.count(number) for number in (100, 101, 104, 104, 0, 1)] == [0, 1, 4, 5, 6, 7]
        assert counter.dropped == 2

    def test_times_of_a_camera_that_slows_down(self) -> None:
        counter = PeriodCounter()
        times = [number / 30 for number in range(30)]
        times += [times[-1] + (number + 1) / 15 for number in range(60)]
        for time in times:
            counter.count(time)
        settled = counter.dropped
        assert settled <= 8  # until the longer intervals are the usual ones
        counter.count(times[-1] + 3 / 15)
        assert counter.dropped == settled + 2
