"""What every camera driver must do, whatever is behind it.

Subclass ``CameraContract`` and give it a fixture ``rig``.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import pytest

from kempelen.core.camera import Camera, Frame
from kempelen.core.errors import CameraError
from kempelen.frames.layout import require_frame

_WAIT = 2.0
_READS = 60


@dataclass(frozen=True)
class CameraRig:
    """A driver with something to drive.

    Attributes:
        camera: Makes a driver, not entered, for something that shows four frames or more.
        absent: Makes one for something that is not there.
        unplug: Takes away what the present driver drives; None where that cannot happen.
    """

    camera: Callable[[], Camera]
    absent: Callable[[], Camera] | None
    unplug: Callable[[], None] | None


def some_frames(camera: Camera, count: int) -> list[Frame]:
    """The next frames of a camera that is open."""
    frames: list[Frame] = []
    for _ in range(_READS):
        if (frame := camera.read(_WAIT)) is not None:
            frames.append(frame)
        if len(frames) == count:
            return frames
    raise AssertionError(f"{camera.name} showed {len(frames)} of {count} frames")


class CameraContract:
    """The suite."""

    def test_it_can_be_named_before_it_is_opened(self, rig: CameraRig) -> None:
        assert rig.camera().name.isprintable()

    def test_frames_are_what_a_frame_is(self, rig: CameraRig) -> None:
        with rig.camera() as camera:
            for frame in some_frames(camera, 3):
                require_frame(frame)
                for array in (frame.colour, frame.depth):
                    assert array is None or not array.flags.writeable

    def test_sequences_rise_and_times_do_not_fall(self, rig: CameraRig) -> None:
        with rig.camera() as camera:
            frames = some_frames(camera, 4)
        assert all(a.sequence < b.sequence for a, b in pairwise(frames))
        assert all(a.time <= b.time for a, b in pairwise(frames))
        assert all(0 <= a.dropped <= b.dropped for a, b in pairwise(frames))

    def test_intrinsics_are_of_the_picture(self, rig: CameraRig) -> None:
        with rig.camera() as camera:
            (frame,) = some_frames(camera, 1)
        for array, optics in ((frame.colour, frame.colour_camera), (frame.depth, frame.depth_camera)):
            if array is not None and optics is not None:
                assert array.shape[:2] == (optics.height, optics.width)
        assert frame.depth is None or frame.depth_camera is not None or frame.colour_camera is None

    def test_a_frame_does_not_change_when_the_next_one_comes(self, rig: CameraRig) -> None:
        with rig.camera() as camera:
            (first,) = some_frames(camera, 1)
            array = first.colour if first.colour is not None else first.depth
            assert array is not None
            before = array.copy()
            some_frames(camera, 2)
            assert (array == before).all()

    def test_it_tells_its_settings_as_plain_data(self, rig: CameraRig) -> None:
        with rig.camera() as camera:
            some_frames(camera, 1)
            assert json.dumps(getattr(camera, "settings", {}))

    def test_it_can_be_opened_again(self, rig: CameraRig) -> None:
        camera = rig.camera()
        for _ in range(2):
            with camera:
                some_frames(camera, 2)

    def test_it_is_closed_when_its_user_fails(self, rig: CameraRig) -> None:
        camera = rig.camera()
        with pytest.raises(ZeroDivisionError), camera:
            _fail(camera)
        with camera:
            some_frames(camera, 1)

    def test_what_is_not_there_is_said_in_words(self, rig: CameraRig) -> None:
        if rig.absent is None:
            pytest.skip("it is always there")
        absent = rig.absent()
        with pytest.raises(CameraError) as caught, absent:
            pass
        assert caught.value.message.endswith(".")
        assert caught.value.hint

    def test_what_goes_away_is_an_error_and_not_silence(self, rig: CameraRig) -> None:
        if rig.unplug is None:
            pytest.skip("it cannot go away")
        with rig.camera() as camera:
            some_frames(camera, 1)
            rig.unplug()
            with pytest.raises(CameraError) as caught:
                _read_on(camera)
        assert caught.value.hint


def _read_on(camera: Camera) -> None:
    for _ in range(_READS):
        camera.read(0.05)


def _fail(camera: Camera) -> None:
    some_frames(camera, 1)
    raise ZeroDivisionError
