"""What is wrong at a station, and the button that mends it."""

import pytest

from kempelen.app.station_faults import faults_of
from kempelen.core.errors import CalibrationError, EngineError, KempelenError, LinkError, StoppedError
from kempelen.core.protocols import RobotPhase, RobotState

IDLE = RobotState(RobotPhase.IDLE, homed=True)
LOCKED = RobotState(RobotPhase.LOCKED)
ALARM = RobotState(RobotPhase.ALARM, message="A limit switch was hit.")
OPEN_DOOR = RobotState(RobotPhase.HELD, message="The door is open.")
GONE = RobotState(RobotPhase.DISCONNECTED)


@pytest.mark.parametrize(
    ("robot", "playing", "ended_by", "trouble", "expected"),
    [
        (None, False, None, None, []),
        (None, False, None, LinkError("Nobody answers."), [("The table could not be set up", "connect")]),
        (IDLE, False, None, None, []),
        (LOCKED, False, None, None, [("The robot must be homed", "home")]),
        (LOCKED, True, None, None, []),
        (ALARM, True, None, None, [("The robot has raised an alarm", "recover")]),
        (GONE, False, None, None, [("The robot does not answer", "connect")]),
        (OPEN_DOOR, False, None, None, [("The robot needs help", None)]),
        (ALARM, False, StoppedError("x"), None, [("Emergency stop", "recover")]),
        (LOCKED, False, StoppedError("x"), None, [("Emergency stop", "home")]),
        (IDLE, False, EngineError("It died."), None, [("The game was cut off", "resume_game")]),
        (GONE, False, LinkError("Unplugged."), None, [("The game was cut off", "resume_game")]),
        (IDLE, False, None, CalibrationError("Damaged."), [("The calibration cannot be used", None)]),
    ],
)  # fmt: skip
def test_faults(
    robot: RobotState | None,
    playing: bool,
    ended_by: KempelenError | None,
    trouble: KempelenError | None,
    expected: list[tuple[str, str | None]],
) -> None:
    found = faults_of(robot, playing=playing, ended_by=ended_by, trouble=trouble)
    assert [(fault.title, fault.remedy) for fault in found] == expected
    assert all(fault.text for fault in found)
