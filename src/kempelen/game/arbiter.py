"""The arbiter: turn order, legality, pause, other modes, takebacks, and the end of the game.

The life of a move: a player proposes it, the arbiter checks it, has it made and committed
(`kempelen.game.mover`), and asks the next player. One task, `Arbiter.run`, does all of this; commands from
terminals and pages come in by the other methods, at any time, and are obeyed between moves, a pause at once.
"""

import asyncio

import chess

from kempelen.core import events
from kempelen.core.errors import ConfigError, EngineError, GameError, StoppedError
from kempelen.core.protocols import Hand, Person, Thinking
from kempelen.core.table import Table
from kempelen.core.words import say
from kempelen.game.carrier import Carrier
from kempelen.game.draws import DrawOffers
from kempelen.game.journal import GameLog
from kempelen.game.modes import Pairing, TakeOver
from kempelen.game.mover import Mover
from kempelen.game.notation import why_illegal
from kempelen.game.observers import EventBus
from kempelen.game.options import ArbiterOptions
from kempelen.game.orders import Orders
from kempelen.game.outcomes import by_agreement, by_resignation, by_score, by_time, end_of
from kempelen.game.person_desk import PersonDesk
from kempelen.game.players import Player, Proposal, Propose, Resign, TakenBack
from kempelen.game.records import (
    Ended,
    ModeSwapped,
    Paused,
    Reopened,
    Resumed,
    TableChanged,
    TakebackAsked,
)
from kempelen.game.state import GameState
from kempelen.game.tasks import Gate, unless
from kempelen.game.turn_clock import TurnClock
from kempelen.game.verify import Trust, Verifier


