"""The engines at hand, as a table."""

from collections.abc import Sequence
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from kempelen.engines.probe import EngineReport


def show(reports: Sequence[EngineReport]) -> bool:
    """Print them, with the reason where one does not work; whether any does."""
    console = Console()
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
    for heading in ("--engine", "calls itself", "protocol", "found"):
        table.add_column(heading, overflow="fold")
    for report in reports:
        if report.works:
            name = report.name.partition(" (")[0]
            table.add_row(_named(report), name, report.tongue, f"{report.source}: {report.path}")
    if table.row_count:
        console.print(table)
    for report in reports:
        if not report.works:
            console.print(
                f"{report.name} does not work: {report.fault} {report.hint}", highlight=False, markup=False
            )
    console.print("Any other one by its path: kempelen play --engine PATH", highlight=False)
    return table.row_count > 0


def _named(report: EngineReport) -> str:
    if report.name.startswith("Maia "):
        return report.name.lower().replace(" ", "-")
    return Path(report.path).name.partition("-")[0]
