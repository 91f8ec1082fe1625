"""Where the fingertips are, for touching corners."""

from types import SimpleNamespace
from typing import cast

import pytest

from kempelen.app.jogging import JogDesk, fingertips
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


class Driven:
    """A robot that remembers what it was told."""

    def __init__(self, told: list[str]) -> None:
        self.state = RobotState(RobotPhase.IDLE, homed=True)
        self._told = told

    async def jog(self, _direction: object, _speed: float) -> None:
        self._told.append("jog")

    async def jog_stop(self) -> None:
        self._told.append("stop")


async def test_it_is_told_when_somebody_begins_to_drive_and_when_it_has_ended() -> None:
    """The twin's pace is another one in between."""
    told: list[str] = []

    async def note(what: str) -> None:
        told.append(what)

    desk = JogDesk(lambda: note("began"), lambda: note("ended"))
    driven = cast("Robot", Driven(told))
    for _ in range(2):
        await desk.jog(driven, "somebody", (1.0, 0.0, 0.0), 20.0)
    await desk.stop("another")
    await desk.stop("somebody")
    await desk.stop_all()
    assert told == ["began", "jog", "jog", "stop", "ended"]
