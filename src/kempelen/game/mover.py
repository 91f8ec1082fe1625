"""Making moves on the table and in the game: intent, transfers, commit; and going on after an exit.

Each instant that matters is in the journal before it happens, so that the program may end anywhere.
"""

import asyncio
from typing import Literal

import chess

from kempelen.core import events
from kempelen.core.places import Transfer
from kempelen.core.table import Table
from kempelen.game.carrier import Carrier
from kempelen.game.journal import GameLog
from kempelen.game.observers import EventBus
from kempelen.game.person_desk import PersonDesk
from kempelen.game.records import Committed, Intended, LayoutChanged, Missed, OperatorNeeded, Purpose
from kempelen.game.recovery import Held, held
from kempelen.game.setting_up import setting_up_transfers
from kempelen.game.transfers import Missing, Request, move_transfers, takeback_transfers

_GLANCE_S = 3.0
"""A look past the hand takes a fraction of this; else the hand goes aside for it."""


class Mover:
    """Hand, person and journal together.

    Args:
        table: For choosing tray slots; may be replaced while no move is in hand.
    """

    def __init__(self, log: GameLog, carrier: Carrier, desk: PersonDesk, table: Table, bus: EventBus) -> None:
        self.table = table
        self._log = log
        self._carrier = carrier
        self._desk = desk
        self._bus = bus

    async def make(self, move: chess.Move, *, by_hand: bool = False, made: bool = False) -> None:
        """Play a legal move.

        Args:
            move: To play.
            by_hand: A person makes it.
            made: It is on the board already.
        """
        await self._do(Purpose.MOVE, move.uci(), by_hand=by_hand, made=made)

    async def take_back(self) -> None:
        """Undo the last move; the robot does, unless a person has done it on the board already."""
        by_hand = self._log.state.back_by_hand
        await self._do(Purpose.TAKEBACK, self._log.state.board.peek().uci(), by_hand=by_hand, made=by_hand)

    async def recover(self) -> None:
        """Make the hand ready, whatever the last exit left in it, and finish what was begun."""
        await self._empty_the_hand()
        await self._carrier.prepare()
        if (pending := self._log.state.pending) is not None:
            await self._finish(pending.intent)
        else:
            await self._go_on_deciding()

    async def inspect(self) -> None:
        """See that everything stands as the game has it, before anything is built on it."""
        if self._desk.eyes.looks:
            await self._desk.confirm((), self._log.state.layout)

    async def set_up(self) -> None:
        """Bring the pieces to where the game begins, should they stand elsewhere."""
        if not self._log.state.set_up:
            await self._do(Purpose.SETUP, "")

    async def _do(self, purpose: Purpose, uci: str, *, by_hand: bool = False, made: bool = False) -> None:
        transfers = await self._planned(purpose, uci, made=made)
        if by_hand:
            await self._step_aside()
        ply = self._ply(purpose)
        intent = Intended(purpose=purpose, ply=ply, uci=uci, transfers=transfers, by_hand=by_hand)
        self._log.write(intent)
        await self._finish(intent)

    def _ply(self, purpose: Purpose) -> int:
        return self._log.state.plies + (purpose is Purpose.MOVE)

    async def _planned(self, purpose: Purpose, uci: str, *, made: bool) -> tuple[Transfer, ...]:
        """The transfers; as long as the table lacks something for them, the operator is asked.

        Whoever has made the move already has seen to that without being asked.
        """
        while isinstance(planned := self._plan(purpose, uci), Request):
            if made:
                brought = planned.piece if isinstance(planned, Missing) else None
                self._log.write(LayoutChanged(place=planned.place, piece=brought, reason=planned.reason))
                continue
            await self._step_aside()
            need: Literal["supply", "remove"] = "supply" if isinstance(planned, Missing) else "remove"
            piece, place, ply = planned.piece, planned.place, self._ply(purpose)
            self._log.write(
                OperatorNeeded(purpose=purpose, ply=ply, uci=uci, need=need, piece=piece, place=place)
            )
            await self._desk.satisfy(planned)
        return planned

    async def _step_aside(self) -> None:
        """A person's hand comes to the table: the robot's must be clear of every piece, for certain."""
        if self._log.state.around is not None:
            await self._carrier.park()

    def _plan(self, purpose: Purpose, uci: str) -> tuple[Transfer, ...] | Request:
        board, layout = self._log.state.board, self._log.state.layout
        if purpose is Purpose.SETUP:
            return setting_up_transfers(board, layout, self.table)
        if purpose is Purpose.TAKEBACK:
            return takeback_transfers(board, layout, self.table)
        return move_transfers(board, board.parse_uci(uci), layout, self.table)

    async def _finish(self, intent: Intended) -> None:
        """Carry what is left of the move in hand, and commit it."""
        if intent.purpose is Purpose.SETUP:
            await self._finish_setting_up(intent)
            return
        board = self._log.state.board.copy()
        if intent.purpose is Purpose.TAKEBACK:
            board.pop()
        san = board.san(board.parse_uci(intent.uci))
        self._bus.emit(
            events.MoveProposed(
                intent.ply,
                board.turn,
                san,
                intent.uci,
                intent.transfers,
                by_hand=intent.by_hand,
                number=board.fullmove_number,
                takeback=intent.purpose is Purpose.TAKEBACK,
            )
        )
        await self._carry_all(intent)
        self._log.write(Committed(purpose=intent.purpose, ply=intent.ply, uci=intent.uci, san=san))
        self._announce(intent, san)

    async def _finish_setting_up(self, intent: Intended) -> None:
        fen = self._log.state.board.fen()
        self._bus.emit(events.SettingUp(intent.transfers, fen))
        await self._carry_all(intent)
        self._log.write(Committed(purpose=intent.purpose, ply=intent.ply, uci="", san=""))
        self._bus.emit(events.PositionSetUp(fen, self._log.state.layout))

    async def _carry_all(self, intent: Intended) -> None:
        if intent.by_hand:
            await self._desk.carry(intent.transfers, look=not self._more_taken_back(intent))
            return
        if self._carrier.pending.at_hand is not None:
            await self._desk.eyes.unobstructed()
        await self._carry_rest()
        await self._check(out_of_view=True)

    def _more_taken_back(self, intent: Intended) -> bool:
        """Whether a person has taken more back than this: the board shows how it was even earlier."""
        state = self._log.state
        earlier = state.back_by_hand and state.back_to is not None and intent.ply - 1 > state.back_to
        return intent.purpose is Purpose.TAKEBACK and earlier

    async def _carry_rest(self) -> None:
        while (transfer := self._carrier.pending.at_hand) is not None:
            if any(done.source == transfer.target for done in self._carrier.pending.done):
                await self._check(out_of_view=False)  # on a square that was not cleared it would hit a piece
                transfer = self._carrier.pending.at_hand or transfer
            await self._carrier.carry(transfer)

    async def _check(self, *, out_of_view: bool) -> None:
        """Look at what was carried so far: what was missed is carried again, once; all else is asked for.

        Args:
            out_of_view: Whether the hand goes aside in any case; else only where it hides the board.
        """
        tried, told = set[Transfer](), set[str]()
        while self._desk.eyes.looks:
            if out_of_view := out_of_view or bool(tried) or not await self._desk.eyes.in_view():
                await self._carrier.ready()
                await self._step_aside()
            done, standing = self._carrier.pending.done, self._log.state.layout
            try:
                async with asyncio.timeout(None if out_of_view else _GLANCE_S):
                    fault = await self._desk.eyes.confirm(done, standing)
            except TimeoutError:
                out_of_view = True  # the hand is at the edge of the view, and hides the board now and then
                continue
            if fault is None:
                return
            again = [transfer for transfer in fault.missed if transfer not in tried]
            if not again and await self._desk.put_right(fault, done, standing, told):
                return
            for transfer in again:
                tried.add(transfer)
                self._log.write(Missed(index=self._carrier.pending.transfers.index(transfer)))
                await self._carrier.carry(transfer)

    def _announce(self, intent: Intended, san: str) -> None:
        state = self._log.state
        fen, layout = state.board.fen(), state.layout
        if intent.purpose is Purpose.TAKEBACK:
            self._bus.emit(events.MoveTakenBack(intent.ply, san, fen, layout))
        else:
            mover = not state.board.turn
            self._bus.emit(events.MoveCommitted(intent.ply, mover, san, intent.uci, fen, layout))

    async def _go_on_deciding(self) -> None:
        """A move had been decided on and waited for the operator: ask again, then make it."""
        if self._log.state.needed is not None:
            await self._desk.satisfy(self._log.state.needed.request)
        if (decided := self._log.state.decided) is not None:
            await self._do(decided.purpose, decided.uci)

    async def _empty_the_hand(self) -> None:
        """Find the piece of the transfer at hand, and bring it to its target if it has left its source."""
        found = held(self._log.state, self._carrier.robot, self.table)
        if found is Held.UNKNOWN:
            await self._look()
        elif found is not Held.NOTHING and (transfer := self._carrier.pending.at_hand) is not None:
            arrive = self._carrier.finish_held if found is Held.PIECE else self._carrier.released
            await arrive(transfer)

    async def _look(self) -> None:
        """Somebody looks into the gripper; it may be closed on one of two pieces, or on none."""
        state = self._log.state
        at_hand = state.pending.at_hand if state.pending and state.pending.checkpoint else None
        if at_hand is not None and await self._desk.is_holding(at_hand):
            await self._carrier.finish_held(at_hand)
        elif state.around is not None and await self._desk.is_holding(state.around):
            await self._carrier.put_back(state.around)
        else:
            self._carrier.is_empty()
