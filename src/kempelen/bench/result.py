"""What a bench hands back: its figures, and the table behind them."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

Progress = Callable[[str, float], None]
"""Called with what is being done and the share done, 0 to 1."""


def part_of(progress: Progress, begun: float, share: float) -> Progress:
    """For a part of the work, whose 0 to 1 is ``begun`` to ``begun + share`` of the whole."""
    return lambda what, done: progress(what, begun + share * done)


_WIDE = 110  # columns from which headings need not be short
_EDGES = 1
_NAME = 8
_SHORT = {
    "interventions": "helps",
    "neighbour": "near",
    "predicted": "pred.",
    "realtime": "real time",
    "toppled": "fell",
    "transfers": "transf.",
}


@dataclass(frozen=True)
class BenchResult:
    """Of one run.

    Attributes:
        bench: Its name.
        figures: The numbers that it is judged by.
        rows: The tables behind them: rows with the same keys and the same value of ``data``, where there is
            one, make a table.
        files: That the bench wrote; where they are is printed.
    """

    bench: str
    figures: dict[str, float]
    rows: list[dict[str, Any]] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)

    def to_json(self, path: Path) -> None:
        """Write ``{"bench": ..., "figures": {...}, "rows": [...]}``."""
        path.parent.mkdir(parents=True, exist_ok=True)
        kept = {"bench": self.bench, "figures": self.figures, "rows": self.rows}
        path.write_text(json.dumps(kept, indent=2) + "\n", encoding="utf-8")

    def print_table(self, console: Console) -> None:
        """The rows, then the figures, then where other files are."""
        console.print(f"kempelen bench {self.bench}", highlight=False)
        for rows in _tables(self.rows):
            console.print(_table(rows, console.width))
            console.print()
        figures = [{"figure": name, "value": value} for name, value in self.figures.items()]
        console.print(_table(figures, console.width))
        for file in self.files:
            console.print(f"Written: {file.resolve()}", markup=False, highlight=False, soft_wrap=True)


def short_title(headers: Mapping[str, str]) -> str:
    """A game's name for a narrow column: ``Byrne-Fischer 1956``."""
    names = [_surname(headers.get(side, "")) for side in ("White", "Black")]
    year = headers.get("Date", "")[:4]
    known = f" {year}" if year.isdigit() else ""
    return "".join(letter for letter in f"{'-'.join(names)}{known}" if letter.isprintable())


def _surname(name: str) -> str:
    """As PGN writes it, before the comma; else the last word."""
    surname, comma, _ = name.partition(",")
    return (surname if comma else name.rpartition(" ")[2]).strip() or "?"


def _tables(rows: list[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """Rows side by side that go into one table; what was measured on real and on simulated data never do."""

    def kind(row: dict[str, Any]) -> tuple[tuple[str, ...], Any]:
        return tuple(row), row.get("data")

    return [list(group) for _, group in groupby(rows, key=kind)]


def _table(rows: list[dict[str, Any]], width: int) -> Table:
    """Numbers are never cut; the first column, which names the row, is, where there is no room for all."""
    headings = {name: _heading(name, width) for name in rows[0]}
    first, *others = headings
    widths = {name: _width(rows, name, headings[name]) for name in headings}
    room = width - sum(widths[name] + 1 for name in others) - _EDGES
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    table.add_column(
        headings[first], width=max(min(widths[first], room), _NAME), no_wrap=True, overflow="ellipsis"
    )
    for name in others:
        right = isinstance(rows[0][name], int | float)
        table.add_column(headings[name], justify="right" if right else "left", width=widths[name])
    for row in rows:
        table.add_row(*(_shown(value) for value in row.values()))
    return table


def _heading(name: str, width: int) -> str:
    """A word a line."""
    words = (_SHORT.get(word, word) if width < _WIDE else word for word in name.split("_"))
    return "\n".join(words).replace(" ", "\n")


def _width(rows: list[dict[str, Any]], name: str, heading: str) -> int:
    return max(*(len(_shown(row[name])) for row in rows), *map(len, heading.split()), 1)


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
