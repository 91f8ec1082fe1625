"""`kempelen games` and `kempelen pgn`: what the journal holds."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from kempelen.app.paths import data_dir, journal_path
from kempelen.cli.options import DataDirOption
from kempelen.game.game_log import pgn_of
from kempelen.game.journal import GameSummary, JournalReader


def games(data: DataDirOption = None) -> None:
    """List the games in the journal, the newest first.

    Example: kempelen games
    """
    with JournalReader(journal_path(data_dir(data))) as journal:
        rows = journal.games()
    console = Console()
    if not rows:
        console.print("No game has been played yet. Begin one: kempelen play")
        return
    console.print(_listing(rows))
    if any(not row.over for row in rows):
        console.print("Go on with an unfinished one: kempelen resume GAME")


def _listing(rows: list[GameSummary]) -> Table:
    table = Table("Game", "Begun (UTC)", "Mode", "White", "Black", "Moves", "Result", "Reason")
    for row in rows:
        ending = (row.result, row.reason) if row.over else ("*", "unfinished")
        moves = str((row.plies + 1) // 2)
        table.add_row(
            str(row.game), row.started[:16].replace("T", " "), row.mode, row.white, row.black, moves, *ending
        )
    return table


def pgn(
    game: Annotated[int | None, typer.Argument(help="Number of the game; the newest when left out.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; else printed.")
    ] = None,
    data: DataDirOption = None,
) -> None:
    """Export a game as PGN.

    Example: kempelen pgn 3 --output game3.pgn
    """
    with JournalReader(journal_path(data_dir(data))) as journal:
        text = pgn_of(journal.state(game if game is not None else journal.latest()))
    if output is None:
        typer.echo(text)
    else:
        output.write_text(text + "\n")
        typer.echo(f"Written to {output}.")
