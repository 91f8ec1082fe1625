"""Records until it is told to stop, and shows how far it is."""

import asyncio
from contextlib import suppress
from pathlib import Path

from rich.console import Console

from kempelen.app.cameras import open_camera
from kempelen.app.config import load_config
from kempelen.app.recorder import Recorder
from kempelen.frames.recording import RecordingWriter


def run_record(
    camera: str, out: Path, seconds: float | None, frames: int | None, *, jpeg: bool, config: Path | None
) -> None:
    """From the first frame on, until the time is over, there are frames enough, the camera ends, or Ctrl-C.

    Raises:
        ConfigError: ``camera`` names none.
        CameraError: it cannot be opened or shows nothing, or ``out`` cannot be written.
    """
    console = Console(stderr=True)
    opened = open_camera(camera, load_config(config))
    writer = RecordingWriter(out, "jpg" if jpeg else "png", camera)
    recorder = Recorder(opened, writer, seconds, frames)
    try:
        with console.status(f"Opening {camera} …") as status, suppress(KeyboardInterrupt):
            asyncio.run(recorder.run(lambda progress: status.update(f"{progress}   Ctrl-C ends it.")))
    finally:
        console.print(summary(recorder, out), markup=False, highlight=False, soft_wrap=True)


def summary(recorder: Recorder, out: Path) -> str:
    """What there is now."""
    if not recorder.frames:
        return "Nothing was recorded."
    return f"{out}: {recorder.progress()}. Play it: --camera recording:{out}"
