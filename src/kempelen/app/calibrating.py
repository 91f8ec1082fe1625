"""Measuring the board anew, corner by corner or by camera, also in mid-game: the game goes on afterwards."""

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Protocol, TypeVar

from kempelen.app.calibration_file import save_calibration
from kempelen.app.config import Config
from kempelen.app.fitting import misfits
from kempelen.app.jogging import Point, fingertips
from kempelen.app.live_game import LiveGame
from kempelen.app.remeasure import board_by_camera, table_as_measured
from kempelen.app.station_types import CalibrationState
from kempelen.app.table_session import TableSession
from kempelen.core.calibration import CORNERS, Calibration, calibrate
from kempelen.core.errors import CalibrationError, GameError, KempelenError, NotHomedError
from kempelen.core.places import Layout
from kempelen.core.protocols import GripperState, SetGripper
from kempelen.core.words import say

if TYPE_CHECKING:
    from kempelen.app.eyes import GameEyes

V = TypeVar("V")


class Surroundings(Protocol):
    """What a calibration needs of the station."""

    @property
    def config(self) -> Config:
        """In force."""
        ...

    @property
    def eyes(self) -> "GameEyes | None":
        """What looks at the board."""
        ...

    @property
    def playing(self) -> LiveGame | None:
        """The game that is being played."""
        ...

    @property
    def standing(self) -> Layout:
        """What stands where."""
        ...

    def require_session(self) -> TableSession:
        """The table that is up."""
        ...


class CalibrationDesk:
    """One calibration at a time.

    Args:
        around: The station.
        changed: Called when `state` is another one.

    Attributes:
        state: What has been measured so far.
    """

    def __init__(self, around: Surroundings, changed: Callable[[], None]) -> None:
        self._around = around
        self._changed = changed
        self._touched: dict[str, Point] = {}
        self._square: float | None = None
        self._resumes = False
        self.state = CalibrationState()

    async def begin(self) -> None:
        """Pause the game, its move finished first; the hand rises and closes, ready to touch.

        Raises:
            GameError: one is being made already.
            NotHomedError: the robot does not know where it is.
            KempelenError: the move in hand could not be finished.
        """
        if self.state.active:
            raise GameError(
                say("calibrating_already", "A calibration is being made already."),
                hint=say("end_calibration", "Apply or cancel it."),
            )
        session, game = self._around.require_session(), self._around.playing
        if not session.robot.state.homed:
            raise NotHomedError(
                say("not_homed", "The robot does not know where it is."),
                hint=say("home_first", "Home it first."),
            )
        self._resumes = game is not None and not game.arbiter.paused
        try:
            if game is not None:
                await game.arbiter.pause()
                await game.arbiter.finish_move()
            await self._ready_to_touch(session)
        except KempelenError:
            await self._go_on()
            raise
        self._touched, self._square = {}, None
        self._weigh(active=True)

    @staticmethod
    async def _ready_to_touch(session: TableSession) -> None:
        """Straight up first: the open gripper may still be around the piece it has let go of."""
        await session.robot.retract()
        if session.robot.state.gripper is not GripperState.CLOSED:
            await session.robot.run([SetGripper(closed=True, seconds=session.table.gripper.close_seconds)])

    def touch(self, corner: str) -> None:
        """The closed fingertips are at the outer corner of that square.

        Raises:
            GameError: no calibration is being made.
            CalibrationError: there is no such corner.
            RobotError: the robot is not at rest, or does not know where it is.
        """
        self._require()
        if corner not in CORNERS:
            raise CalibrationError(
                say("no_corner", f"'{corner}' is no corner of the board.", corner=corner),
                hint=f"Corners are {', '.join(CORNERS)}.",
            )
        session = self._around.require_session()
        self._touched[corner] = fingertips(session.robot, self._around.config.gripper)
        self._square = None
        self._weigh(active=True)

    async def by_camera(self) -> None:
        """Take all corners from the camera; the hand goes out of its view first.

        Raises:
            GameError: no calibration is being made, or there is no camera whose place is known.
            KempelenError: the board cannot be measured.
        """
        self._require()
        eyes, session = self._around.eyes, self._around.require_session()
        if eyes is None:
            raise GameError(
                say("no_camera", "There is no camera."),
                hint=say("touch_instead", "Touch the corners instead."),
            )
        await self._aside(session)
        found = await board_by_camera(self._around.config, eyes, session.table)
        self._touched, self._square = dict(found.corners), found.square
        self._weigh(active=True)

    async def apply(self, square: float | None) -> None:
        """Keep what was measured, and use it from now on; a game that was paused for it goes on.

        Args:
            square: Side of a square, mm, where it is known.

        Raises:
            CalibrationError: it cannot be those of a board, or cannot be kept.
            FitError: on that board something does not fit.
            GameError: no calibration is being made.
        """
        self._require()
        found = self._found(square if square is not None else self._square)
        session, game = self._around.require_session(), self._around.playing
        if game is not None:
            await game.use_calibration(found)
        else:
            session.use(table_as_measured(self._around.config, found))
            save_calibration(self._around.config.calibration_path, found)
        await self._end(session)

    async def cancel(self) -> None:
        """Keep the one before; a game that was paused for it goes on.

        Raises:
            GameError: no calibration is being made.
        """
        self._require()
        await self._end(self._around.require_session())

    def forget(self) -> None:
        """The table has gone, and with it whatever was measured."""
        self._resumes = False
        if self.state.active:
            self._weigh(active=False)

    def _require(self) -> None:
        if not self.state.active:
            raise GameError(
                say("not_calibrating", "No calibration is being made."), hint=say("begin_one", "Begin one.")
            )

    async def _end(self, session: TableSession) -> None:
        self._weigh(active=False)
        try:
            await self._aside(session)
        finally:
            await self._go_on()

    async def _aside(self, session: TableSession) -> None:
        """Up, and beside the board."""
        await session.robot.retract()
        await session.hand.park(self._around.standing)

    async def _go_on(self) -> None:
        game = self._around.playing
        if self._resumes and game is not None:
            await game.arbiter.resume()
        self._resumes = False

    # --- what it comes to ---

    def _found(self, square: float | None) -> Calibration:
        return calibrate(self._touched, date=datetime.now(UTC), square=square)

    def _weigh(self, *, active: bool) -> None:
        """What can be said of the corners so far."""
        if not active:
            self._touched = {}
        problem, residuals, side, fits = "", dict[str, float](), None, tuple[str, ...]()
        try:
            if active:
                found = self._found(self._square)
                residuals, side, fits = dict(found.residuals), found.square, self._misfits(found)
        except CalibrationError as error:
            problem = str(error)
        self.state = CalibrationState(active, _pairs(self._touched), _pairs(residuals), side, problem, fits)
        self._changed()

    def _misfits(self, found: Calibration) -> tuple[str, ...]:
        config = self._around.config
        return tuple(map(str, misfits(config, config.build_table(found))))


def _pairs(values: Mapping[str, V]) -> tuple[tuple[str, V], ...]:
    return tuple(values.items())
