"""One game from the command to its report: everything wired together, run, measured and put away."""

import time
from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import replace
from itertools import takewhile
from typing import TYPE_CHECKING, Self

import chess

from kempelen.app.arm_reach import tilts_told
from kempelen.app.calibration_file import save_calibration
from kempelen.app.camera_pose import shift_of
from kempelen.app.cameras import twin_camera
from kempelen.app.cast import Cast, EngineWish, GameRequest, score_of
from kempelen.app.config import Config
from kempelen.app.fitting import tilts
from kempelen.app.measure import MeasuredPlayer, Measurements
from kempelen.app.paths import journal_path, pgn_path, twin_state_path
from kempelen.app.people import Ask, Helpful, Operator, VirtualPerson
from kempelen.app.remeasure import board_by_camera, table_as_measured
from kempelen.app.report import GameReport
from kempelen.app.robot_defaults import require_same_robot
from kempelen.app.speed import parse_speed
from kempelen.app.table_session import TableSession, calibrated_table, digest, twin_speed
from kempelen.app.touch_up import TouchUp
from kempelen.core.calibration import Calibration
from kempelen.core.errors import ConfigError, GameError
from kempelen.core.events import Event, GameOver
from kempelen.core.places import Layout
from kempelen.core.protocols import RobotPhase, RobotState
from kempelen.core.table import Table, start_layout
from kempelen.core.words import say
from kempelen.game.arbiter import Arbiter
from kempelen.game.board_person import BoardPerson
from kempelen.game.fen import parse_fen
from kempelen.game.game_log import PgnKeeper
from kempelen.game.journal import GameLog, Journal
from kempelen.game.modes import Mode, Pairing, TakeOver
from kempelen.game.observers import EventBus
from kempelen.game.opening import new_game
from kempelen.game.options import ArbiterOptions
from kempelen.game.pgn import GameScore
from kempelen.game.players import PersonPlayer
from kempelen.game.records import HandEmpty, Helped, Purpose
from kempelen.game.state import GameState
from kempelen.twin.keeping import StateLock

if TYPE_CHECKING:
    from kempelen.app.eyes import GameEyes


