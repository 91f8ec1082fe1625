"""`kempelen doctor` and `kempelen config`."""

import asyncio

import typer
from rich.console import Console

from kempelen.app.config_example import example_toml
from kempelen.app.doctor import examine
from kempelen.app.doctor_rows import Check, Status
from kempelen.cli.options import ConfigOption, DataDirOption, EngineOption, PortOption

_MARKS = {Status.OK: "[green]ok  [/]", Status.WARN: "[yellow]warn[/]", Status.FAIL: "[red]FAIL[/]"}


def doctor(
    config: ConfigOption = None,
    data_dir: DataDirOption = None,
    port: PortOption = None,
    engine: EngineOption = None,
) -> None:
    """Check engine, ports, permissions, physics, calibration and disk, and say what to do.

    Example: kempelen doctor --port /dev/ttyUSB0
    """
    overrides = {"data.dir": str(data_dir) if data_dir else None, "robot.port": port, "engine.path": engine}
    if asyncio.run(_examine(config, overrides)):
        raise typer.Exit(1)


async def _examine(config: ConfigOption, overrides: dict[str, str | None]) -> int:
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


def config() -> None:
    """Print every setting with its default and meaning.

    Example: kempelen config > kempelen.toml
    """
    typer.echo(example_toml())
