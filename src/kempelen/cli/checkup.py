"""The doctor's findings on the screen, as they come."""

from collections.abc import Mapping
from pathlib import Path

from rich.console import Console

from kempelen.app.doctor import examine
from kempelen.app.doctor_rows import Check, Status

_MARKS = {Status.OK: "[green]ok  [/]", Status.WARN: "[yellow]warn[/]", Status.FAIL: "[red]FAIL[/]"}


async def checkup(config: Path | None, overrides: Mapping[str, str | None]) -> int:
    """Examine and tell; how many things must be mended before a game can be played."""
    console, failed = Console(), 0
    async for check in examine(config, overrides):
        _print(console, check)
        failed += check.status is Status.FAIL
    console.print("A game can be played." if not failed else f"{failed} to mend before a game can be played.")
    return failed


def _print(console: Console, check: Check) -> None:
    console.print(_MARKS[check.status], end=" ")
    console.print(f"{check.name:<14} {check.found}", markup=False, highlight=False, soft_wrap=True)
    if check.todo:
        console.print(
            f"     {'':<14} {check.todo}", markup=False, highlight=False, soft_wrap=True, style="yellow"
        )