class LiveGame:
    """A game on a table that is up. Async context manager.

    Args:
        config: Everything configured.
        request: A new game, or the number of one in the journal.
        ask: Puts a question to the person at hand.
        wish: Other engines for a game of the journal.

    Attributes:
        arbiter: Owns the game.
        cast: Its players.
        measurements: Taken between moves.
        eyes: That look at the board; None without.
        pgn: File that holds the game so far.
        notices: What the person should know before it begins.
    """

    def __init__(
        self, config: Config, request: GameRequest | int, ask: Ask, wish: EngineWish | None = None
    ) -> None:
        self._config = config
        self._request = request
        self._ask = ask
        self.notices: list[str] = []
        self._stack = AsyncExitStack()
        self._pace = twin_speed(config)
        self._started = time.monotonic()
        self._ended = False
        self._bus: EventBus | None = None
        self.eyes = self._opened_eyes()
        self.cast = Cast(config, self._stack, wish, self._watched_person())

    def _tell(self, event: Event) -> None:
        """To whoever watches the game, once there is one."""
        if self._bus is not None:
            self._bus.emit(event)

    def _opened_eyes(self) -> "GameEyes | None":
        if not self._config.has_eyes:
            return None
        from kempelen.app.eyes import GameEyes  # noqa: PLC0415 - most games have none, and begin sooner so

        return GameEyes(self._config, self._tell)

    def _watched_person(self) -> PersonPlayer | None:
        """One whose moves are seen."""
        return None if self.eyes is None else BoardPerson(self.eyes.reader)

    async def _make_by_hand(self, board: chess.Board, move: chess.Move) -> None:
        if isinstance(self.person, VirtualPerson) and self.eyes is not None:
            await self.eyes.awake()
            await self.person.play(board, move)

    async def __aenter__(self) -> Self:
        """Set everything up: the journal, the engine, the table.

        Raises:
            KempelenError: whatever is missing or does not fit.
        """
        try:
            await self._set_up()
        except BaseException:
            await self._stack.aclose()
            raise
        return self

    async def _set_up(self) -> None:
        table = calibrated_table(self._config)
        if told := tilts_told(tilts(self._config, table)):
            self.notices.append(told)
        journal = self._stack.enter_context(Journal(journal_path(self._config.data_dir)))
        if isinstance(self._request, GameRequest):
            await self._begin(journal, table, self._request)
        else:
            await self._go_on(journal, table, self._request)

    async def _begin(self, journal: Journal, table: Table, request: GameRequest) -> None:
        """A new game; it is in the journal only once there is a table to play it on."""
        pairing, take_over = await self.cast.pairing(request), await self.cast.take_over(request)
        layout = request.standing or start_layout(table, parse_fen(request.start_fen))
        await self._table_up(journal.next_game, table, layout, kept=None)
        kind, hands = self._config.robot.kind, self._config.hands
        options = ArbiterOptions(hands=hands, table_digest=digest(table), robot=kind)
        headers = dict(request.score.headers) if request.score else {}
        log = new_game(
            journal, pairing, table,
            start_fen=request.start_fen, headers=headers, take_over=take_over, options=options,
            clock=request.clock, layout=request.standing,
        )  # fmt: skip
        self._wire_up(log, table, pairing, take_over, options)

    async def _go_on(self, journal: Journal, table: Table, game: int) -> None:
        """A game of the journal."""
        log = journal.reopen(game)
        require_same_robot(log.state.begun.robot, self._config.robot.kind, game)
        pairing = await self.cast.again(log.state.pairing)
        take_over = await self.cast.take_over_again(log.state.take_over)
        options = ArbiterOptions(hands=log.state.begun.hands, table_digest=digest(table))
        await self._table_up(game, table, log.state.layout, kept=log)
        self._wire_up(log, table, pairing, take_over, options)

    async def _table_up(self, game: int, table: Table, layout: Layout, *, kept: GameLog | None) -> None:
        """The twin or the machine; ``kept`` is the game whose table may be there from its last program."""
        self._twin_state = twin_state_path(self._config.data_dir, game)
        if self._config.on_twin:
            await StateLock.released(self._twin_state)
        resume = self._config.on_twin and kept is not None and self._table_kept(kept)
        camera = twin_camera(self._config) if self.eyes is not None else None
        self.session = await self._stack.enter_async_context(
            TableSession(self._config, table, layout, state=self._twin_state, resume=resume, camera=camera)
        )
        if self.eyes is not None:
            await self._stack.enter_async_context(await self.eyes.open(self.session))

    def _wire_up(
        self,
        log: GameLog,
        table: Table,
        pairing: Pairing,
        take_over: TakeOver | None,
        options: ArbiterOptions,
    ) -> None:
        # Ground truth and person know the true table: a calibration may be wrong, and must then show.
        true_table = self._config.build_table() if self.session.control is not None else table
        self.measurements = Measurements(true_table, self.session.control)
        self.person = self._person(true_table, lambda: should_stand(log.state))
        typist = self.cast.person
        if isinstance(typist, BoardPerson) and isinstance(self.person, VirtualPerson):
            typist.maker = self._make_by_hand if self._config.hands == "person" else None
        self.arbiter = Arbiter(
            log, self.session.hand, self._measured(pairing), table,
            person=Helpful(self.person, log.write), options=options,
            verifier=self.eyes.verifier if self.eyes else None,
            take_over=TakeOver(take_over.ply, self._measured(take_over.pairing)) if take_over else None,
        )  # fmt: skip
        self._bus = self.arbiter.events
        self.cast.time_left = self.arbiter.clock.left
        if self.eyes is not None:
            self.arbiter.events.listen(self.eyes.listen)
            self.eyes.busy, self.eyes.near = lambda: self.arbiter.moving, lambda: log.state.around is not None
            self.eyes.position = lambda: self.board
            self.eyes.bumped = self.arbiter.pause
            self.arbiter.events.listen(TouchUp(self.session, self.eyes).hear)
        self.arbiter.events.listen(self.measurements.listen)
        self.pgn = pgn_path(self._config.data_dir, log.game).absolute()
        self.arbiter.events.listen(PgnKeeper(self.pgn, lambda: log.state))

    def _table_kept(self, log: GameLog) -> bool:
        """Whether the twin's table is there as the last program left it; if it was lost, say so first.

        A twin that was killed itself takes its table with it. The virtual person then sets up another one as
        the journal has it, any piece in the gripper back on its source; the journal knows before it happens.
        """
        kept = self._twin_state.exists()
        if not kept and log.state.touched:
            log.write(Helped(how="set up the table again"))
            log.write(HandEmpty())
            self.notices.append(
                f"The table of game {log.game} was lost with its twin's process; "
                "the virtual person has set up another one as the journal has it."
            )
        return kept

    def _person(self, table: Table, layout: Callable[[], Layout]) -> Operator | VirtualPerson:
        if self.session.control is None:
            return Operator(self._ask)
        return VirtualPerson(table, self.session.control, layout)

    def _measured(self, pairing: Pairing) -> Pairing:
        if self.session.control is None:
            return pairing
        white, black = (MeasuredPlayer(pairing[colour], self.measurements) for colour in (True, False))
        return Pairing(pairing.mode, white, black)

    # --- for those who look on ------------------------------------------------------------------------------

    @property
    def layout(self) -> Layout:
        """What stands where, as the journal has it."""
        return self.arbiter.state.layout

    @property
    def board(self) -> chess.Board:
        """The committed moves; not to be changed."""
        return self.arbiter.state.board

    @property
    def robot(self) -> RobotState:
        """The robot's latest state."""
        return self.session.robot.state

    @property
    def length(self) -> int | None:
        """Half-moves of the score that is being replayed; None in other modes."""
        score = score_of(self.arbiter.pairing.white.spec)
        return len(score.moves) if score else None

    @property
    def seconds_left(self) -> float | None:
        """Until the motion at hand should end, s; None when nothing moves, or faster than can be told."""
        if not self._pace or self.robot.phase is not RobotPhase.MOVING:
            return None
        return self.session.hand.seconds_left(self._pace)

    # --- what may be asked of it ----------------------------------------------------------------------------

    async def swap_mode(self, request: GameRequest) -> None:
        """Other players take over; everything played so far is kept.

        A replay for which no score is named is that of the score that the game began with.

        Raises:
            GameError: the game so far is not that of the score.
            KempelenError: as `Cast.pairing`.
        """
        if request.mode is Mode.REPLAY:
            request = replace(request, score=request.score or self._first_score())
            if request.score is not None:
                self._must_follow(request.score)
        await self.arbiter.swap_mode(self._measured(await self.cast.pairing(request)))

    def _first_score(self) -> GameScore | None:
        begun = self.arbiter.state.begun
        score = score_of(begun.pairing.white)
        return score and replace(score, headers=begun.headers)

    def _must_follow(self, score: GameScore) -> None:
        """Refuse a score that has no next move for the game, the move in hand included."""
        state = self.arbiter.state
        played = list(state.board.move_stack)
        if state.pending is not None and state.pending.intent.purpose is Purpose.MOVE:
            played.append(chess.Move.from_uci(state.pending.intent.uci))
        same = sum(
            1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(played, score.moves, strict=False))
        )
        if score.start_fen != state.begun.start_fen:
            raise GameError(
                say("other_score", "The score begins from another position."),
                hint=say("new_replay", "Begin a new game: kempelen replay"),
            )
        if same < len(played):
            raise GameError(
                say(
                    "left_score",
                    f"The game has left the score after {same} half-moves; {len(played)} have been played.",
                    same=same,
                    played=len(played),
                ),
                hint=say(
                    "take_back_to_score",
                    f"Take back to where they part: takeback {len(played) - same}",
                    plies=len(played) - same,
                ),
            )

    async def set_speed(self, text: str) -> None:
        """Another pace for the twin.

        Raises:
            ConfigError: this is no pace, or this is no twin.
        """
        speed = parse_speed(text)
        if self.session.control is None:
            raise ConfigError(
                say("no_speed", "Only a twin has a speed to set."),
                hint=say("speed_in_settings", "A machine's is in its settings."),
            )
        await self.session.control.ask("speed", speed=speed)
        self._pace = speed

    # --- eyes -----------------------------------------------------------------------------------------------

    def require_eyes(self) -> "GameEyes":
        """The game's eyes.

        Raises:
            GameError: it has none.
        """
        if self.eyes is None:
            raise GameError(
                say("no_camera", "This game has no camera."),
                hint=say("resume_with_camera", "Resume it with one: --camera uvc:0"),
            )
        return self.eyes

    async def board_was_bumped(self) -> str:
        """Measure the board again, by the camera alone, and go on with the same game; what came of it.

        Raises:
            GameError: there is no camera, or a move is in hand.
            KempelenError: the board cannot be measured, or does not fit where it is now.
        """
        eyes, paused = self.require_eyes(), self.arbiter.paused
        if not paused:
            await self.arbiter.pause()
        try:
            said = await self._measure_again(eyes)
        finally:
            if not paused:
                await self.arbiter.resume()
        return said

    async def _measure_again(self, eyes: "GameEyes") -> str:
        before = self.session.table
        calibration = await board_by_camera(self._config, eyes, before)
        await self.use_calibration(calibration)
        moved = shift_of(before.robot_from_board, calibration.robot_from_board, before.square)
        return f"The board has moved by {moved:.1f} mm at its farthest corner; the robot knows it now."

    async def use_calibration(self, calibration: Calibration) -> None:
        """Go on with the same game on the board as it was measured now, and keep the measurement.

        Raises:
            FitError: something does not fit where the board is now.
            GameError: a move is in hand.
            CalibrationError: the measurement cannot be kept.
        """
        table = table_as_measured(self._config, calibration)
        await self.arbiter.change_table(table, digest(table))
        self.session.use(table)
        save_calibration(self._config.calibration_path, calibration)

    async def play(self) -> GameReport:
        """To the end.

        Raises:
            StoppedError: it was stopped; the game can be resumed.
        """
        self._started = time.monotonic()
        if not self.arbiter.state.set_up:
            await self.measurements.sample()  # what the robot sets up is its work, too
        state = self.arbiter.state
        if self.eyes is not None and state.set_up and state.pending is None and not state.board.move_stack:
            await self.eyes.begin_right(state.layout, lambda: self.arbiter.stopped)
        over = await self.arbiter.run()
        self._ended = True
        await self.measurements.sample()
        return self.report(over)

    def report(self, over: GameOver | None = None) -> GameReport:
        """What has been measured; of a game that goes on another time when ``over`` is None."""
        return self.measurements.report(self.arbiter, over, wall=time.monotonic() - self._started)

    async def __aexit__(self, *exc: object) -> None:
        """Robot at rest, engines ended, twin put away; a finished game's twin is forgotten."""
        await self._stack.aclose()
        if self._ended:
            self._twin_state.unlink(missing_ok=True)
            self._twin_state.with_suffix(".lock").unlink(missing_ok=True)


def should_stand(state: GameState) -> Layout:
    """What a person at the table sees to: the journal's layout, and a move by hand as if it were made."""
    layout = state.layout
    if state.pending is not None and state.pending.intent.by_hand:
        for transfer in state.pending.transfers:
            layout = layout.after(transfer)
    return layout
