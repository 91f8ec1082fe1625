"""Runs a bench with a bar of its progress."""

import importlib
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from kempelen.bench import BENCHES
from kempelen.bench.result import BenchResult
from kempelen.cli.showing import require_writable
from kempelen.core.errors import ConfigError


def run_bench(
    name: str,
    json_file: Path | None,
    *,
    seed: int,
    pgn: Path | None,
    data: Path | None,
    games: int | None = None,
) -> None:
    """Measure, print, keep.

    Raises:
        ConfigError: there is no such bench, it plays no games of its own, or the file cannot be written.
    """
    if name not in BENCHES:
        raise ConfigError(f"There is no bench '{name}'.", hint=f"Choose one of: {', '.join(BENCHES)}.")
    if games is not None and name != "eyes":
        raise ConfigError(f"bench {name} does not take --games.", hint="Only this does: kempelen bench eyes.")
    number = {} if games is None else {"games": games}
    if json_file is not None:
        require_writable(json_file)
    module = importlib.import_module(f"kempelen.bench.{name}")
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=1.0)
        result: BenchResult = module.run(
            seed=seed,
            pgn=pgn,
            data=data,
            **number,
            progress=lambda what, share: bar.update(task, description=what[:50], completed=share),
        )
    result.print_table(Console())
    if json_file is not None:
        result.to_json(json_file)
