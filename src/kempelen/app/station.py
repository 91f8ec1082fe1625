"""The station: one table with its robot and, one after another, its games. No HTTP, no views.

Any front end drives it: it calls the commands, shows what the attributes say, and is told by `Station.listen`
that something has changed, and by `Station.events` what happens in the game. Each command raises a
`KempelenError` with a reason when the present state forbids it, and then has changed nothing. Commands never
queue: while one takes its time (`Station.busy`), others that need the same table are refused. `Station.stop`
is never refused, and waits for nothing.
"""

import asyncio
from contextlib import suppress
from dataclasses import replace
from types import TracebackType
from typing import Self

import chess

from kempelen.app.calibrating import CalibrationDesk
from kempelen.app.cast import EngineWish, GameRequest
from kempelen.app.config import Config
from kempelen.app.config_change import changed
from kempelen.app.game_run import GameRun
from kempelen.app.live_game import LiveGame
from kempelen.app.paths import newest_unfinished
from kempelen.app.prompts import Prompts
from kempelen.app.report import GameReport
from kempelen.app.standing import setup_request, standing_after
from kempelen.app.station_eyes import StationEyes
from kempelen.app.station_types import CalibrationState, Change, GameOptions, Phase, Prompt
from kempelen.app.table_session import calibrated_table
from kempelen.core import events
from kempelen.core.errors import GameError, JournalError, KempelenError
from kempelen.core.places import Layout
from kempelen.core.words import say
from kempelen.game.clock import ClockReading
from kempelen.game.modes import speaker


