"""`kempelen node view`: the tables of a hall, live in the terminal."""

import asyncio
import contextlib
import time
from collections.abc import Mapping

from rich import box
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from kempelen.app.config import Config
from kempelen.app.network import link_of
from kempelen.cli.node_run import until_signal
from kempelen.nodes.status import HallView, Seen

_REFRESH_S = 0.5
_SILENT_S = 6.0
"""A table that is heard of less often is marked: it should be heard of every 2 s."""
_NAME_WIDTH, _STATE_WIDTH, _MOVE_WIDTH = 32, 12, 11


def run_view(config: Config, seconds: float | None) -> None:
    """Show the tables until Ctrl-C, or once after ``seconds``.

    Raises:
        LinkError: the network cannot be joined.
    """
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(_view(config, seconds))


async def _view(config: Config, seconds: float | None) -> None:
    over, console = until_signal(), Console()
    async with link_of(config) as link:
        view = HallView(link)
        await view.open()
        if seconds is not None:
            await _wait(over, seconds)
            console.print(hall_table(view.tables, time.monotonic()))
            return
        with Live(console=console, auto_refresh=False, screen=console.is_terminal) as live:
            while not over.is_set():
                live.update(hall_table(view.tables, time.monotonic()), refresh=True)
                await _wait(over, _REFRESH_S)


async def _wait(over: asyncio.Event, seconds: float) -> None:
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            await over.wait()


def hall_table(tables: Mapping[str, Seen], now: float) -> Table:
    """A row for each table, readable on 80 columns; ``now`` is of the looker's clock, s."""
    shown = Table(title=_title(tables), expand=True, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    shown.add_column("Table", no_wrap=True, min_width=min(max(map(len, tables), default=0), _NAME_WIDTH))
    shown.add_column("State", no_wrap=True, min_width=_STATE_WIDTH)
    shown.add_column("Move", no_wrap=True, min_width=_MOVE_WIDTH)
    shown.add_column("Players", overflow="ellipsis", no_wrap=True, ratio=2)
    shown.add_column("What goes on", overflow="ellipsis", no_wrap=True, ratio=3)
    for name, seen in tables.items():
        shown.add_row(name, _state(seen, now), *_row(seen))
    return shown


def _row(seen: Seen) -> tuple[str, str, str | Text]:
    status = seen.status
    if status is None:
        return "", "", ""
    number = f"{(status.ply + 1) // 2}{'.' if status.ply % 2 else '...'}"
    move = f"{number} {status.last}" if status.last else ""
    doing = Text(status.trouble, style="bold red") if status.trouble else status.doing
    return move, " - ".join(name for name in (status.white, status.black) if name), doing


def _title(tables: Mapping[str, Seen]) -> str:
    here = sum(seen.here for seen in tables.values())
    troubled = sum(bool(seen.status and seen.status.trouble) for seen in tables.values())
    if not tables:
        return "No table is seen yet."
    return f"{here} of {len(tables)} tables on the network, {troubled or 'none'} in trouble"


def _state(seen: Seen, now: float) -> Text:
    """The worst first; in a word or two, so that no colour is needed to tell."""
    status = seen.status
    if not seen.here:
        return Text("gone", style="red")
    if status is None:
        return Text("silent", style="yellow")
    if now - seen.heard > _SILENT_S:
        return Text(f"silent {now - seen.heard:.0f} s", style="yellow")
    if status.trouble:
        return Text("needs help", style="bold red")
    if status.paused:
        return Text("paused", style="yellow")
    return Text(status.result or (status.robot or "playing" if status.game else "free"), style="green")
