"""One game from the command to its report: everything wired together, run, measured and put away."""

import time
from collections.abc import Callable
from contextlib import AsyncExitStack
from typing import Self

from kempelen.app.cast import Cast, GameRequest
from kempelen.app.config import Config
from kempelen.app.measure import MeasuredPlayer, Measurements
from kempelen.app.paths import journal_path, pgn_path, twin_state_path
from kempelen.app.people import Ask, Operator, VirtualPerson
from kempelen.app.report import GameReport
from kempelen.app.table_session import TableSession, calibrated_table, digest
from kempelen.core.errors import JournalError
from kempelen.core.places import Layout
from kempelen.core.table import Table
from kempelen.game.arbiter import Arbiter, ArbiterOptions
from kempelen.game.game_log import PgnKeeper
from kempelen.game.journal import GameLog, Journal
from kempelen.game.modes import Pairing, TakeOver
from kempelen.game.opening import new_game


class LiveGame:
    """A game on a table that is up. Async context manager.

    Args:
        config: Everything configured.
        ask: Puts a question to the person at hand.

    Attributes:
        arbiter: Owns the game.
        cast: Its players.
        measurements: Taken between moves.
    """

    def __init__(self, config: Config, request: GameRequest | int, ask: Ask) -> None:
        self._config = config
        self._request = request
        self._ask = ask
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
        options = ArbiterOptions(hands=self._config.play.hands, table_digest=digest(table))
        if isinstance(self._request, GameRequest):
            pairing = await self.cast.pairing(self._request)
            take_over = await self.cast.take_over(self._request)
            fen, headers = (
                self._request.start_fen,
                dict(self._request.score.headers if self._request.score else {}),
            )
            log = new_game(
                journal, pairing, table,
                start_fen=fen, headers=headers, take_over=take_over, options=options,
            )  # fmt: skip
        else:
            log = journal.reopen(self._request)
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
        state = twin_state_path(self._config.data_dir, log.game)
        resume = not isinstance(self._request, GameRequest)
        if resume and self._config.on_twin and not state.exists():
            raise JournalError(
                f"The twin's table of game {log.game} is not kept in {state}.",
                hint="Begin a new game from its position: kempelen play --fen FEN",
            )
        self._twin_state = state
        self.session = await self._stack.enter_async_context(
            TableSession(self._config, table, log.state.begun.layout, state=state, resume=resume)
        )
        self.measurements = Measurements(table, self.session.twin)
        self.person = self._person(table, lambda: log.state.layout)
        self.arbiter = Arbiter(
            log, self.session.hand, self._measured(pairing), table,
            person=self.person, options=options,
            take_over=TakeOver(take_over.ply, self._measured(take_over.pairing)) if take_over else None,
        )  # fmt: skip
        self.arbiter.events.listen(self.measurements.listen)
        self.arbiter.events.listen(PgnKeeper(pgn_path(self._config.data_dir, log.game), lambda: log.state))

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
        return self.measurements.report(
            self.arbiter, over, interventions=self.person.interventions, wall=wall
        )

    _ended = False

    async def __aexit__(self, *exc: object) -> None:
        """Robot at rest, engines ended, twin put away; a finished game's twin is forgotten."""
        await self._stack.aclose()
        if self._ended:
            self._twin_state.unlink(missing_ok=True)
            self._twin_state.with_suffix(".lock").unlink(missing_ok=True)
