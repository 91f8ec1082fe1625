"""A camera to look through outside of a game: any one, or that of a twin whose robot has stepped aside."""

import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import chess

from kempelen.app.cameras import open_camera
from kempelen.app.config import TWIN_PORT, Config
from kempelen.app.eye import Frames
from kempelen.app.eyes import TwinFrames
from kempelen.app.table_session import TableSession
from kempelen.core.errors import ConfigError
from kempelen.core.table import start_layout


@asynccontextmanager
async def open_view(config: Config, board: chess.Board, *, patient: bool = False) -> AsyncIterator[Frames]:
    """Frames of the configured camera.

    Args:
        config: Which camera; on a twin also the table.
        board: What the twin's table is laid with.
        patient: Whether a camera that cannot be opened yet is waited for.

    Raises:
        ConfigError: no camera is named, or there is none of that name.
        CameraError: it cannot be opened.
        TwinError: the twin does not start.
    """
    source = config.camera_source
    if not source:
        raise ConfigError("No camera is named.", hint="Name one: --camera uvc:0")
    if source == TWIN_PORT and config.on_twin:
        async with _twin(config, board) as frames:
            yield frames
    else:
        async with open_camera(source, config, patient=patient) as camera:
            yield camera


@asynccontextmanager
async def _twin(config: Config, board: chess.Board) -> AsyncIterator[TwinFrames]:
    """A twin of our own; its robot, which nobody has homed yet, would stand over the board."""
    sensor = config.sensor.model_copy(update={"kind": "camera"})
    quick = config.twin.model_copy(update={"speed": "max"})
    seen = config.model_copy(update={"sensor": sensor, "twin": quick})
    table = seen.build_table()
    with tempfile.TemporaryDirectory(prefix="kempelen-view-") as folder:
        state = Path(folder) / "table.json"
        layout = start_layout(table, board)
        async with TableSession(seen, table, layout, state=state, resume=False) as session:
            await session.hand.prepare()
            await session.hand.park(layout)
            if session.twin is None:
                raise ConfigError("Only a twin of our own has a camera.", hint="Name another camera.")
            yield TwinFrames(session.twin.ring)
