"""What is wrong at a station, in plain words, and the command that mends it."""

from kempelen.app.station_types import Remedy, StationFault
from kempelen.core.errors import KempelenError, StoppedError
from kempelen.core.protocols import RobotPhase, RobotState


def faults_of(
    robot: RobotState | None, *, playing: bool, ended_by: KempelenError | None, trouble: KempelenError | None
) -> tuple[StationFault, ...]:
    """The gravest first.

    Args:
        robot: Its state; None when none is connected.
        playing: Whether a game is being played: it homes the robot itself.
        ended_by: What cut the game off that is still shown.
        trouble: Why there is no table, or why its calibration cannot be used.
    """
    found = []
    of_robot = _of_robot(robot, playing=playing) if robot is not None else None
    if ended_by is not None:
        found.append(_of_game(ended_by, of_robot))
    elif of_robot is not None:
        found.append(of_robot)
    if trouble is not None and robot is None:
        found.append(StationFault("The table could not be set up", str(trouble), "connect"))
    elif trouble is not None:
        found.append(StationFault("The calibration cannot be used", str(trouble)))
    return tuple(found)


def _of_game(error: KempelenError, of_robot: StationFault | None) -> StationFault:
    """The next step towards going on; a robot that does not answer is connected anew by resuming."""
    remedy: Remedy = "resume_game"
    if of_robot is not None and of_robot.remedy in {"recover", "home"}:
        remedy = of_robot.remedy
    steps = {
        "recover": "First recover the robot, then home it, then go on with the game.",
        "home": "Home the robot, then go on with the game.",
        "resume_game": "Go on with the game.",
    }
    if isinstance(error, StoppedError):
        text = f"All motion has ended; the game is kept. {steps[remedy]}"
        return StationFault("Emergency stop", text, remedy)
    return StationFault("The game was cut off", f"{error} The game is kept. {steps[remedy]}", remedy)


def _of_robot(robot: RobotState, *, playing: bool) -> StationFault | None:
    match robot.phase:
        case RobotPhase.ALARM:
            text = robot.message or "Find out why, then recover and home it."
            return StationFault("The robot has raised an alarm", text, "recover")
        case RobotPhase.DISCONNECTED:
            text = robot.message or "Check its cable and its power, then connect again."
            return StationFault("The robot does not answer", text, "connect")
        case RobotPhase.LOCKED if not playing:
            return StationFault("The robot must be homed", robot.message or "Home it.", "home")
    if robot.message and not playing:
        return StationFault("The robot needs help", robot.message)
    return None
