import asyncio
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from kempelen.app.cameras import open_camera
from kempelen.app.recorder import Recorder
from kempelen.cli.record import record
from kempelen.core.camera import Frame
from kempelen.core.errors import CameraError, ConfigError
from kempelen.frames.host import CameraProcess
from kempelen.frames.recording import Recording, RecordingWriter
from kempelen.testing.cameras import SCRIPTED


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    with RecordingWriter(tmp_path / "clip") as writer:
        for number in range(10):
            writer.write(Frame(number, number / 20, np.full((4, 4, 3), number, np.uint8)))
    return tmp_path / "clip"


def command(*arguments: str) -> str:
    app = typer.Typer()
    app.command()(record)
    outcome = CliRunner().invoke(app, arguments)
    if outcome.exception is not None and not isinstance(outcome.exception, SystemExit):
        raise outcome.exception
    return outcome.stderr


def test_a_recording_of_a_recording(clip: Path, tmp_path: Path) -> None:
    said = command("--camera", f"recording:{clip}", "--out", str(tmp_path / "copy.zip"))
    with Recording(tmp_path / "copy.zip") as copy:
        assert copy.complete
        assert f"{len(copy)} frames" in said
        assert "recording:" in said
        last = copy.frame(len(copy) - 1)
    assert last.sequence == 9
    assert last.colour is not None
    assert (last.colour == 9).all()


def test_so_many_frames(clip: Path, tmp_path: Path) -> None:
    command("--camera", f"recording:{clip}", "--out", str(tmp_path / "copy"), "--frames", "2", "--jpeg")
    with Recording(tmp_path / "copy") as copy:
        assert len(copy) == 2
    assert list((tmp_path / "copy").glob("*.jpg"))


def test_so_long(tmp_path: Path) -> None:
    camera = CameraProcess(SCRIPTED)
    recorder = Recorder(camera, RecordingWriter(tmp_path / "clip"), 0.1, None)
    asyncio.run(recorder.run())
    with Recording(tmp_path / "clip") as recording:
        assert recording.complete
        assert len(recording) > 1


async def test_what_was_recorded_is_kept_when_it_is_interrupted(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "clip.zip")
    recording = asyncio.create_task(Recorder(CameraProcess(SCRIPTED), writer, None, None).run())
    async with asyncio.timeout(20):
        while writer.frames < 3:  # noqa: ASYNC110 - the writer tells nobody
            await asyncio.sleep(0.005)
    recording.cancel()
    with pytest.raises(asyncio.CancelledError):
        await recording
    with Recording(tmp_path / "clip.zip") as kept:
        assert kept.complete
        assert len(kept) >= 3


def test_what_was_recorded_is_kept_when_the_camera_dies(tmp_path: Path) -> None:
    camera = CameraProcess(SCRIPTED, {"fails_at": 20}, restarting=None)
    recorder = Recorder(camera, RecordingWriter(tmp_path / "clip"), None, None)
    with pytest.raises(CameraError, match="unplugged"):
        asyncio.run(recorder.run())
    with Recording(tmp_path / "clip") as kept:
        assert len(kept) >= 1


def test_wrong_words_and_places(clip: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="names no camera"):
        command("--camera", "webcam", "--out", str(tmp_path / "x"))
    with pytest.raises(CameraError, match="exists already"):
        command("--camera", f"recording:{clip}", "--out", str(clip))
    assert not (tmp_path / "x").exists()
    assert open_camera(f"recording:{clip}")
