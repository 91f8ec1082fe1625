"""Shows what the reed board feels."""

import asyncio
import sys
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import chess
from rich.console import Console
from rich.live import Live

from kempelen.app.config import Config
from kempelen.app.reed import reed_port
from kempelen.app.table_session import calibrated_table
from kempelen.core.table import start_layout
from kempelen.game.fen import parse_fen
from kempelen.robots.transport import open_port
from kempelen.sensing.reed.sensor import ReedSensor
from kempelen.twin.client import TwinProcess
from kempelen.twin.spec import CONTROL_FOLDER, TwinSpec

_CLOSED, _OPEN, _DOUBTFUL, _OUT = "●", "·", "?", "x"


def see_reed(config: Config, fen: str | None, *, once: bool) -> None:
    """Until Ctrl-C, or once.

    Raises:
        KempelenError: the board does not answer.
    """
    board = parse_fen(fen) if fen is not None else chess.Board()
    asyncio.run(_look(config, board, once=once))


async def _look(config: Config, board: chess.Board, *, once: bool) -> None:
    async with (
        _port(config, board) as port,
        ReedSensor(port, lambda: open_port(port), board) as sensor,
    ):
        if once or not (sys.stdout.isatty() and sys.stdin.isatty()):
            async for seen in sensor.observe():
                if seen.valid:
                    break
            Console().print(shown(sensor), markup=False, highlight=False)
            return
        with Live(console=Console(), auto_refresh=False) as live:
            async for _ in sensor.observe():
                live.update(shown(sensor), refresh=True)


@asynccontextmanager
async def _port(config: Config, board: chess.Board) -> AsyncIterator[str]:
    """Where the board is; on the twin, one of a table of its own."""
    if not config.on_twin or config.sensor.port:
        yield await reed_port(config, None)
        return
    table = calibrated_table(config)
    with tempfile.TemporaryDirectory(prefix=CONTROL_FOLDER) as folder:
        spec = TwinSpec.of(
            table, start_layout(table, board), control=Path(folder) / "control", reed=config.twin.reed
        )
        async with TwinProcess(spec) as twin:
            yield twin.reed


def shown(sensor: ReedSensor) -> str:
    """Board, what it says of itself, and what is wrong with it."""
    reading, hello = sensor.reading, sensor.board.hello
    left_out = reading.faults.left_out
    rows = []
    for rank in range(7, -1, -1):
        squares = (chess.square(file, rank) for file in range(8))
        signs = (_sign(square, reading.closed, reading.doubtful, left_out) for square in squares)
        rows.append(f"{rank + 1}  {' '.join(signs)}")
    said = sensor.latest.message or "Everything at rest."
    itself = (
        f"Board {hello.identity}, wiring: {hello.wiring}, firmware {hello.firmware}; "
        f"{sensor.board.damaged} lines damaged, {reading.lost} times lines were lost."
    )
    return "\n".join(
        [
            *rows,
            "   a b c d e f g h",
            f"{_CLOSED} closed  {_OPEN} open  {_DOUBTFUL} may be feigned  {_OUT} left out",
            itself,
            said,
            *(fault.sentence for fault in reading.faults.named),
        ]
    )


def _sign(square: int, closed: int, doubtful: int, left_out: int) -> str:
    if left_out >> square & 1:
        return _OUT
    if doubtful >> square & 1:
        return _DOUBTFUL
    return _CLOSED if closed >> square & 1 else _OPEN
