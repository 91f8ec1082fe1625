from pathlib import Path

import chess
import numpy as np
import pytest

from kempelen.app.cameras import CameraSource, camera_kinds, open_camera, parse_camera, twin_camera
from kempelen.app.config import load_config
from kempelen.core.camera import Frame
from kempelen.core.errors import CameraError, ConfigError
from kempelen.core.senses import Observation, Sight
from kempelen.frames.condition import CameraState
from kempelen.frames.recording import RecordingWriter
from kempelen.frames.ring import RingWriter, ring_name
from kempelen.sensing.cameras.uvc import UvcCamera
from kempelen.sensing.tracker import Tracker, TrackerSettings


@pytest.mark.parametrize(
    ("spec", "kind", "options"),
    [
        ("twin", "twin", {}),
        ("twin:d435", "twin", {"model": "d435"}),
        ("uvc", "uvc", {}),
        ("uvc:2", "uvc", {"device": 2}),
        ("uvc:0,fps=15,fourcc=YUYV", "uvc", {"device": 0, "fps": 15.0, "fourcc": "YUYV"}),
        ("uvc,width=640", "uvc", {"width": 640}),
        ("/dev/video4", "uvc", {"device": 4}),
        ("/dev/video4,height=480", "uvc", {"device": 4, "height": 480}),
        ("realsense", "realsense", {}),
        ("realsense:0123", "realsense", {"serial": "0123"}),
        ("kinect2", "kinect2", {}),
        ("azure:1", "azure", {"device": 1}),
        ("recording:a b,c.zip,loop", "recording", {"path": "a b,c.zip", "loop": True}),
        ("recording:x,speed=0,loop=false", "recording", {"path": "x", "speed": 0.0, "loop": False}),
        ("picture:b.png,depth=d.png", "picture", {"path": "b.png", "depth": "d.png"}),
        ("picture:C:odd,name.png", "picture", {"path": "C:odd,name.png"}),
        ("ring:kempelen-1", "ring", {"ring": "kempelen-1"}),
    ],
)  # fmt: skip
def test_what_is_typed(spec: str, kind: str, options: dict[str, object]) -> None:
    source = parse_camera(spec)
    assert (source.kind, source.options) == (kind, options)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("", "names no camera"),
        ("webcam", "names no camera"),
        ("/dev/ttyUSB0", "names no camera"),
        ("recording", "needs a path"),
        ("recording:", "needs a path"),
        ("ring:", "needs a ring"),
        ("kinect2:5", "has no '5'"),
        ("uvc:front", "device is a number, not 'front'"),
        ("uvc:-1", "device cannot be -1"),
        ("uvc:0,fps=nan", "fps cannot be nan"),
        ("uvc,exposure=3", "has no option 'exposure'"),
        ("recording:x,loop=maybe", "loop is true or false, not 'maybe'"),
    ],
)
def test_what_cannot_be(spec: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        parse_camera(spec)
    assert caught.value.hint


def test_drivers_are_found_by_their_entry_points() -> None:
    assert set(camera_kinds()) >= {
        "azure", "kinect2", "picture", "realsense", "recording", "ring", "twin", "uvc"
    }  # fmt: skip
    assert isinstance(parse_camera("uvc:1").driver(), UvcCamera)
    assert parse_camera("uvc").factory == "kempelen.sensing.cameras.uvc:UvcCamera"
    with pytest.raises(ConfigError, match="cannot be"):
        CameraSource("uvc", "uvc", {"colour": 1}).driver()
    with pytest.raises(ConfigError, match="no camera of kind"):
        _ = CameraSource("x", "x", {}).factory
    with pytest.raises(ConfigError, match="no camera of model"):
        open_camera("twin:kinect9")


async def test_a_recording_opens_in_a_process_of_its_own(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "clip.zip") as writer:
        for number in range(3):
            writer.write(Frame(number, number / 1000, np.full((4, 4, 3), number, np.uint8)))
    async with open_camera(f"recording:{tmp_path / 'clip.zip'}") as camera:
        frame = await camera.newest(1, within=20)
        assert frame is not None
        assert frame.sequence == 2
        assert camera.ring
    with pytest.raises(CameraError, match="No such file"):
        async with open_camera(f"recording:{tmp_path / 'none.zip'}"):
            pass


async def test_a_ring_is_attached_to() -> None:
    with RingWriter(ring_name("spec"), 3, 1000) as ring:
        async with open_camera(f"ring:{ring.name}") as camera:
            assert camera.status.state is CameraState.RUNNING
            assert camera.ring == ring.name


@pytest.mark.parametrize(
    ("settings", "model"),
    [
        ({}, "kinect2"),
        ({"camera.source": "twin:d435"}, "d435"),
        ({"camera.source": "uvc:0"}, None),
        ({"robot.port": "/dev/ttyUSB0", "camera.source": "twin:d435"}, None),
    ],
)
def test_the_camera_over_a_games_own_twin(settings: dict[str, object], model: str | None) -> None:
    """Its model is what was typed; a camera beside another twin would see another game."""
    spec = twin_camera(load_config(None, settings))
    assert (spec and spec.model) == model


@pytest.mark.physics
async def test_the_twins_robot_does_not_stand_over_the_board() -> None:
    tracker = Tracker(TrackerSettings())
    tracker.expect(chess.Board())
    last, seen = -1, Observation.blind(0.0, Sight.STARTING, "")
    async with open_camera("twin", load_config(None, {"robot.port": "/dev/null"})) as camera:
        while seen.sight is Sight.STARTING:
            frame = await camera.newest(last, within=60)
            assert frame is not None
            last, seen = frame.sequence, tracker.update(frame)
    assert seen.sight is Sight.CLEAR, seen.message
