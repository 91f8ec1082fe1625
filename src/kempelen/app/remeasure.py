"""Measuring a board again that has been measured before: by the camera, and what has to fit on it."""

from typing import TYPE_CHECKING

from kempelen.app.camera_pose import as_calibration, bumped, load_camera_pose
from kempelen.app.config import Config
from kempelen.app.fitting import require_table
from kempelen.core.calibration import Calibration
from kempelen.core.errors import GameError
from kempelen.core.geometry import Transform
from kempelen.core.table import Table
from kempelen.core.words import say

if TYPE_CHECKING:
    from kempelen.app.eyes import GameEyes


async def board_by_camera(config: Config, eyes: "GameEyes", before: Table) -> Calibration:
    """Where the board is now, by the camera alone.

    Args:
        config: Names the file that tells where the camera stands over the robot.
        eyes: Open.
        before: The table as it was measured last.

    Raises:
        GameError: nobody knows where the camera stands.
        SensorError: the board is not seen.
        CalibrationError: looks at it disagree, or it was lifted.
    """
    robot_from_camera = _robot_from_camera(config)
    seen = robot_from_camera @ (await eyes.pose()).camera_from_board
    return as_calibration(bumped(before.robot_from_board, seen), before.square)


def _robot_from_camera(config: Config) -> Transform:
    known = load_camera_pose(config.camera_calibration_path)
    if known is None:
        raise GameError(
            say("camera_place_unknown", "It is not known where the camera stands over the robot."),
            hint=say(
                "calibrate_camera_once",
                "Put the board back, leave the game, and calibrate once: kempelen calibrate --camera",
            ),
        )
    return known.robot_from_camera


def table_as_measured(config: Config, calibration: Calibration) -> Table:
    """The table on which a game can be played with this calibration.

    Raises:
        FitError: something does not fit on it.
    """
    table = config.build_table(calibration)
    require_table(config, table)
    return table
