"""A part of a bench: its figures and its rows."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kempelen.bench.wilson import wilson


@dataclass(frozen=True)
class Section:
    """Of one run.

    Attributes:
        figures: Named numbers.
        rows: The table behind them. Rows with other keys, or another value of ``data``, start a table of
            their own.
        files: That it wrote.
    """

    figures: dict[str, float] = field(default_factory=dict)
    rows: list[dict[str, Any]] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)

    def __add__(self, other: "Section") -> "Section":
        figures = {**self.figures, **other.figures}
        return Section(figures, [*self.rows, *other.rows], [*self.files, *other.files])


def counted(right: int, n: int) -> dict[str, Any]:
    """Columns of a count: how many of how many, and the 95 % interval of the share in per cent."""
    low, high = wilson(right, n)
    return {"right": right, "n": n, "low_%": round(100 * low, 1), "high_%": round(100 * high, 1)}
