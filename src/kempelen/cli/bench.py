"""`kempelen bench NAME`: measurements, printed as a table and kept as JSON."""

from pathlib import Path
from typing import Annotated

import typer

from kempelen.bench import BENCHES


def bench(
    name: Annotated[str, typer.Argument(help=f"One of: {', '.join(BENCHES)}.", metavar="NAME")],
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write figures and rows to this file.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Of everything random.", min=0)] = 0,
    pgn: Annotated[
        Path | None, typer.Option("--pgn", help="Games to measure with.", show_default="the built-in ones")
    ] = None,
    data: Annotated[Path | None, typer.Option("--data", help="Folder of recorded data.")] = None,
    games: Annotated[
        int | None,
        typer.Option("--games", help="How many games.", min=0, show_default="arm 20, eyes 50, cluster 150"),
    ] = None,
    clients: Annotated[
        int | None,
        typer.Option("--clients", help="How many look on in bench spectators.", min=1, show_default="200"),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option("--seconds", help="For how long.", min=1, show_default="20")
    ] = None,
) -> None:
    """Measure, side by side with bounds and peers.

    Examples:

        kempelen bench motion
        kempelen bench twin --pgn mygames.pgn --json twin.json

        kempelen bench vision --data ../shared/real

        kempelen bench eyes --games 5

        kempelen bench spectators --clients 50
    """
    from kempelen.cli.bench_run import run_bench

    run_bench(name, json_file, seed=seed, pgn=pgn, data=data, games=games, clients=clients, seconds=seconds)
