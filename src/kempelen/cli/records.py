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
    san: Annotated[bool, typer.Option("--san", help="The moves alone, in one line of SAN.")] = False,
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Export a game as PGN, or as a log in SAN.

    Examples:

        kempelen pgn                          the newest
        kempelen pgn 3 --output game3.pgn
        kempelen pgn 3 --san                  1. e4 e5 2. Nf3 ...
    """
    from kempelen.cli import listing, start

    listing.export(start.configured(config, data__dir=data_dir).data_dir, game, output, san=san)
