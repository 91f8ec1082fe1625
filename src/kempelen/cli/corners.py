"""Measuring where the board is: corners as numbers, or touched with the pad."""

import asyncio
from datetime import UTC, datetime
from pathlib import Path

import typer
from rich.console import Console
from rich.table import Table

from kempelen.app.calibration_file import load_calibration, save_calibration
from kempelen.app.config import Config
from kempelen.app.fitting import require_table
from kempelen.app.jogging import Point, fingertips
from kempelen.cli.pad import JogPad, homed_robot, need_terminal
from kempelen.core.calibration import CORNERS, Calibration, calibrate
from kempelen.core.errors import CalibrationError


def _corner(text: str) -> tuple[str, Point]:
    name, _, numbers = text.partition("=")
    try:
        x, y, z = (float(number) for number in numbers.split(","))
    except ValueError:
        raise CalibrationError(
            f"'{text}' is no corner.", hint="Write a corner like a1=150.0,25.0,0.0 (robot frame, mm)."
        ) from None
    return name.strip().lower(), (x, y, z)


def measure(config: Config, given: list[str], count: int, square: float | None) -> None:
    """Calibrate from the corners given, or from ``count`` that are touched, and keep the result.

    Raises:
        CalibrationError: the corners cannot be those of a board.
        FitError: on that board something does not fit.
    """
    if given:
        points = dict(map(_corner, given))
    else:
        need_terminal("Give the corners as numbers: --corner a1=X,Y,Z --corner h1=X,Y,Z")
        points = asyncio.run(_touch(config, list(CORNERS)[:count]))
    found = calibrate(points, date=datetime.now(UTC), square=square)
    require_table(config, config.build_table(found))
    save_calibration(config.calibration_path, found)
    _print(found)
    typer.echo(f"Kept in {config.calibration_path}.")


async def _touch(config: Config, names: list[str]) -> dict[str, Point]:
    """The corners as touched."""
    points: dict[str, Point] = {}
    async with homed_robot(config) as robot:
        for name in names:
            title = f"Touch the outer corner of {name} with the closed fingertips, then press Enter"
            if not await JogPad(robot, title).run():
                raise CalibrationError(
                    f"Left before {name} was touched; the calibration is as it was.", hint="Start again."
                )
            points[name] = fingertips(robot, config.gripper)
    return points


def show(path: Path) -> None:
    """The calibration in force."""
    found = load_calibration(path)
    if found is None:
        typer.echo(f"There is no calibration in {path}; the configuration's position is used.")
    else:
        _print(found)


def _print(found: Calibration) -> None:
    x, y, z = found.robot_from_board.translation
    table = Table(title=f"Calibration of {found.date:%Y-%m-%d %H:%M} UTC")
    table.add_column("what")
    table.add_column("value", justify="right")
    table.add_row("a1's outer corner", f"x {x:.2f}  y {y:.2f}  z {z:.2f} mm")
    table.add_row("turn", f"{found.robot_from_board.yaw * 57.29577951308232:.2f}°")
    table.add_row("square", f"{found.square:.2f} mm")
    for name, residual in found.residuals.items():
        table.add_row(f"residual at {name}", f"{residual:.2f} mm")
    table.add_row("RMS residual", f"{found.rms:.3f} mm")
    Console().print(table)
