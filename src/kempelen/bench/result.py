"""What a bench hands back: its figures, and the table behind them."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

Progress = Callable[[str, float], None]
"""Called with what is being done and the share done, 0 to 1."""


@dataclass(frozen=True)
class BenchResult:
    """Of one run.

    Attributes:
        bench: Its name.
        figures: The numbers that it is judged by.
        rows: The table behind them: the same keys in each row.
    """

    bench: str
    figures: dict[str, float]
    rows: list[dict[str, Any]] = field(default_factory=list)

    def to_json(self, path: Path) -> None:
        """Write ``{"bench": ..., "figures": {...}, "rows": [...]}``."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(self), indent=2) + "\n", encoding="utf-8")

    def print_table(self, console: Console) -> None:
        """The rows, then the figures."""
        console.print(f"kempelen bench {self.bench}", highlight=False)
        if self.rows:
            console.print(_table(self.rows))
        console.print(_table([{"figure": name, "value": value} for name, value in self.figures.items()]))


def _table(rows: list[dict[str, Any]]) -> Table:
    table = Table(box=SIMPLE, pad_edge=False, padding=(0, 1, 0, 0))
    for name in rows[0]:
        numeric = isinstance(rows[0][name], int | float)
        table.add_column(name.replace("_", "\n"), justify="right" if numeric else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(_shown(value) for value in row.values()))
    return table


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
