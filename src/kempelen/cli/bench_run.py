"""Runs a bench with a bar of its progress."""

import importlib
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from kempelen.bench import BENCHES
from kempelen.bench.result import BenchResult
from kempelen.bench.result import Progress as ToldProgress
from kempelen.cli.showing import require_writable
from kempelen.core.errors import ConfigError

_LINE_S = 10.0
"""Lines of progress, where there is no bar, come at most this often."""
_TAKEN_BY = {"games": ("arm", "cluster", "eyes"), "clients": ("spectators",), "seconds": ("spectators",)}


def run_bench(
    name: str,
    json_file: Path | None,
    *,
    seed: int,
    pgn: Path | None,
    data: Path | None,
    **others: float | None,
) -> None:
    """Measure, print, keep; ``others`` are options that one bench alone has.

    Raises:
        ConfigError: there is no such bench, it takes not all of ``others``, or the file cannot be written.
    """
    if name not in BENCHES:
        raise ConfigError(f"There is no bench '{name}'.", hint=f"Choose one of: {', '.join(BENCHES)}.")
    given = {option: value for option, value in others.items() if value is not None}
    for option in given:
        if name not in _TAKEN_BY[option]:
            raise ConfigError(
                f"bench {name} does not take --{option}.",
                hint=f"Only this does: kempelen bench {' or '.join(_TAKEN_BY[option])}.",
            )
    if json_file is not None:
        require_writable(json_file)
    module = importlib.import_module(f"kempelen.bench.{name}")
    with _progress(name) as progress:
        result: BenchResult = module.run(seed=seed, pgn=pgn, data=data, **given, progress=progress)
    result.print_table(Console())
    if json_file is not None:
        result.to_json(json_file)


@contextmanager
def _progress(name: str) -> Iterator[ToldProgress]:
    """A bar on a terminal; lines now and then where standard error goes elsewhere."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _Lines(console)
        return
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task(name, total=1.0)
        yield lambda what, share: bar.update(task, description=what[:50], completed=share)


class _Lines:
    """Progress as lines of text."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._next = 0.0

    def __call__(self, what: str, share: float) -> None:
        """Print it, unless the last line is fresh."""
        if time.monotonic() < self._next:
            return
        self._next = time.monotonic() + _LINE_S
        self._console.print(f"{100 * share:3.0f} %  {what}", markup=False, highlight=False, soft_wrap=True)
