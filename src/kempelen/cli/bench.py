"""`kempelen bench NAME`: measurements, printed as a table and kept as JSON."""

import importlib
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress

from kempelen.bench import BENCHES
from kempelen.bench.result import BenchResult
from kempelen.core.errors import ConfigError


def bench(
    name: Annotated[str, typer.Argument(help=f"One of: {', '.join(BENCHES)}.")],
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write figures and rows to this file.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Of everything random.")] = 0,
    pgn: Annotated[Path | None, typer.Option("--pgn", help="Other games than the built-in ones.")] = None,
    data: Annotated[Path | None, typer.Option("--data", help="Folder of recorded data.")] = None,
) -> None:
    """Measure, side by side with bounds and peers.

    Examples:

        kempelen bench motion

        kempelen bench twin --pgn mygames.pgn --json twin.json
    """
    if name not in BENCHES:
        raise ConfigError(f"There is no bench '{name}'.", hint=f"Choose one of: {', '.join(BENCHES)}.")
    module = importlib.import_module(f"kempelen.bench.{name}")
    console = Console()
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=1.0)
        result: BenchResult = module.run(
            seed=seed,
            pgn=pgn,
            data=data,
            progress=lambda what, share: bar.update(task, description=what[:50], completed=share),
        )
    result.print_table(console)
    if json_file is not None:
        result.to_json(json_file)
