"""`kempelen calibrate --arm`: touch points of the board with the closed fingertips."""

import asyncio
from datetime import UTC, datetime
from math import degrees
from pathlib import Path

import typer
from rich.console import Console
from rich.table import Table

from kempelen.app.arm_calibration import (
    TOUCHED,
    TouchedPoint,
    board_from,
    fit_touched,
    read_points,
    save_arm,
)
from kempelen.app.arm_setup import arm_setup
from kempelen.app.calibration_file import save_calibration
from kempelen.app.config import Config
from kempelen.app.fitting import require_table
from kempelen.cli.pad import JogPad, homed_robot, need_terminal
from kempelen.core.errors import CalibrationError, ConfigError, NotHomedError
from kempelen.core.protocols import Robot
from kempelen.kinematics.fit import ArmFit


def measure(config: Config, points: Path | None) -> None:
    """Fit the arm to points of a file, or to points that are touched now, and keep the result.

    Raises:
        ConfigError: the robot is no arm.
        CalibrationError: the points do not settle it.
        FitError: with the board where it was found something does not fit.
    """
    setup = arm_setup(config)
    if setup is None:
        raise ConfigError(
            f"A robot of kind '{config.robot.kind}' has no joints to calibrate.",
            hint="Use: kempelen calibrate --arm --robot arm",
        )
    if points is not None:
        touched = read_points(points, setup.arm)
    else:
        need_terminal("Give the points in a file: kempelen calibrate --arm --points FILE.csv")
        touched = asyncio.run(_touch(config))
    fit = fit_touched(setup.arm, config.build_table(), touched)
    now = datetime.now(UTC)
    board = board_from(fit, config.table.square, now)
    _print(fit)
    require_table(config, config.build_table(board))
    save_arm(config.arm_calibration_path, setup.arm, fit, now)
    save_calibration(config.calibration_path, board)
    typer.echo(f"Kept in {config.arm_calibration_path} and {config.calibration_path}.")


async def _touch(config: Config) -> list[TouchedPoint]:
    """All of `TOUCHED`, one after the other."""
    touched = []
    async with homed_robot(config) as robot:
        for number, (name, (file, rank)) in enumerate(TOUCHED.items(), 1):
            title = f"{number} of {len(TOUCHED)}: touch {name} with the closed fingertips, then press Enter"
            if not await JogPad(robot, title).run():
                raise CalibrationError(
                    f"Left before {name} was touched; the calibration is as it was.", hint="Start again."
                )
            square = config.table.square
            touched.append(TouchedPoint((file * square, rank * square, 0.0), _joints(robot)))
    return touched


def _joints(robot: Robot) -> tuple[float, ...]:
    if robot.state.joints is None:
        raise NotHomedError("The arm does not know its joints.", hint="Home it first.")
    return robot.state.joints


def _print(fit: ArmFit) -> None:
    table = Table(title=f"The arm from {len(fit.residuals)} points")
    table.add_column("what")
    table.add_column("change", justify="right")
    table.add_column("sure to", justify="right")
    for name, found in fit.values.items():
        turns = name.startswith("offset") or name in {"base yaw", "base roll", "base pitch"}
        unit, scale = ("°", degrees(1.0)) if turns else (" mm", 1.0)
        table.add_row(name, f"{found.value * scale:+.3f}{unit}", f"±{found.spread * scale:.3f}{unit}")
    for number, residual in enumerate(fit.residuals.tolist(), 1):
        table.add_row(f"residual of point {number}", f"{residual:.2f} mm")
    table.add_row("RMS residual", f"{fit.rms:.3f} mm")
    Console().print(table)
    if fit.left:
        typer.echo(f"Not told by these points, and left as they were: {', '.join(fit.left)}.")
