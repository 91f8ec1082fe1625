"""Driving by hand, for one client at a time; and where the fingertips then are."""

from collections.abc import Awaitable, Callable

from kempelen.core.errors import BusyError, NotHomedError
from kempelen.core.protocols import Robot, RobotPhase
from kempelen.core.table import Gripper
from kempelen.core.words import say

Point = tuple[float, float, float]


class JogDesk:
    """Remembers who drives: another one is refused until the motion has ended, and only its owner ends it.

    Args:
        began: Called before somebody begins to drive.
        ended: Called when somebody has ended.

    Attributes:
        strayed: Whether the hand may be anywhere, low between the pieces too; for whoever brings it up again.
    """

    def __init__(self, began: Callable[[], Awaitable[None]], ended: Callable[[], Awaitable[None]]) -> None:
        self._began, self._ended = began, ended
        self.strayed = False
        self._owner = ""
        self._robot: Robot | None = None

    async def jog(self, robot: Robot, owner: str, direction: Point, speed: float) -> None:
        """Keep moving; ends when the calls do.

        Raises:
            BusyError: somebody else drives.
            RobotError: as `Robot.jog`.
        """
        if robot.state.phase is RobotPhase.JOGGING and self._owner != owner:
            raise BusyError(
                say("somebody_jogs", "Somebody else is jogging."),
                hint=say("wait_at_rest", "Wait until the robot is at rest."),
            )
        if self._robot is None:
            await self._began()
        self._owner, self._robot, self.strayed = owner, robot, True
        await robot.jog(direction, speed)

    async def stop(self, owner: str) -> None:
        """End what ``owner`` drives; returns at rest."""
        if self._robot is not None and self._owner == owner:
            robot, self._robot, self._owner = self._robot, None, ""
            try:
                await robot.jog_stop()
            finally:
                await self._ended()

    async def stop_all(self) -> None:
        """End it whoever drives: something else is to be done."""
        await self.stop(self._owner)


def fingertips(robot: Robot, gripper: Gripper) -> Point:
    """Where the closed fingertips are, mm, robot frame: lower than the tool point.

    Raises:
        NotHomedError: the robot does not know.
        BusyError: it is still moving.
    """
    state = robot.state
    if state.reported_position is None:
        raise NotHomedError(
            say("not_homed", "The robot does not know where it is."), hint=say("home_first", "Home it first.")
        )
    if state.phase is not RobotPhase.IDLE:
        raise BusyError(
            say("not_at_rest", f"The robot is not at rest: {state.phase}."),
            hint=say("let_go", "Let go of the keys and try again."),
        )
    x, y, z = state.reported_position
    return x, y, z - gripper.below_tool
