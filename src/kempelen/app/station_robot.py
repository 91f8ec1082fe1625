"""The robot of a station: stopped, homed, jogged; and of the twin its time and its virtual hand."""

from collections.abc import Callable, Coroutine
from contextlib import nullcontext, suppress
from typing import Any

from kempelen.app.config_change import changed
from kempelen.app.idle_table import AT_WORK
from kempelen.app.live_game import LiveGame
from kempelen.app.station_table import StationTable
from kempelen.app.station_types import Change
from kempelen.app.table_session import TableSession
from kempelen.core.errors import ConfigError, GameError, KempelenError, LinkError
from kempelen.core.words import say

_REACH_MM = 250.0
"""How far from what the robot can reach the virtual hand still sets pieces down."""


class StationRobot(StationTable):
    """What a station does with its robot. See `kempelen.app.station.Station`."""

    async def stop(self) -> None:
        """E-stop: on the wire at once, whatever else is going on; a running game ends and can be resumed.

        Raises:
            LinkError: the line is lost: cut the power.
        """
        self._halted = True
        if self._inner is not None and self._passing is not None:
            self._inner.cancel()  # nothing moves yet, and nothing shall
        if self._run is not None and self._run.running:
            await self._run.stop()
        elif self.session is not None:
            with suppress(LinkError) if self._passing is not None else nullcontext():  # it is let go of
                await self.session.robot.stop()

    async def home(self) -> None:
        """Find the reference switches.

        Raises:
            GameError: the game is moving the robot; it homes it itself when it has to.
            RobotError: as `Robot.home`.
        """
        robot = self.require_session().robot
        await self._do(
            say("busy_homing", "Homing …"),
            lambda: self._between_moves(robot.home, say("homing_stopped", "Homing was stopped.")),
        )

    async def recover(self) -> None:
        """Clear an alarm or a stop; homing follows.

        Raises:
            GameError: the game is moving the robot.
            RobotError: as `Robot.recover`.
        """
        robot = self.require_session().robot
        await self._do(
            say("busy_recovering", "Recovering …"),
            lambda: self._between_moves(robot.recover, say("recovering_stopped", "Recovering was stopped.")),
        )

    async def _between_moves(self, work: Callable[[], Coroutine[Any, Any, None]], what: str) -> None:
        """Do it while a running game does not move."""
        game = self.playing
        await self._jogs.stop_all()
        if game is None:
            await self._interruptible(work(), what)
            return
        self._require_still(game)
        pausing = not game.arbiter.paused
        if pausing:
            await game.arbiter.pause()
        try:
            await self._interruptible(work(), what)
        finally:
            if pausing and self.playing is game:
                await game.arbiter.resume()

    @staticmethod
    def _require_still(game: LiveGame) -> None:
        if game.arbiter.moving:
            raise GameError(
                say("at_work", "The robot is at work."),
                hint=say("pause_and_finish", "Pause the game and finish the move first."),
            )

    async def jog(self, owner: str, direction: tuple[float, float, float], speed: float) -> None:
        """Keep moving, for ``owner`` alone; motion ends when the calls do.

        Args:
            owner: Who drives: whatever tells one client from the other.
            direction: Of any length.
            speed: mm/s.

        Raises:
            GameError: a game is being played and not paused, or a move is in hand.
            BusyError: somebody else drives.
            RobotError: as `Robot.jog`.
        """
        self._require_free()
        game = self.playing
        if game is not None and not game.arbiter.paused:
            raise GameError(
                say("game_moves", "The game moves the robot."), hint=say("pause_first", "Pause it first.")
            )
        if game is not None and (game.arbiter.moving or game.arbiter.state.pending is not None):
            raise GameError(
                say("in_hand", "A move is in hand."), hint=say("finish_first", "Finish it first.")
            )
        await self._jogs.jog(self.require_session().robot, owner, direction, speed)

    async def jog_stop(self, owner: str) -> None:
        """End the jogging of ``owner``; of anybody else nothing is ended. Returns at rest."""
        await self._jogs.stop(owner)

    async def owner_left(self, owner: str) -> None:
        """A client has gone: whatever it was jogging stops."""
        with suppress(KempelenError):
            await self._jogs.stop(owner)

    # --- the twin ---

    async def set_speed(self, speed: float) -> None:
        """Twin: time scale; 0 for as fast as it can. Games to come have it, too.

        Raises:
            ConfigError: out of range, or this is no twin.
        """
        config = changed(self._config, {"twin.speed": speed or "max"})
        live, session = self.live, self.session
        if not (self._config.on_twin if session is None else session.control):
            raise ConfigError(
                say("no_speed", "Only a twin has a speed to set."),
                hint=say("speed_in_settings", "A machine's is in its settings."),
            )
        if live is not None:
            await live.set_speed(f"{speed:g}" if speed else "max")
        elif session is not None and session.control is not None:
            await session.control.ask("speed", speed=speed)
        self._config = config
        self._tell(Change.STATION)

    async def hand_carry(self, source: tuple[float, float], target: tuple[float, float]) -> None:
        """Twin: the virtual hand carries the piece nearest to ``source``, legal or not; returns when it has.

        A camera has to see it: in a game without one, moves are made by `move`.

        Args:
            source: x, y, mm, robot frame, within 25 mm of a piece.
            target: x, y, mm.

        Raises:
            GameError: this is no twin, the robot is at work, nobody would see it, or the target lies
                beyond the table.
            TwinError: no piece is there.
        """
        session, game = self.require_session(), self.playing
        if session.control is None:
            raise GameError(
                say("no_virtual_hand", "Only the twin has a virtual hand."),
                hint=say("move_it_yourself", "Move the piece yourself."),
            )
        if (game is not None and game.arbiter.moving) or self.robot.phase in AT_WORK:
            raise GameError(
                say("at_work_over", "The robot is at work over the board."),
                hint=say("wait_moved", "Wait until it has moved."),
            )
        if game is not None and (self.eyes is None or not self.eyes.verifier.looks):
            raise GameError(
                say("nobody_sees", "Nobody would see it: this game is played without a camera."),
                hint=say("choose_move", "Choose the move instead."),
            )
        self._require_on_table(session, target)
        await session.control.ask("carry", **{"from": list(source), "to": list(target)})

    @staticmethod
    def _require_on_table(session: TableSession, target: tuple[float, float]) -> None:
        space = session.table.space
        for value, low, high in zip(target, space.lower, space.upper, strict=False):
            if not low - _REACH_MM <= value <= high + _REACH_MM:
                raise GameError(
                    say(
                        "off_table",
                        f"({target[0]:.0f}, {target[1]:.0f}) mm is off the table.",
                        x=round(target[0]),
                        y=round(target[1]),
                    ),
                    hint=say("stay_on_it", "Stay on it."),
                )
