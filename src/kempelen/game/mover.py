"""Making moves on the table and in the game: intent, transfers, commit; and going on after an exit.

Each instant that matters is in the journal before it happens, so that the program may end anywhere.
"""

from typing import Literal

import chess

from kempelen.core import events
from kempelen.core.places import Transfer
from kempelen.core.table import Table
from kempelen.game.carrier import Carrier
from kempelen.game.helpers import PersonDesk
from kempelen.game.journal import GameLog
from kempelen.game.observers import EventBus
from kempelen.game.records import Committed, Intended, OperatorNeeded, Phase, Purpose
from kempelen.game.recovery import Whereabouts, whereabouts
from kempelen.game.transfers import Missing, Request, move_transfers, takeback_transfers


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

    async def make(self, move: chess.Move, *, by_hand: bool = False) -> None:
        """Play a legal move."""
        await self._do(Purpose.MOVE, move.uci(), by_hand=by_hand)

    async def take_back(self) -> None:
        """Undo the last move."""
        await self._do(Purpose.TAKEBACK, self._log.state.board.peek().uci())

    async def recover(self) -> None:
        """Make the hand ready, whatever the last exit left in it, and finish what was begun."""
        pending = self._log.state.pending
        if pending is None:
            await self._carrier.prepare()
            await self._go_on_deciding()
        else:
            await self._reconcile()
            await self._finish(pending.intent)

    async def _do(self, purpose: Purpose, uci: str, *, by_hand: bool = False) -> None:
        transfers = await self._planned(purpose, uci)
        ply = self._ply(purpose)
        intent = Intended(purpose=purpose, ply=ply, uci=uci, transfers=transfers, by_hand=by_hand)
        self._log.write(intent)
        await self._finish(intent)

    def _ply(self, purpose: Purpose) -> int:
        return self._log.state.plies + (purpose is Purpose.MOVE)

    async def _planned(self, purpose: Purpose, uci: str) -> tuple[Transfer, ...]:
        """The transfers; as long as the table lacks something for them, the operator is asked."""
        while isinstance(planned := self._plan(purpose, uci), Request):
            need: Literal["supply", "remove"] = "supply" if isinstance(planned, Missing) else "remove"
            piece, place, ply = planned.piece, planned.place, self._ply(purpose)
            self._log.write(
                OperatorNeeded(purpose=purpose, ply=ply, uci=uci, need=need, piece=piece, place=place)
            )
            await self._desk.satisfy(planned)
        return planned

    def _plan(self, purpose: Purpose, uci: str) -> tuple[Transfer, ...] | Request:
        board, layout = self._log.state.board, self._log.state.layout
        if purpose is Purpose.TAKEBACK:
            return takeback_transfers(board, layout, self.table)
        return move_transfers(board, board.parse_uci(uci), layout, self.table)

    async def _finish(self, intent: Intended) -> None:
        """Carry what is left of the move in hand, and commit it."""
        board = self._log.state.board.copy()
        if intent.purpose is Purpose.TAKEBACK:
            board.pop()
        san = board.san(board.parse_uci(intent.uci))
        self._bus.emit(
            events.MoveProposed(
                intent.ply, board.turn, san, intent.uci, intent.transfers, by_hand=intent.by_hand
            )
        )
        await self._carry_all(intent)
        self._log.write(Committed(purpose=intent.purpose, ply=intent.ply, uci=intent.uci, san=san))
        self._announce(intent, san)

    async def _carry_all(self, intent: Intended) -> None:
        if intent.by_hand:
            await self._desk.carry(intent.transfers)
            return
        while (transfer := self._carrier.pending.at_hand) is not None:
            await self._carrier.carry(transfer)
            await self._confirm(transfer)

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

    async def _reconcile(self) -> None:
        """Find the piece of the transfer at hand, and leave the hand empty and the piece on a place."""
        pending = self._carrier.pending
        transfer = pending.at_hand
        if transfer is None or pending.intent.by_hand:
            await self._carrier.prepare()
            return
        where = whereabouts(pending, self._carrier.robot)
        if where is Whereabouts.UNKNOWN:
            arrived = Whereabouts.TARGET if pending.phase is Phase.RELEASED else Whereabouts.SOURCE
            where = Whereabouts.HELD if await self._desk.is_holding(transfer) else arrived
        await self._settle(where, transfer)

    async def _settle(self, where: Whereabouts, transfer: Transfer) -> None:
        if where is Whereabouts.HELD:
            await self._carrier.finish_held(transfer)
            await self._confirm(transfer)
            return
        self._carrier.note(Phase.RELEASED if where is Whereabouts.TARGET else Phase.STANDING)
        await self._carrier.prepare()
        if where is Whereabouts.TARGET:
            self._carrier.cleared(transfer, None)
            await self._confirm(transfer)

    async def _confirm(self, transfer: Transfer) -> None:
        await self._desk.confirm(transfer, self._log.state.layout)
