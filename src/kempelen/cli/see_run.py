"""Shows what the camera sees, in the terminal or in a file; reads positions from pictures."""

import asyncio
import sys
from collections.abc import Mapping
from pathlib import Path

import chess
import cv2
import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from kempelen.app.cameras import open_view
from kempelen.app.config import Config
from kempelen.app.eye import Eye, EyeSettings
from kempelen.app.still import StillRead, load_still, read_still
from kempelen.cli.halfblocks import terminal_picture
from kempelen.cli.plain import END_OF_INPUT, typed_lines
from kempelen.cli.showing import require_writable
from kempelen.cli.telling import assignment, told
from kempelen.core.camera import Picture
from kempelen.core.errors import ConfigError, KempelenError
from kempelen.core.senses import Sight
from kempelen.game.fen import parse_fen
from kempelen.sensing.board.orientation import Side

_REFRESH_S = 0.4
_TEXT_ROWS = 12
_NOT_YET = frozenset({Sight.STARTING})
_DOUBTFUL = 0.9
_LEAVING = frozenset({"q", "quit", "exit", END_OF_INPUT})


def numbers(overrides: list[str]) -> dict[str, float]:
    """``name=value`` each.

    Raises:
        ConfigError: one is not.
    """
    out = {}
    for text in overrides:
        name, value = assignment(text)
        if value is None:
            raise ConfigError(f"'{text}' sets nothing.", hint="Write --set NAME=NUMBER.")
        out[name] = value
    return out


# --- one picture ---


def see_image(image: Path, depth: Path | None, white: str | None, png: Path | None) -> None:
    """Print the position in a picture.

    Raises:
        CameraError: a file cannot be read.
        BoardNotFoundError: there is no whole board in it.
    """
    if png is not None:
        require_writable(png)
    frame = load_still(str(image), None if depth is None else str(depth))
    read = read_still(frame, Side(white) if white else None)
    console = Console()
    console.print(_squares(read))
    for line in _summary(read):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    if png is not None and frame.colour is not None:
        _, data = cv2.imencode(".png", outlined(frame.colour, read))
        _keep(png, data.tobytes())


def _summary(read: StillRead) -> list[str]:
    found, position = read.sighting, read.placement
    method = (
        f"{found.method}, residual {found.residual:.3f} squares, confidence {100 * found.confidence:.0f} %"
    )
    out = [
        f"FEN: {position.board.board_fen()}",
        f"All of it right with {100 * position.whole:.0f} %, its direction with {100 * read.oriented:.0f} %.",
        f"Board found by {method}{', pieces by colour and depth' if read.depth else ''}.",
        *([read.note] if read.note else []),
        *position.findings,
    ]
    if read.oriented < _DOUBTFUL:
        out.append("Which side is White's is not certain: say it with --white bottom|top|left|right.")
    return out


def _squares(read: StillRead) -> Table:
    """The board, each doubtful square with its confidence."""
    table = Table(show_header=False, show_lines=True)
    for rank in range(7, -1, -1):
        row = [str(rank + 1)]
        for file in range(8):
            square = chess.square(file, rank)
            piece = read.placement.board.piece_at(square)
            sure = float(read.placement.confidence[square])
            sign = piece.symbol() if piece else "·"
            row.append(sign if sure >= _DOUBTFUL else f"{sign} {100 * sure:.0f}%")
        table.add_row(*row)
    table.add_row("", *"abcdefgh")
    return table


