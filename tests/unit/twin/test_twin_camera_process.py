"""Cameras beside the twin: frames in a ring, settings by the side door, a camera that dies."""

import asyncio
import os
import signal
from pathlib import Path

import chess
import pytest

from kempelen.core.camera import Frame
from kempelen.core.errors import CameraError, TwinError
from kempelen.core.places import Place
from kempelen.core.table import Table, start_layout
from kempelen.frames.ring import RingReader
from kempelen.twin.cameras import CameraSpec
from kempelen.twin.cameras.crew import CameraCrew
from kempelen.twin.cameras.link import patched
from kempelen.twin.client import TwinProcess
from kempelen.twin.spec import TwinSpec

pytestmark = pytest.mark.physics

TABLE = Table()


def spec_in(folder: Path, *cameras: CameraSpec) -> TwinSpec:
    layout = start_layout(TABLE, chess.Board())
    return TwinSpec.of(TABLE, layout, control=folder / "control", cameras=cameras)


async def fresh(reader: RingReader, count: int = 1, after: int = -1) -> Frame:
    """The frame that comes ``count`` frames later."""
    frame = None
    for _ in range(count):
        frame = await asyncio.to_thread(reader.newest, after, 20.0)
        assert frame is not None, "no frame within 20 s"
        after = frame.sequence
    assert frame is not None
    return frame


async def until_dark(reader: RingReader) -> Frame:
    frame = await fresh(reader)
    for _ in range(30):
        if frame.colour is not None and frame.colour.max() < 8:
            return frame
        frame = await fresh(reader, after=frame.sequence)
    raise AssertionError("the lights stay on")


async def test_frames_come_settings_change_and_a_dead_camera_is_replaced(tmp_path: Path) -> None:
    async with TwinProcess(spec_in(tmp_path, CameraSpec(seed=3, colour_scale=0.25))) as twin:
        (state,) = (await twin.control.ask("stats"))["cameras"]
        assert state["alive"]
        assert state["ring"] == twin.ring
        with RingReader(twin.ring) as reader:
            frame = await fresh(reader, 2)
            assert frame.colour is not None
            assert frame.depth is not None
            assert frame.depth_camera is not None
            assert (frame.colour.shape, frame.depth.shape) == ((270, 480, 3), (424, 512))
            assert frame.depth_camera.distorted
            later = await fresh(reader, after=frame.sequence)
            assert later.time > frame.time
            before = frame.colour.copy()
            del frame, later
            x, y, _ = map(float, TABLE.centre(Place("e5")))
            await twin.control.ask("supply", kind="Q", white=True, to=[x, y])
            with_queen = (await fresh(reader, 3)).colour
            assert with_queen is not None
            assert (abs(with_queen.astype(int) - before) > 60).sum() > 20
            del with_queen
            await twin.control.ask("camera", change={"lighting": {"on": False}})
            await until_dark(reader)
            with pytest.raises(TwinError, match="noise.axial cannot be -1"):
                await twin.control.ask("camera", change={"noise": {"axial": -1}})
            with pytest.raises(TwinError, match="no camera 2"):
                await twin.control.ask("camera", camera=2, change={})
            os.kill(state["pid"], signal.SIGKILL)
            with pytest.raises(CameraError, match="has ended"):
                await fresh(reader, after=1_000_000)
        await twin.control.ask("restart_camera")
        with RingReader(twin.ring, patience=10.0) as reader:
            await until_dark(reader)  # with its last settings


def test_a_camera_that_cannot_draw_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "disabled")
    crew = CameraCrew([CameraSpec(backend="gl", colour_scale=0.1)], spec_in(tmp_path).model_dump_json())
    with pytest.raises(TwinError, match="did not start: .*OpenGL does not work here"):
        crew.wait()
    assert not crew.state()[0]["alive"]


def test_a_twin_without_cameras_has_no_ring(tmp_path: Path) -> None:
    with pytest.raises(TwinError, match="has no camera"):
        _ = TwinProcess(spec_in(tmp_path)).ring


def test_specs_that_make_no_sense_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no camera model 'kinect9'.*kinect2"):
        CameraSpec(model="kinect9")
    with pytest.raises(ValueError, match="same ring: eye, eye"):
        spec_in(tmp_path, CameraSpec(ring="eye"), CameraSpec(ring="eye"))
    with pytest.raises(TwinError, match="model cannot be changed"):
        patched(CameraSpec(), {"model": "d435"})
    changed = patched(CameraSpec(), {"lighting": {"exposure": 2.0}})
    assert changed.lighting.exposure == 2.0
    assert changed.noise == CameraSpec().noise
