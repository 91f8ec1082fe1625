"""Finding out where the camera stands over the robot, step by step."""

import asyncio
from datetime import UTC, datetime

import chess
import typer

from kempelen.app.calibration_file import load_calibration
from kempelen.app.camera_pose import CameraPose, measure_board, save_camera_pose
from kempelen.app.cameras import open_view
from kempelen.app.config import Config
from kempelen.app.eye import Eye, EyeSettings
from kempelen.core.errors import CalibrationError, ConfigError, SensorError
from kempelen.core.geometry import Transform
from kempelen.core.senses import Sight

_PATIENCE_S = 60.0
"""How long a person has to put right what keeps the camera from seeing the board."""


def measure(config: Config, white: str) -> None:
    """Look, find the board, and keep where the camera stands.

    Args:
        config: Which camera, and where the board is.
        white: Side of the picture at which White sits; empty: told by the pieces.

    Raises:
        ConfigError: no camera is named.
        CalibrationError: the board's corners were not touched yet, or the looks disagree.
        SensorError: the board is not seen in time.
    """
    source = config.camera_source
    if not source:
        raise ConfigError("No camera is named.", hint="Name one: kempelen calibrate --camera --source uvc:0")
    calibration = load_calibration(config.calibration_path)
    if calibration is None and not config.on_twin:
        raise CalibrationError(
            "The robot does not know the board yet, so that the camera cannot learn of the robot by it.",
            hint="Touch the board's corners first: kempelen calibrate",
        )
    table = config.build_table(calibration)
    pose = asyncio.run(_measure(config, source, white, table.square, table.robot_from_board))
    save_camera_pose(config.camera_calibration_path, pose)
    _tell(pose)
    typer.echo(f"Kept in {config.camera_calibration_path}.")


async def _measure(
    config: Config, source: str, white: str, square: float, robot_from_board: Transform
) -> CameraPose:
    typer.echo("1. Set the pieces up as at a game's start, and keep your hands and the robot away from them.")
    settings = EyeSettings(config.sensor.method, config.sensor.parameters, square, white)
    board = chess.Board()
    async with open_view(config, board) as frames, Eye(frames, settings) as eye:
        eye.expect(board)
        typer.echo("2. Looking for the board …")
        await _in_sight(eye)
        typer.echo("3. Measuring it several times …")
        found = await measure_board(eye, square)
    robot_from_camera = robot_from_board @ found.camera_from_board.inverse()
    return CameraPose(robot_from_camera, source, found.spread, datetime.now(UTC))


async def _in_sight(eye: Eye) -> None:
    """Until the board is seen; what keeps it from being seen is said, once each."""
    said = ""
    try:
        async with asyncio.timeout(_PATIENCE_S):
            async for seen in eye.observe():
                if seen.valid:
                    return
                if seen.message != said and seen.sight is not Sight.STARTING:
                    said = seen.message
                    typer.echo(f"   {said}")
    except TimeoutError:
        raise SensorError(
            f"The board was not seen within {_PATIENCE_S:.0f} s. {said or eye.latest.message}".rstrip(),
            hint="Look at what the camera sees: kempelen see. Say where White sits: --white bottom",
        ) from None


def _tell(pose: CameraPose) -> None:
    x, y, z = pose.robot_from_camera.translation
    typer.echo(
        f"The camera stands at x {x:.0f}, y {y:.0f}, z {z:.0f} mm in the robot's frame; "
        f"the looks differ by up to {pose.spread:.2f} mm."
    )