class Station(StationEyes):
    """Async context manager; entering does nothing but make it usable: `connect` or `begin` come next.

    Args:
        config: Everything configured; `connect`, `begin` and `set_speed` override parts of it.

    Attributes:
        events: What happens in the running game (`kempelen.core.events`), of one game after the other.
        busy: What takes a while at the moment, in plain words; empty for nothing.
    """

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self._prompts = Prompts(lambda: self.live, lambda: self._tell(Change.PROMPTS))
        self._asked_for: tuple[GameRequest, GameOptions] | None = None
        self._calibrating = CalibrationDesk(self, lambda: self._tell(Change.CALIBRATION))

    async def __aenter__(self) -> Self:
        """Usable from now on."""
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """As `aclose`."""
        await self.aclose()

    async def aclose(self) -> None:
        """Robot at rest, game kept in the journal, port free, no process left."""
        if self._inner is not None:
            self._inner.cancel()
        if self._work is not None:
            await asyncio.gather(self._work, return_exceptions=True)
        await self._put_away()
        self.events.close()

    # --- what is ---

    @property
    def report(self) -> GameReport | None:
        """Of the game that is shown, once it is over."""
        return self._run.report if self._run is not None else None

    @property
    def prompts(self) -> tuple[Prompt, ...]:
        """What a person is asked or told, the oldest first."""
        return self._prompts.open

    @property
    def clock(self) -> ClockReading | None:
        """Of the game that is shown; None when it has none."""
        return self.live.arbiter.clock.read() if self.live is not None else None

    @property
    def calibration(self) -> CalibrationState:
        """The one in the making."""
        return self._calibrating.state

    @property
    def unfinished(self) -> int | None:
        """Number of the newest game of the journal that can be gone on with; None when there is none."""
        with suppress(JournalError):
            return newest_unfinished(self._config.data_dir)
        return None

    # --- games ---

    async def begin(self, request: GameRequest, options: GameOptions | None = None) -> int:
        """Begin a game; returns its number as soon as it is being played.

        The station's own table is put away for it; on the twin another one is set up.

        Raises:
            GameError: a game is being played.
            KempelenError: whatever is missing or does not fit.
        """
        self._require_no_game()
        options = options or GameOptions()
        config = changed(
            self._config,
            {
                "engine.path": options.engine,
                "engine.level": options.level,
                "engine.move_time": options.move_time,
                "play.hands": options.hands,
            },
        )
        request = replace(request, clock=options.clock or request.clock)
        number = await self._start(config, request)
        self._asked_for = request, options
        return number

    def left_standing(self, told: str) -> Layout:
        """Where the pieces are now, as for `kempelen.app.standing.standing_after`.

        Raises:
            KempelenError: as there.
        """
        return standing_after(self._config, calibrated_table(self._config), told)

    async def set_up(self, fen: str, told: str) -> int:
        """The robot sets up a position; the number of the game without moves that this is.

        Args:
            fen: The position wanted.
            told: Where the pieces are now, as for `left_standing`.

        Raises:
            GameError: a game is being played.
            KempelenError: as `left_standing` and `begin`.
        """
        self._require_no_game()
        return await self._start(self._config, setup_request(self._config, fen, told))

    @property
    def again(self) -> bool:
        """Whether the game that is over can be played once more."""
        return self._asked_for is not None and self.report is not None

    async def rematch(self, *, swapped: bool) -> int:
        """The game that is over once more, with the same players; its number.

        Args:
            swapped: Whether the person has the other colour now.

        Raises:
            GameError: there is none, or one is being played.
            KempelenError: as `begin`.
        """
        self._require_no_game()
        if self._asked_for is None or not self.again:
            raise GameError(
                say("no_rematch", "There is no game to play again."),
                hint=say("begin_or_resume", "Begin one, or resume one."),
            )
        request, options = self._asked_for
        return await self.begin(replace(request, person_plays=request.person_plays ^ swapped), options)

    async def resume_game(self, game: int | None = None, wish: EngineWish | None = None) -> int:
        """Go on with a game of the journal; also after an e-stop or an error.

        Args:
            game: Its number; None: the one that was cut off just now, or the newest unfinished one.
            wish: Other engines for it.

        Returns:
            Its number.

        Raises:
            GameError: a game is being played.
            JournalError: there is no such game, or it is over.
            KempelenError: whatever is missing or does not fit.
        """
        self._require_no_game()
        if game is None and self._run is not None and self._run.error is not None:
            game = self._run.live.arbiter.game
        number = newest_unfinished(self._config.data_dir) if game is None else game
        if self.live is None or self.live.arbiter.game != number:
            self._asked_for = None
        return await self._start(self._config, number, wish)

    async def _start(self, config: Config, request: GameRequest | int, wish: EngineWish | None = None) -> int:
        live = LiveGame(config, request, self._prompts.ask, wish)
        return await self._do(
            say("busy_game", "Setting up the game …"),
            lambda: self._begin(live, new=isinstance(request, GameRequest)),
            Phase.STARTING,
        )

    async def _begin(self, live: LiveGame, *, new: bool) -> int:
        had_table = self.session is not None
        await self._put_away()
        try:
            await self._interruptible(
                self._come_up(live, new=new), say("game_setup_stopped", "Setting up the game was stopped.")
            )
        except KempelenError:
            if had_table:
                with suppress(KempelenError):  # it stays as a fault
                    await self._set_up()
            raise
        live.arbiter.events.listen(self._hear)
        live.cast.person.changed = lambda: self._tell(Change.GAME)
        self._run = GameRun(live, self._after_game)
        self._attend(live.session.robot)
        return live.arbiter.game

    async def _come_up(self, live: LiveGame, *, new: bool) -> None:
        """The game's table; a twin of our own is homed, unless there may be a piece in its gripper."""
        await live.__aenter__()
        if new:
            try:
                with suppress(KempelenError):  # the game tries again, and says what is wrong
                    await self._home_own_twin(live.session)
            except BaseException:
                await live.__aexit__(None, None, None)
                raise

    async def leave_game(self) -> None:
        """Robot at rest, game kept unless it is over; the station has its own table again.

        Raises:
            GameError: there is none.
            KempelenError: the game was left, but the table cannot be set up again.
        """
        if self._run is None:
            raise GameError(
                say("no_game_to_leave", "There is no game to leave."),
                hint=say("begin_or_resume", "Begin one, or resume one."),
            )
        await self._do(say("busy_leaving", "Leaving the game …"), self._leave, Phase.LEAVING)

    async def _leave(self) -> None:
        await self._put_away()
        await self._set_up()

    async def _before_putting_away(self) -> None:
        await super()._before_putting_away()
        self._calibrating.forget()
        self._prompts.clear()

    def _hear(self, event: events.Event) -> None:
        """What the game tells: first to the prompts, then to everybody, then that something has changed."""
        self._prompts.hear(event)
        self.events.emit(event)
        match event:
            case events.EngineThinking():
                pass
            case events.RobotChanged():
                self._tell(Change.ROBOT)
            case events.SensorChanged() | events.HandOverBoard():
                self._tell(Change.EYES)
                self._look_for_faults()
            case _:
                self._tell(Change.GAME)

    def _after_game(self) -> None:
        """It is over, or was cut off."""
        self._prompts.clear()
        self._calibrating.forget()
        self._tell(Change.STATION, Change.GAME)

    # --- commands to the running game ---

    def _game(self) -> LiveGame:
        game = self.playing
        if game is None:
            raise GameError(
                say("no_game", "No game is being played."),
                hint=say("begin_or_resume", "Begin one, or resume one."),
            )
        return game

    def _side(self) -> chess.Color:
        arbiter = self._game().arbiter
        return speaker(arbiter.pairing.people, arbiter.state.board.turn)

    async def pause(self) -> None:
        """Stop at once, also with a piece in the gripper; returns at rest."""
        await self._game().arbiter.pause()

    async def resume(self) -> None:
        """Go on.

        Raises:
            GameError: no game is being played, or the board is being measured.
        """
        if self.calibration.active:
            raise GameError(
                say("being_measured", "The board is being measured."),
                hint=say("end_calibration", "Apply or cancel the calibration."),
            )
        game = self._game()
        await self._jogs.stop_all()
        if self._jogs.strayed and game.arbiter.paused and not game.arbiter.moving:
            await game.session.robot.retract()
        self._jogs.strayed = False
        await game.arbiter.resume()

    async def finish(self) -> None:
        """While paused: complete the move in hand."""
        await self._jogs.stop_all()
        await self._game().arbiter.finish_move()

    async def takeback(self, plies: int | None = None) -> None:
        """Undo half-moves on the table; returns when they are undone, in a pause not before it is over.

        Args:
            plies: How many; None: to where a person was last to move.
        """
        await self._game().arbiter.takeback(plies)

    async def resign(self) -> None:
        """The person's side gives up; in a game of two persons the side to move."""
        await self._game().arbiter.resign(self._side())

    async def offer_draw(self) -> bool:
        """The person's side offers a draw; whether it was agreed."""
        return await self._game().arbiter.offer_draw(self._side())

    async def swap_mode(self, request: GameRequest) -> None:
        """Other players take over; everything played so far is kept. See `LiveGame.swap_mode`."""
        await self._game().swap_mode(request)

    async def move(self, text: str, ply: int | None = None) -> chess.Move:
        """A move of the person; on the twin with a camera the virtual hand makes it on the board.

        Args:
            text: In any notation.
            ply: Half-moves played when it was chosen.

        Raises:
            GameError: no game is being played, it is not a person's turn, or the game has gone on since.
            NotationError: the move cannot be read, or is illegal.
        """
        game = self._game()
        played, person = game.arbiter.state.plies, game.cast.person
        if ply is not None and ply != played:
            raise GameError(
                say(
                    "move_stale",
                    f"This move was chosen after {ply} half-moves, and {played} have been played.",
                    chosen=ply,
                    played=played,
                ),
                hint=say("choose_again", "Look at the board and choose again."),
            )
        if not person.to_move:
            raise GameError(
                say("not_your_turn", "It is not your turn."),
                hint=say("wait_your_turn", "Wait until the other side has moved."),
            )
        return person.submit(text)

    async def answer(self, prompt: str, text: str) -> None:
        """Answer a prompt: anything (``do``), yes or no (``yes_no``, ``draw``), a move (``which_move``).

        Raises:
            GameError: it is not open any more, needs no answer, or this is none.
            NotationError: the move cannot be read, or is illegal.
        """
        self._prompts.answer(prompt, text)

    # --- calibration ---

    async def bumped(self) -> str:
        """Measure the board again by camera, in mid-game; what came of it, in a sentence."""
        return await self._game().board_was_bumped()

    async def calibration_begin(self) -> None:
        """Measure the board anew; a running game is paused, and its move finished first.

        The hand rises and closes; from then on jogging is allowed.

        Raises:
            GameError: one is being made already.
            NotHomedError: home the robot first.
            KempelenError: the move in hand could not be finished.
        """
        await self._do(
            say("busy_measuring", "Getting ready to measure the board …"),
            lambda: self._interruptible(
                self._calibrating.begin(), say("measuring_stopped", "Measuring the board was stopped.")
            ),
        )

    async def calibration_touch(self, corner: str) -> None:
        """The closed fingertips are at this outer corner now: a1, h1, h8 or a8.

        Raises:
            GameError: no calibration is being made.
            RobotError: the robot is not at rest, or does not know where it is.
        """
        self._calibrating.touch(corner)

    async def calibration_by_camera(self) -> None:
        """Find the board by the camera whose place over the robot is known; the hand goes aside first."""
        await self._jogs.stop_all()
        await self._do(say("busy_looking", "Looking for the board …"), self._calibrating.by_camera)

    async def calibration_apply(self, square: float | None = None) -> None:
        """Keep it, and use it from now on; the hand rises and parks, and a game that was paused goes on.

        Args:
            square: Side of a square, mm, where it is known.

        Raises:
            CalibrationError: it cannot be those of a board.
            FitError: on that board something does not fit.
        """
        await self._jogs.stop_all()
        await self._do(
            say("busy_keeping", "Keeping the calibration …"), lambda: self._calibrating.apply(square)
        )

    async def calibration_cancel(self) -> None:
        """Keep the one before; the hand rises and parks, and a game that was paused goes on."""
        await self._jogs.stop_all()
        await self._do(say("busy_parking", "Parking …"), self._calibrating.cancel)
