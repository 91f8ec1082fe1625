"""What is wrong at a station, in plain words, and the command that mends it."""

from kempelen.app.station_types import Remedy, StationFault
from kempelen.core.errors import KempelenError, StoppedError
from kempelen.core.protocols import RobotPhase, RobotState
from kempelen.core.words import joined, say

_STEPS = {
    "recover": say("first_recover", "First recover the robot, then home it, then go on with the game."),
    "home": say("first_home", "Home the robot, then go on with the game."),
    "resume_game": say("go_on_with_game", "Go on with the game."),
}
_KEPT = say("game_is_kept", "The game is kept.")


def faults_of(
    robot: RobotState | None,
    *,
    playing: bool,
    ended_by: KempelenError | None,
    trouble: KempelenError | None,
    eyes: str = "",
) -> tuple[StationFault, ...]:
    """The gravest first.

    Args:
        robot: Its state; None when none is connected.
        playing: Whether a game is being played, or set up: it homes the robot itself.
        ended_by: What cut the game off that is still shown.
        trouble: Why there is no table, or why its calibration cannot be used.
        eyes: Why the board is not being watched.
    """
    found = []
    of_robot = _of_robot(robot, playing=playing) if robot is not None else None
    if ended_by is not None:
        found.append(_of_game(ended_by, of_robot))
    elif of_robot is not None:
        found.append(of_robot)
    if trouble is not None and robot is None:
        found.append(
            StationFault(say("fault_no_table", "The table could not be set up"), _words(trouble), "connect")
        )
    elif trouble is not None:
        found.append(
            StationFault(say("fault_calibration", "The calibration cannot be used"), _words(trouble))
        )
    if eyes:
        found.append(StationFault(say("fault_eyes", "The board is not being watched"), eyes))
    return tuple(found)


def _words(error: KempelenError) -> str:
    return joined(error.message, error.hint)


def _of_game(error: KempelenError, of_robot: StationFault | None) -> StationFault:
    """The next step towards going on; a robot that does not answer is connected anew by resuming."""
    remedy: Remedy = "resume_game"
    if of_robot is not None and of_robot.remedy in {"recover", "home"}:
        remedy = of_robot.remedy
    if isinstance(error, StoppedError):
        text = joined(say("all_stopped", "All motion has ended; the game is kept."), _STEPS[remedy])
        return StationFault(say("fault_stopped", "Emergency stop"), text, remedy)
    text = joined(_words(error), _KEPT, _STEPS[remedy])
    return StationFault(say("fault_cut_off", "The game was cut off"), text, remedy)


def _of_robot(robot: RobotState, *, playing: bool) -> StationFault | None:
    match robot.phase:
        case RobotPhase.ALARM:
            text = robot.message or say("find_out_why", "Find out why, then recover and home it.")
            return StationFault(say("fault_alarm", "The robot has raised an alarm"), text, "recover")
        case RobotPhase.DISCONNECTED:
            text = robot.message or say("check_cable", "Check its cable and its power, then connect again.")
            return StationFault(say("fault_silent", "The robot does not answer"), text, "connect")
        case RobotPhase.LOCKED if not playing:
            text = robot.message or say("home_it", "Home it.")
            return StationFault(say("fault_unhomed", "The robot must be homed"), text, "home")
    if robot.message and not playing:
        return StationFault(say("fault_needs_help", "The robot needs help"), robot.message)
    return None
