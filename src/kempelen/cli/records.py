"""`kempelen games` and `kempelen pgn`: what the journal holds."""

from pathlib import Path
from typing import Annotated

import typer

from kempelen.cli.options import ConfigOption, DataDirOption


def games(config: ConfigOption = None, data_dir: DataDirOption = None) -> None:
    """List the games in the journal, the newest first.

    Examples:

        kempelen games
    """
    from kempelen.cli import listing, start

    listing.show(start.configured(config, data__dir=data_dir).data_dir)


def pgn(
    game: Annotated[int | None, typer.Argument(help="Number of the game.", show_default="the newest")] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="File to write; with - or without it the game is printed."),
    ] = None,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Export a game as PGN.

    Examples:

        kempelen pgn                          the newest
        kempelen pgn 3 --output game3.pgn
    """
    from kempelen.cli import listing, start

    listing.export(start.configured(config, data__dir=data_dir).data_dir, game, output)
