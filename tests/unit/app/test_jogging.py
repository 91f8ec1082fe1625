"""Where the fingertips are, for touching corners."""

from types import SimpleNamespace
from typing import cast

import pytest

from kempelen.app.jogging import fingertips
from kempelen.core.errors import BusyError, NotHomedError
from kempelen.core.protocols import Robot, RobotPhase, RobotState
from kempelen.core.table import Gripper


def robot(state: RobotState) -> Robot:
    return cast("Robot", SimpleNamespace(state=state))


def test_the_fingertips_are_below_the_tool_point() -> None:
    gripper = Gripper()
    state = RobotState(RobotPhase.IDLE, homed=True, reported_position=(150.0, 25.0, 30.0))
    assert fingertips(robot(state), gripper) == (150.0, 25.0, 30.0 - gripper.below_tool)


def test_a_robot_that_moves_or_is_lost_touches_nothing() -> None:
    with pytest.raises(NotHomedError):
        fingertips(robot(RobotState(RobotPhase.LOCKED)), Gripper())
    moving = RobotState(RobotPhase.JOGGING, homed=True, reported_position=(1.0, 2.0, 3.0))
    with pytest.raises(BusyError, match="jogging"):
        fingertips(robot(moving), Gripper())
