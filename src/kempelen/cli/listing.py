"""The games of the journal, as a table and as PGN."""

from pathlib import Path

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from kempelen.app.files import replace_file
from kempelen.app.paths import journal_path
from kempelen.core.errors import ConfigError
from kempelen.game.game_log import pgn_of, san_of
from kempelen.game.journal import GameSummary, JournalReader

_WHOLE = 4 + 16 + 6 + 5 + 5 * 2  # what the columns of one width and the gaps take
_REASON = 29
_LEAST = 19


def show(directory: Path) -> None:
    """All games of a data directory, the newest first."""
    path = journal_path(directory)
    rows = []
    if path.exists():
        with JournalReader(path) as journal:
            rows = journal.games()
    console = Console()
    if not rows:
        console.print(
            f"No game in {directory} yet. Begin one: kempelen play", soft_wrap=True, highlight=False
        )
        return
    console.print(_table(rows, console.width))
    if any(not row.over for row in rows):
        console.print("Go on with an unfinished one: kempelen resume GAME", highlight=False)


def _table(rows: list[GameSummary], width: int) -> Table:
    """Names and reasons are wrapped where the terminal is narrow; numbers and dates are always whole."""
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
    left = max(width - _WHOLE, 2 * _LEAST)
    table.add_column("Game", width=4, justify="right")
    table.add_column("Begun (UTC)", width=16)
    table.add_column("Mode", width=6)
    table.add_column("White, Black", max_width=max(left - _REASON, _LEAST))
    table.add_column("Moves", width=5, justify="right")
    table.add_column("Result", max_width=min(_REASON, left - _LEAST))
    for row in rows:
        ending = f"{row.result} {row.reason}" if row.over else "* unfinished"
        begun = row.started[:16].replace("T", " ")
        moves = str((row.plies + 1) // 2)
        table.add_row(str(row.game), begun, row.mode, f"{row.white}, {row.black}", moves, ending)
    return table


def export(directory: Path, game: int | None, output: Path | None, *, san: bool = False) -> None:
    """One game as PGN, or as its moves alone, to a file or to standard output.

    Raises:
        JournalError: no such game.
        ConfigError: the file cannot be written.
    """
    with JournalReader(journal_path(directory)) as journal:
        state = journal.state(game if game is not None else journal.latest())
    text = san_of(state) if san else pgn_of(state)
    if output is None or str(output) == "-":
        typer.echo(text)
        return
    try:
        replace_file(output, text + "\n")
    except OSError as error:
        raise ConfigError(
            f"{output} cannot be written: {error.strerror}.",
            hint="Name a file in a directory that you may write to.",
        ) from None
    typer.echo(f"Written to {output.absolute()}.")