def outlined(picture: Picture, read: StillRead) -> Picture:
    """The picture with the board's outline and the pieces' letters."""
    canvas = np.ascontiguousarray(picture).copy()
    corners = np.round(read.sighting.corners).astype(np.int32)
    thick = max(1, canvas.shape[0] // 400)
    cv2.polylines(canvas, [corners.reshape(-1, 1, 2)], isClosed=True, color=(80, 200, 80), thickness=thick)
    for square, piece in read.placement.board.piece_map().items():
        x, y = chess.square_file(square) + 0.5, chess.square_rank(square) + 0.5
        column, row = np.round(read.sighting.pixels([[x, y]])[0]).astype(int).tolist()
        size = canvas.shape[0] / 900
        cv2.putText(
            canvas, piece.symbol(), (column, row), cv2.FONT_HERSHEY_SIMPLEX, size, (60, 60, 230), 2 * thick
        )
    return canvas


def _keep(path: Path, png: bytes) -> None:
    path.write_bytes(png)
    Console().print(f"View: {path.absolute()}", markup=False, highlight=False, soft_wrap=True)


# --- a camera ---


def see_camera(
    config: Config, fen: str | None, png: Path | None, overrides: Mapping[str, float], *, once: bool
) -> None:
    """Until q, or once.

    Raises:
        ConfigError: there is no camera.
        KempelenError: it cannot be opened.
    """
    if png is not None:
        require_writable(png)
    board = parse_fen(fen) if fen is not None else chess.Board()
    sensor = config.sensor
    settings = EyeSettings(sensor.method, {**sensor.parameters, **overrides})
    asyncio.run(_look(config, settings, board, png, once=once))


async def _look(
    config: Config, settings: EyeSettings, board: chess.Board, png: Path | None, *, once: bool
) -> None:
    async with open_view(config, board, patient=True) as frames, Eye(frames, settings) as eye:
        eye.expect(board)
        await _settled(eye)
        if png is not None:
            _keep(png, await eye.picture())
        if png is None and not once and sys.stdout.isatty() and sys.stdin.isatty():
            await _live(eye)
        else:
            await _show_once(eye, picture=png is None)


async def _settled(eye: Eye) -> None:
    """Until it is known what is to be seen."""
    async for seen in eye.observe():
        if seen.sight not in _NOT_YET:
            return


async def _show_once(eye: Eye, *, picture: bool) -> None:
    console = Console()
    if picture and not console.is_dumb_terminal and sys.stdout.isatty():
        console.print(terminal_picture(_decoded(await eye.picture()), console.width, console.height - 4))
    console.print(told(eye.latest), markup=False, highlight=False, soft_wrap=True)
    console.print(_parameters(await eye.parameters()))


async def _live(eye: Eye) -> None:
    """The view as it changes; typed lines override parameters."""
    console = Console()
    typing = asyncio.ensure_future(_obey(eye, console))
    try:
        with Live(console=console, auto_refresh=False, screen=True) as live:
            while not typing.done():
                live.update(await _screen(eye, console), refresh=True)
                await asyncio.wait({typing}, timeout=_REFRESH_S)
        typing.result()
    finally:
        typing.cancel()
        await asyncio.gather(typing, return_exceptions=True)


async def _screen(eye: Eye, console: Console) -> Group:
    rows = max(console.height - _TEXT_ROWS, 8)
    said = Text(told(eye.latest))
    try:
        picture = terminal_picture(_decoded(await eye.picture()), console.width, rows)
        numbers_now = await eye.parameters()
    except KempelenError as error:
        return Group(said, Text(str(error)))
    return Group(picture, said, Text(_in_columns(numbers_now, console.width)))


async def _obey(eye: Eye, console: Console) -> None:
    async for line in typed_lines():
        if line in _LEAVING:
            return
        try:
            if line:
                await eye.set(*assignment(line))
        except KempelenError as error:
            console.bell()
            console.print(str(error), markup=False)


def _decoded(png: bytes) -> Picture:
    return np.asarray(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR), np.uint8)


def _parameters(parameters: list[dict[str, object]]) -> Table:
    table = Table(title="Parameters")
    for name in ("name", "value", "unit", "range", "from", "what it does"):
        table.add_column(name, justify="right" if name in {"value", "range"} else "left")
    for p in parameters:
        source = "set by hand" if p["overridden"] else str(p["source"])
        table.add_row(
            str(p["name"]), f"{p['value']:.4g}", str(p["unit"]), f"{p['low']:g} to {p['high']:g}", source,
            str(p["about"]),
        )  # fmt: skip
    return table


def _in_columns(parameters: list[dict[str, object]], width: int) -> str:
    """As many on a line as fit."""
    cells = [f"{p['name']}={p['value']:.3g}{'*' if p['overridden'] else ''}" for p in parameters]
    side = max(map(len, cells), default=1) + 2
    each = max(1, width // side)
    lines = ["".join(cell.ljust(side) for cell in cells[i : i + each]) for i in range(0, len(cells), each)]
    return "\n".join(lines)
