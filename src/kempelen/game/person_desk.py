"""When only a person can go on: ask, wait, remember that it is done."""

import asyncio
from collections.abc import Coroutine, Sequence

from kempelen.core import events
from kempelen.core.errors import OperatorNeededError
from kempelen.core.pieces import piece_name
from kempelen.core.places import Layout, Transfer
from kempelen.core.protocols import Person
from kempelen.core.words import joined, say
from kempelen.game.journal import GameLog
from kempelen.game.observers import EventBus
from kempelen.game.records import Helped, LayoutChanged
from kempelen.game.transfers import Missing, Request
from kempelen.game.verify import Fault, Verifier


class PersonDesk:
    """The person at the table, asked in plain words.

    Args:
        person: None: nobody is there, and the game stops where somebody is needed.
        verifier: Looks at the table.

    Attributes:
        eyes: The verifier.
    """

    def __init__(self, log: GameLog, person: Person | None, verifier: Verifier, bus: EventBus) -> None:
        self._log = log
        self._person = person
        self.eyes = verifier
        self._bus = bus

    def _somebody(self, request: str) -> Person:
        if self._person is None:
            raise OperatorNeededError(
                joined(say("person_needed", "A person is needed."), request),
                hint=say("resume_with_somebody", "Resume the game with somebody at the table."),
            )
        return self._person

    async def carry(self, transfers: Sequence[Transfer], *, look: bool = True) -> None:
        """Have the move made by hand; one that can be seen on the board already needs nobody.

        Args:
            transfers: What the move is made of.
            look: Not where the board is known to be further on: another half-move was taken back as well.
        """
        standing = self._log.state.layout
        for transfer in transfers:
            standing = standing.after(transfer)
        if look and not await self._is_made(transfers, standing):
            person = self._somebody(say("by_hand", "Make the move by hand."))
            await self._seen_before(person.carry(transfers), transfers, standing)
            await self.confirm(transfers, standing)
        for transfer in transfers:
            self._bus.emit(events.TransferDone(transfer, standing))

    async def _is_made(self, transfers: Sequence[Transfer], standing: Layout) -> bool:
        return self.eyes.looks and await self.eyes.confirm(transfers, standing) is None

    async def satisfy(self, request: Request) -> None:
        """Have done what a move needs, and remember it."""
        self._bus.emit(events.OperatorAsked(request.text, request.piece, request.place))
        person, piece = self._somebody(request.text), None
        if isinstance(request, Missing):
            await person.supply(request.piece, request.place, request.reason)
            piece = request.piece
        else:
            await person.remove(request.piece, request.place, request.reason)
        self._log.write(LayoutChanged(place=request.place, piece=piece, reason=request.reason))
        self._bus.emit(events.OperatorAnswered(request.text))

    async def is_holding(self, transfer: Transfer) -> bool:
        """Have somebody look into the gripper."""
        name = piece_name(transfer.piece)
        text = say(
            "look_into_gripper",
            f"Look whether the gripper holds the {name} on its way {transfer}.",
            piece=transfer.piece,
            source=str(transfer.source),
            target=str(transfer.target),
        )
        self._bus.emit(events.OperatorAsked(text, transfer.piece, transfer.target))
        holding = await self._somebody(text).is_holding(transfer.piece)
        self._bus.emit(events.OperatorAnswered(text))
        return holding

    async def confirm(self, transfers: Sequence[Transfer], standing: Layout) -> None:
        """Go on only when the table shows what should stand there; until then somebody puts it right."""
        told = set[str]()
        while fault := await self.eyes.confirm(transfers, standing):
            if await self.put_right(fault, transfers, standing, told):
                return

    async def put_right(
        self, fault: Fault, transfers: Sequence[Transfer], standing: Layout, told: set[str]
    ) -> bool:
        """Ask for help; that it was given may be told, or seen.

        Args:
            fault: What is wrong.
            transfers: Just made.
            standing: What should stand where.
            told: Faults that a person has said to have put right; this one is added.

        Returns:
            Whether a person's word is to be taken that all is right: where nothing can be made out, or where
            the same is found wrong again.
        """
        self._bus.emit(events.OperatorAsked(fault.text, fault.piece, fault.place))
        person = self._somebody(fault.text)
        seen = await self._seen_before(person.put_right(fault.text), transfers, standing)
        if seen:
            self._log.write(Helped(how=fault.text))
        self._bus.emit(events.OperatorAnswered(fault.text))
        word = not seen and (fault.doubtful or fault.text in told)
        told.add(fault.text)
        return seen or word

    async def _seen_before(
        self, work: Coroutine[object, object, None], transfers: Sequence[Transfer], standing: Layout
    ) -> bool:
        """A person at work, until it is told or seen to be done; whether it was seen first."""
        if not self.eyes.looks:
            await work
            return False
        told = asyncio.ensure_future(work)
        seen = asyncio.ensure_future(self._agreement(transfers, standing))
        try:
            await asyncio.wait({told, seen}, return_when=asyncio.FIRST_COMPLETED)
            for task in (told, seen):
                if task.done():
                    task.result()
            return not told.done()
        finally:
            for task in (told, seen):
                task.cancel()
            await asyncio.gather(told, seen, return_exceptions=True)

    async def _agreement(self, transfers: Sequence[Transfer], standing: Layout) -> None:
        """Until the table shows what should stand there."""
        while await self.eyes.confirm(transfers, standing):
            pass
