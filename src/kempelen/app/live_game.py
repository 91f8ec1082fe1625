"""One game from the command to its report: everything wired together, run, measured and put away."""

import time
from collections.abc import Callable
from contextlib import AsyncExitStack
from typing import Self

from kempelen.app.cast import Cast, GameRequest
from kempelen.app.config import Config
from kempelen.app.measure import MeasuredPlayer, Measurements
from kempelen.app.paths import journal_path, pgn_path, twin_state_path
from kempelen.app.people import Ask, Helpful, Operator, VirtualPerson
from kempelen.app.report import GameReport
from kempelen.app.table_session import TableSession, calibrated_table, digest
from kempelen.core.places import Layout
from kempelen.core.table import Table
from kempelen.game.arbiter import Arbiter, ArbiterOptions
from kempelen.game.game_log import PgnKeeper
from kempelen.game.journal import GameLog, Journal
from kempelen.game.modes import Pairing, TakeOver
from kempelen.game.opening import new_game
from kempelen.game.records import HandEmpty, Helped
from kempelen.twin.keeping import StateLock


class LiveGame:
    """A game on a table that is up. Async context manager.

    Args:
        config: Everything configured.
        ask: Puts a question to the person at hand.

    Attributes:
        arbiter: Owns the game.
        cast: Its players.
        measurements: Taken between moves.
        notice: What the person should know before it begins; mostly empty.
    """

    def __init__(self, config: Config, request: GameRequest | int, ask: Ask) -> None:
        self._config = config
        self._request = request
        self._ask = ask
        self.notice = ""
        self._stack = AsyncExitStack()
        self.cast = Cast(config, self._stack)

    async def __aenter__(self) -> Self:
        """Set everything up: engine first, then the journal, then the table.

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
        journal = self._stack.enter_context(Journal(journal_path(self._config.data_dir)))
        if isinstance(self._request, GameRequest):
            pairing = await self.cast.pairing(self._request)
            take_over = await self.cast.take_over(self._request)
            fen, headers = (
                self._request.start_fen,
                dict(self._request.score.headers if self._request.score else {}),
            )
            options = ArbiterOptions(hands=self._config.play.hands, table_digest=digest(table))
            log = new_game(
                journal, pairing, table,
                start_fen=fen, headers=headers, take_over=take_over, options=options,
            )  # fmt: skip
        else:
            log = journal.reopen(self._request)
            options = ArbiterOptions(hands=log.state.begun.hands, table_digest=digest(table))
            pairing = await self.cast.again(log.state.pairing)
            take_over = await self.cast.take_over_again(log.state.take_over)
        await self._bring_up(log, table, pairing, take_over, options)

    async def _bring_up(
        self,
        log: GameLog,
        table: Table,
        pairing: Pairing,
        take_over: TakeOver | None,
        options: ArbiterOptions,
    ) -> None:
        self._twin_state = twin_state_path(self._config.data_dir, log.game)
        kept = await self._table_kept(log)
        self.session = await self._stack.enter_async_context(
            TableSession(self._config, table, log.state.layout, state=self._twin_state, resume=kept)
        )
        self.measurements = Measurements(table, self.session.twin)
        person = self._person(table, lambda: log.state.layout)
        self.arbiter = Arbiter(
            log, self.session.hand, self._measured(pairing), table,
            person=Helpful(person, log.write), options=options,
            take_over=TakeOver(take_over.ply, self._measured(take_over.pairing)) if take_over else None,
        )  # fmt: skip
        self.arbiter.events.listen(self.measurements.listen)
        self.arbiter.events.listen(PgnKeeper(pgn_path(self._config.data_dir, log.game), lambda: log.state))

    async def _table_kept(self, log: GameLog) -> bool:
        """Whether the twin's table is there as the last program left it; if it was lost, say so first.

        A twin that was killed itself takes its table with it. The virtual person then sets up another one as
        the journal has it, any piece in the gripper back on its source; the journal knows before it happens.
        """
        if not self._config.on_twin:
            return False
        await StateLock.released(self._twin_state)
        kept = log.resumed and self._twin_state.exists()
        if log.resumed and not kept and log.state.touched:
            log.write(Helped(how="set up the table again"))
            log.write(HandEmpty())
            self.notice = (
                f"The table of game {log.game} was lost with its twin's process; "
                "the virtual person has set up another one as the journal has it."
            )
        return kept

    def _person(self, table: Table, layout: Callable[[], Layout]) -> Operator | VirtualPerson:
        if self.session.twin is None:
            return Operator(self._ask)
        return VirtualPerson(table, self.session.twin.control, layout)

    def _measured(self, pairing: Pairing) -> Pairing:
        if self.session.twin is None:
            return pairing
        white, black = (MeasuredPlayer(pairing[colour], self.measurements) for colour in (True, False))
        return Pairing(pairing.mode, white, black)

    @property
    def layout(self) -> Layout:
        """What stands where, as the journal has it."""
        return self.arbiter.state.layout

    async def swap_mode(self, request: GameRequest) -> None:
        """Other players take over; everything played so far is kept."""
        await self.arbiter.swap_mode(self._measured(await self.cast.pairing(request)))

    async def play(self) -> GameReport:
        """To the end.

        Raises:
            StoppedError: it was stopped; the game can be resumed.
        """
        started = time.monotonic()
        over = await self.arbiter.run()
        await self.measurements.sample()
        wall = time.monotonic() - started
        self._ended = True
        return self.measurements.report(self.arbiter, over, wall=wall)

    _ended = False

    async def __aexit__(self, *exc: object) -> None:
        """Robot at rest, engines ended, twin put away; a finished game's twin is forgotten."""
        await self._stack.aclose()
        if self._ended:
            self._twin_state.unlink(missing_ok=True)
            self._twin_state.with_suffix(".lock").unlink(missing_ok=True)