class Arbiter:
    """Owns one game.

    Args:
        log: The game in the journal, new (`kempelen.game.opening.new_game`) or reopened (`Journal.reopen`).
        hand: Entered; carries transfers.
        pairing: Who plays whom; in a resumed game it may be another one than before.
        table: Where the places are.
        person: Answers when only a person can go on, and makes moves when ``options.hands`` is "person".
        take_over: Another pairing that takes over at a ply.
        verifier: Looks at the table before a move counts; None: the hand is trusted.

    Attributes:
        events: What happens, for observers.
        clock: The chess clock.
    """

    def __init__(
        self,
        log: GameLog,
        hand: Hand,
        pairing: Pairing,
        table: Table,
        *,
        person: Person | None = None,
        take_over: TakeOver | None = None,
        options: ArbiterOptions | None = None,
        verifier: Verifier | None = None,
    ) -> None:
        self.events = EventBus()
        self.clock = TurnClock(log, self.events)
        self._log = log
        self._pairing = pairing
        self._take_over = take_over
        self._options = options or ArbiterOptions()
        if self._options.hands == "person" and person is None:
            raise ConfigError("Moves by a person's own hand need a person.", hint="Use --hands robot.")
        self._gate = Gate()
        self._carrier = Carrier(log, hand, self.events, self._gate)
        desk = PersonDesk(log, person, verifier or Trust(), self.events)
        self._mover = Mover(log, self._carrier, desk, table, self.events)
        self._orders = Orders()
        self._proposal: Proposal | None = None
        self._draws = DrawOffers(self.events)
        self._task: asyncio.Task[object] | None = None
        self._pausing = asyncio.Lock()
        self._held = False
        self._stopped = False

    # --- what is ----------------------------------------------------------------------------------

    @property
    def game(self) -> int:
        """Number in the journal."""
        return self._log.game

    @property
    def state(self) -> GameState:
        """The game as the journal has it."""
        return self._log.state

    @property
    def pairing(self) -> Pairing:
        """Who plays whom."""
        return self._pairing

    @property
    def moving(self) -> bool:
        """Whether the robot is at work, or held in mid-motion."""
        return self._carrier.moving

    @property
    def paused(self) -> bool:
        """Whether the game is paused."""
        return self._gate.paused

    # --- the game ---------------------------------------------------------------------------------

    @property
    def stopped(self) -> bool:
        """Whether the game was cut off."""
        return self._stopped

    async def run(self) -> events.GameOver:
        """Play, or go on with, the game to its end.

        Cancelled or failed: the robot is at rest and the journal can be resumed.

        Raises:
            StoppedError: `stop` was called.
            KempelenError: Whatever a player, the robot or the journal could not mend by itself.
        """
        if self._task is not None:
            raise GameError("An arbiter runs one game, once.", hint="Make a new one from the journal.")
        self._task = asyncio.current_task()
        try:
            await self._begin()
            await self._play()
            return self._over()
        except asyncio.CancelledError:
            if not self._stopped:
                raise
            raise StoppedError(
                say("game_stopped", "The game was stopped."), hint=f"Resume: kempelen resume {self.game}"
            ) from None
        finally:
            self._close()

    async def _begin(self) -> None:
        state, specs = self.state, self._pairing.spec
        for place in state.layout:
            self._mover.table.centre(place)  # raises when the table has no such place
        if self._log.resumed:
            self._log.write(Reopened(program=self._options.program))
        if state.table != self._options.table_digest:
            self._log.write(TableChanged(table=self._options.table_digest))
        take_over = self._take_over.spec if self._take_over else None
        if (state.pairing, state.take_over) != (specs, take_over):
            self._log.write(ModeSwapped(pairing=specs, take_over=take_over))
        self.events.emit(
            events.GameStarted(
                game=self.game,
                mode=specs.mode,
                white=specs.white.name,
                black=specs.black.name,
                fen=state.board.fen(),
                layout=state.layout,
                plies=state.plies,
                resumed=self._log.resumed,
            )
        )
        await self._mover.recover()
        self._gate.move_done()
        await self._finish_takeback()
        if not (self._log.resumed and self.state.board.turn in self._pairing.people):
            await self._mover.inspect()  # a person may have begun a move, which is nothing wrong
        await self._mover.set_up()
        await self._clear_away()

    async def _play(self) -> None:
        while self.state.ended is None:
            if await self._orders.obey_one(paused=self.paused):
                continue
            if self.paused:
                await unless(self._orders.came, self._gate.passed())
            elif (ended := self._concluded()) is not None:
                await self._conclude(ended)
            else:
                await self._turn()

    def _concluded(self) -> Ended | None:
        return end_of(self.state.board, claim_draws=self._pairing.claims_draws)

    def _over(self) -> events.GameOver:
        ended = self.state.ended
        if ended is None:
            raise GameError("The game is not over.")
        over = events.GameOver(ended.result, ended.reason)
        self.events.emit(over)
        return over

    def _close(self) -> None:
        self._orders.close()
        self._draws.close()
        self._gate.open()
        self.events.close()

    # --- a turn -----------------------------------------------------------------------------------

    async def _turn(self) -> None:
        """Ask the side to move, and do what it proposes; an order in between ends the turn."""
        self._maybe_take_over()
        board = self.state.board
        player = self._pairing[board.turn]
        if self._proposal is None:
            self.events.emit(events.TurnBegan(board.turn, player.spec.name, board.fen()))
            deciding = unless(self._orders.came, player.propose(board.copy(), self._thought))
            self._proposal = await self.clock.during(board.turn, deciding)
            if self.clock.fallen(board.turn):
                await self._conclude(by_time(board, board.turn))
                return
        # Paused while the player thought: the proposal waits for the game to go on, or for another order.
        if self._proposal is not None and not self.paused and not self._orders:
            proposal, self._proposal = self._proposal, None
            await self._act_on(proposal, player)

    def _thought(self, thinking: Thinking) -> None:
        self.events.emit(events.EngineThinking(self.state.board.turn, thinking))

    def _maybe_take_over(self) -> None:
        if self._take_over is not None and self.state.board.ply() >= self._take_over.ply:
            self._swap(self._take_over.pairing, None)

    async def _act_on(self, proposal: Proposal, player: Player) -> None:
        colour = self.state.board.turn
        if isinstance(proposal, Propose):
            await self._make(proposal, player)
        elif isinstance(proposal, TakenBack):
            await self._take_back(proposal.plies, by_hand=True)
        elif isinstance(proposal, Resign):
            await self._conclude(by_resignation(colour))
        else:
            await self._conclude(by_score(proposal.result))

    async def _make(self, proposal: Propose, player: Player) -> None:
        board, move = self.state.board, proposal.move
        if move not in board.legal_moves:
            raise EngineError(
                f"{player.spec.name} proposed {move.uci()}, which is illegal: {why_illegal(board, move)}.",
                hint="Choose another engine; the game is in the journal and can be resumed.",
            )
        by_hand = self._options.hands == "person" and player.spec.kind == "person"
        await self._mover.make(move, by_hand=by_hand or proposal.made, made=proposal.made)
        self._draws.moved(not self.state.board.turn)
        await self._clear_away()

    async def _clear_away(self) -> None:
        """After a move: out of the camera's view."""
        if self._options.park and self.state.around is not None and self._concluded() is None:
            await self._gate.passed()
            await self._carrier.park()
        self._gate.move_done()

    # --- commands ---------------------------------------------------------------------------------

    async def pause(self) -> None:
        """Stop at once, also in mid-transfer with a piece in the gripper; returns with the robot at rest."""
        self._must_run()
        async with self._pausing:
            if self.paused and not self._gate.finishing:
                return
            self._gate.close()
            self.clock.pause()
            self._held = self._carrier.moving
            if self._held:
                await self._carrier.hand.hold()
            self._log.write(Paused())
        self._tell_paused()

    def _tell_paused(self) -> None:
        self.events.emit(events.Paused(in_transfer=self.state.pending is not None))
        self.events.emit(events.RobotChanged(self._carrier.robot))

    async def resume(self) -> None:
        """Go on after `pause`."""
        self._must_run()
        async with self._pausing:
            if not self.paused:
                return
            self._log.write(Resumed())
            self._gate.open()
            self.clock.resume()
            await self._release()
        self.events.emit(events.Resumed())

    async def finish_move(self) -> None:
        """While paused: complete the move in hand, all its transfers, then stay paused.

        Raises:
            GameError: The game is not paused, or the move could not be completed.
        """
        self._must_run()
        async with self._pausing:
            if not self.paused:
                raise GameError(
                    say("not_paused", "The game is not paused."), hint=say("pause_first", "Pause it first.")
                )
            if self.state.pending is None and not self._carrier.moving:
                return
            finished = self._gate.finish()
            await self._release()
        await asyncio.shield(finished)
        if self.state.pending is not None:
            raise GameError(
                say("not_completed", "The move in hand was not completed."),
                hint=say("finish_or_resume", "Finish it, or resume."),
            )
        self._tell_paused()

    async def _release(self) -> None:
        if self._held:
            self._held = False
            await self._carrier.hand.resume()

    async def swap_mode(self, pairing: Pairing, take_over: TakeOver | None = None) -> None:
        """Other players take over, after the move in hand; everything played so far is kept."""

        async def swap() -> None:
            self._swap(pairing, take_over)

        self._must_run()
        await self._orders.give(swap)

    def _swap(self, pairing: Pairing, take_over: TakeOver | None) -> None:
        spec = pairing.spec
        self._log.write(ModeSwapped(pairing=spec, take_over=take_over.spec if take_over else None))
        self._pairing, self._take_over, self._proposal = pairing, take_over, None
        self.events.emit(events.ModeSwapped(spec.mode, spec.white.name, spec.black.name))

    async def takeback(self, plies: int | None = None) -> None:
        """Undo half-moves, on the table too; returns when they are undone.

        Args:
            plies: How many; None: back to where a person was last to move.

        Raises:
            GameError: So many have not been played.
        """
        self._must_run()
        await self._orders.give(lambda: self._take_back(plies), moves_robot=True)

    async def _take_back(self, plies: int | None, *, by_hand: bool = False) -> None:
        count = self._plies_to_person() if plies is None else plies
        if not 1 <= count <= self.state.plies:
            raise GameError(
                say(
                    "takeback_too_many",
                    f"{count} half-moves cannot be taken back: {self.state.plies} have been played.",
                    plies=count,
                    played=self.state.plies,
                ),
                hint=f"Ask for 1 to {self.state.plies}." if self.state.plies else "",
            )
        self._proposal = None
        self._log.write(TakebackAsked(plies=self.state.plies - count, by_hand=by_hand))
        await self._finish_takeback()

    def _plies_to_person(self) -> int:
        people = self._pairing.people
        own = self.state.board.turn in people and len(people) == 1
        return 2 if own else 1

    async def _finish_takeback(self) -> None:
        while self.state.back_to is not None:
            await self._gate.passed()
            await self._mover.take_back()
            await self._clear_away()

    async def resign(self, colour: chess.Color) -> None:
        """``colour`` gives up; a move in hand is finished first."""
        self._must_run()
        await self._orders.give(lambda: self._conclude(by_resignation(colour)))

    async def offer_draw(self, colour: chess.Color) -> bool:
        """``colour`` offers a draw; whether it was agreed. The offer lapses with the opponent's next move.

        Raises:
            GameError: An offer is open already, or the game is not running.
        """
        self._must_run()
        board = self.state.board.copy()
        agreed = await self._draws.offer(colour, self._pairing[not colour], board)
        if agreed:
            await self._orders.give(lambda: self._conclude(by_agreement()))
        return agreed

    async def _conclude(self, ended: Ended) -> None:
        """Leave the last piece alone, so that nothing is left to do after the end."""
        if self.state.around is not None and not self.paused:
            await self._carrier.park()
        self._log.write(ended)

    async def change_table(self, table: Table, digest: str, hand: Hand | None = None) -> None:
        """The table was measured again: go on with the same game on it.

        Args:
            table: As measured.
            digest: Identifies it in the journal.
            hand: The hand that knows the new table, prepared; None: the same one as before.

        Raises:
            GameError: A move is in hand; finish it first.
            FitError: The new table lacks a place on which a piece stands.
        """
        self._must_run()
        if self.state.pending is not None or self._carrier.moving:
            raise GameError(
                say("in_hand", "A move is in hand."),
                hint=say("pause_and_finish", "Pause and finish the move first."),
            )
        for place in self.state.layout:
            table.centre(place)
        self._log.write(TableChanged(table=digest))
        self._mover.table = table
        if hand is not None:
            self._carrier.hand = hand

    async def stop(self) -> None:
        """E-stop: all motion ends now, and `run` with it. The game can be resumed from the journal."""
        self._stopped = True
        try:
            await self._carrier.hand.stop()
        finally:
            if self._task is not None and not self._task.done():
                self._task.cancel()

    def _must_run(self) -> None:
        if self._task is None or self._task.done() or self.state.ended is not None:
            raise GameError(
                say("not_running", "The game is not running."),
                hint=say("begin_or_resume", "Start or resume it first."),
            )
