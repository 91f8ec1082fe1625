"""When only a person can go on: ask, wait, remember that it is done."""

from kempelen.core import events
from kempelen.core.errors import OperatorNeededError
from kempelen.core.pieces import piece_name
from kempelen.core.places import Layout, Transfer
from kempelen.core.protocols import Person
from kempelen.game.journal import GameLog
from kempelen.game.observers import EventBus
from kempelen.game.records import LayoutChanged
from kempelen.game.transfers import Missing, Request
from kempelen.game.verify import Verifier


class PersonDesk:
    """The person at the table, asked in plain words.

    Args:
        person: None: nobody is there, and the game stops where somebody is needed.
        verifier: Looks at the table.
    """

    def __init__(self, log: GameLog, person: Person | None, verifier: Verifier, bus: EventBus) -> None:
        self._log = log
        self._person = person
        self._verifier = verifier
        self._bus = bus

    def _somebody(self, request: str) -> Person:
        if self._person is None:
            raise OperatorNeededError(
                f"A person is needed. {request}", hint="Resume the game with somebody at the table."
            )
        return self._person

    async def carry(self, transfers: tuple[Transfer, ...]) -> None:
        """Have the move made by hand."""
        layout = self._log.state.layout
        await self._somebody("Make the move by hand.").carry(transfers)
        for transfer in transfers:
            layout = layout.after(transfer)
            self._bus.emit(events.TransferDone(transfer, layout))
        await self.confirm(None, layout)

    async def satisfy(self, request: Request) -> None:
        """Have done what a move needs, and remember it."""
        self._bus.emit(events.OperatorAsked(str(request), request.piece, request.place))
        person, piece = self._somebody(str(request)), None
        if isinstance(request, Missing):
            await person.supply(request.piece, request.place, request.reason)
            piece = request.piece
        else:
            await person.remove(request.piece, request.place, request.reason)
        self._log.write(LayoutChanged(place=request.place, piece=piece, reason=request.reason))
        self._bus.emit(events.OperatorAnswered(str(request)))

    async def is_holding(self, transfer: Transfer) -> bool:
        """Have somebody look into the gripper."""
        text = f"Look whether the gripper holds the {piece_name(transfer.piece)} on its way {transfer}."
        self._bus.emit(events.OperatorAsked(text, transfer.piece, transfer.target))
        holding = await self._somebody(text).is_holding(transfer.piece)
        self._bus.emit(events.OperatorAnswered(text))
        return holding

    async def confirm(self, transfer: Transfer | None, standing: Layout) -> None:
        """Go on only when the table shows what should stand there; until then somebody puts it right."""
        while fault := await self._verifier.confirm(transfer, standing):
            self._bus.emit(events.OperatorAsked(fault))
            await self._somebody(fault).put_right(fault)
            self._bus.emit(events.OperatorAnswered(fault))
