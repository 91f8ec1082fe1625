"""Who lends a hand when the robot cannot: the operator at the table, or the twin's virtual person."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import chess

from kempelen.core.pieces import piece_name
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import Person
from kempelen.core.table import Table
from kempelen.core.words import Words, joined, say
from kempelen.game.records import Helped, Record
from kempelen.game.transfers import Missing, Request, move_transfers
from kempelen.twin.client import Door


@dataclass(frozen=True, slots=True)
class Question:
    """What a person is asked.

    Attributes:
        text: In plain words.
        kind: ``do``: do what it says, then give any answer; ``yes_no``.
        piece: That it is about, if it is about one.
        place: That it is about.
    """

    text: str
    kind: Literal["do", "yes_no"] = "do"
    piece: chess.Piece | None = None
    place: Place | None = None

    def __str__(self) -> str:
        """For somebody at a terminal."""
        return f"{self.text} (y/n)" if self.kind == "yes_no" else f"{self.text} Press Enter when it is done."


Ask = Callable[[Question], Awaitable[str]]
YES = frozenset({"y", "yes", "j", "ja", "a", "ano"})
NO = frozenset({"n", "no", "nein", "ne"})


class Operator:
    """A person at a real table, asked in words.

    Args:
        ask: Puts a question and returns what was answered.
    """

    def __init__(self, ask: Ask) -> None:
        self._ask = ask

    async def carry(self, transfers: Sequence[Transfer]) -> None:
        """Wait until the person has made the move."""
        first, *then = transfers
        text = joined(_step(first), *(joined(say("then", "Then:"), _step(transfer)) for transfer in then))
        await self._ask(Question(text, piece=first.piece, place=first.target))

    async def supply(self, piece: chess.Piece, place: Place, reason: str) -> None:
        """Wait until the piece stands there."""
        name, where = piece_name(piece), str(place)
        text = joined(reason, say("stand_on", f"Stand a {name} on {where}.", piece=piece, place=where))
        await self._ask(Question(text, piece=piece, place=place))

    async def remove(self, piece: chess.Piece, place: Place, reason: str) -> None:
        """Wait until the place is empty."""
        name, where = piece_name(piece), str(place)
        text = joined(reason, say("take_off", f"Take the {name} off {where}.", piece=piece, place=where))
        await self._ask(Question(text, piece=piece, place=place))

    async def put_right(self, request: str) -> None:
        """Wait until the table is as the sentence says."""
        await self._ask(Question(request))

    async def is_holding(self, piece: chess.Piece) -> bool:
        """Ask; a sensorless robot cannot know after a reset."""
        question = Question(
            say("holding", f"Is the {piece_name(piece)} in the gripper?", piece=piece), "yes_no", piece
        )
        return (await self._ask(question)).strip().lower() in YES


def _step(transfer: Transfer) -> Words:
    piece, source, target = transfer.piece, str(transfer.source), str(transfer.target)
    text = f"Move the {piece_name(piece)} from {source} to {target}."
    return say("carry", text, piece=piece, source=source, target=target)


class VirtualPerson:
    """The twin's person: has eyes (the ground truth) and a hand (the physics), like somebody at a real table.

    Args:
        table: Where the places are.
        control: The twin's side door.
        layout: What the game says stands where; asked when the table is to be put right.

    Attributes:
        manner: How own moves are made, asked for each piece (`kempelen.twin.physics.person.manner`).
    """

    def __init__(self, table: Table, control: Door, layout: Callable[[], Layout]) -> None:
        self.manner: Callable[[Transfer], Mapping[str, object]] = lambda _: {}
        self._table = table
        self._control = control
        self._layout = layout

    def _at(self, place: Place) -> list[float]:
        x, y, _ = self._table.centre(place)
        return [float(x), float(y)]

    async def _stands(self, piece: chess.Piece, place: Place) -> bool:
        truth = await self._control.ask("truth")
        x, y = self._at(place)
        return any(
            abs(p["x"] - x) < self._table.square / 2
            and abs(p["y"] - y) < self._table.square / 2
            and (p["kind"], p["white"]) == (piece.symbol().upper(), piece.color)
            for p in truth["pieces"]
        )

    async def carry(self, transfers: Sequence[Transfer]) -> None:
        """Make a move by hand; what was already done before a restart is left as it is."""
        for transfer in transfers:
            if not await self._stands(transfer.piece, transfer.target):
                where = {"from": self._at(transfer.source), "to": self._at(transfer.target)}
                await self._control.ask("carry", **where, **self.manner(transfer))

    async def play(self, board: chess.Board, move: chess.Move) -> None:
        """Make a move of one's own, with all that it needs: a `kempelen.game.board_person.Maker`."""
        layout = self._layout()
        while isinstance(plan := move_transfers(board, move, layout, self._table), Request):
            if isinstance(plan, Missing):
                await self.supply(plan.piece, plan.place, plan.reason)
                layout = layout.having(plan.place, plan.piece)
            else:
                await self.remove(plan.piece, plan.place, plan.reason)
                layout = layout.without(plan.place)
        await self.carry(plan)

    async def supply(self, piece: chess.Piece, place: Place, reason: str) -> None:  # noqa: ARG002 - asked of all
        """Bring a piece out of the drawer."""
        if not await self._stands(piece, place):
            await self._control.ask(
                "supply", kind=piece.symbol().upper(), white=piece.color, to=self._at(place)
            )

    async def remove(self, piece: chess.Piece, place: Place, reason: str) -> None:  # noqa: ARG002 - asked of all
        """Put a piece into the drawer."""
        if await self._stands(piece, place):
            await self._control.ask("remove", **{"from": self._at(place)})

    async def put_right(self, request: str) -> None:  # noqa: ARG002 - asked of all
        """Carry every piece that is not where the game says to where it belongs."""
        for place, piece in self._layout().items():
            if not await self._stands(piece, place) and (stray := await self._stray(piece)) is not None:
                await self._control.ask("carry", **{"from": stray, "to": self._at(place)})

    async def _stray(self, piece: chess.Piece) -> list[float] | None:
        """Where a piece of that kind stands that no place of the game accounts for."""
        truth = await self._control.ask("truth")
        homes = [self._at(place) for place, other in self._layout().items() if other == piece]
        near = self._table.square / 2
        for p in truth["pieces"]:
            same = (p["kind"], p["white"]) == (piece.symbol().upper(), piece.color)
            if same and not any(abs(p["x"] - x) < near and abs(p["y"] - y) < near for x, y in homes):
                return [p["x"], p["y"]]
        return None

    async def is_holding(self, piece: chess.Piece) -> bool:
        """Look whether the piece hangs between the pads."""
        truth = await self._control.ask("truth")
        x, y, z = truth["tool"]
        return any(
            abs(p["x"] - x) < self._table.gripper.opening / 2
            and abs(p["y"] - y) < self._table.gripper.opening / 2
            and p["z"] < z < p["z"] + self._table.pieces[piece.piece_type].height
            and (p["kind"], p["white"]) == (piece.symbol().upper(), piece.color)
            for p in truth["pieces"]
        )


class Helpful:
    """A person whose every help is written to the journal: the robot should not need any.

    Args:
        person: Who helps.
        write: Puts a record into the game's journal.
    """

    def __init__(self, person: Person, write: Callable[[Record], None]) -> None:
        self._person = person
        self._write = write

    async def carry(self, transfers: Sequence[Transfer]) -> None:
        """A move by the player's own hand is no help."""
        await self._person.carry(transfers)

    async def supply(self, piece: chess.Piece, place: Place, reason: str) -> None:
        """Bring a piece."""
        await self._person.supply(piece, place, reason)
        self._write(Helped(how=f"brought the {piece_name(piece)} to {place}"))

    async def remove(self, piece: chess.Piece, place: Place, reason: str) -> None:
        """Take a piece away."""
        await self._person.remove(piece, place, reason)
        self._write(Helped(how=f"took the {piece_name(piece)} off {place}"))

    async def put_right(self, request: str) -> None:
        """Put right what stands wrong."""
        await self._person.put_right(request)
        self._write(Helped(how=request))

    async def is_holding(self, piece: chess.Piece) -> bool:
        """Look into the gripper."""
        holding = await self._person.is_holding(piece)
        self._write(Helped(how=f"saw {'the' if holding else 'no'} {piece_name(piece)} in the gripper"))
        return holding


class Answers:
    """Questions to the person at the terminal, answered with the next typed line.

    Args:
        say: Shows a sentence.

    Attributes:
        question: The one that waits for its answer; empty when none does.
        wanted: Set while one waits.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._open: asyncio.Future[str] | None = None
        self.question = ""
        self.wanted = asyncio.Event()

    @property
    def waiting(self) -> bool:
        """Whether the next typed line is an answer."""
        return self._open is not None

    async def ask(self, question: Question) -> str:
        """Show a question and wait."""
        self._say(str(question))
        self._open, self.question = asyncio.get_running_loop().create_future(), str(question)
        self.wanted.set()
        try:
            return await self._open
        finally:
            self._open, self.question = None, ""
            self.wanted.clear()

    def answer(self, text: str) -> None:
        """Give the answer."""
        if self._open is not None and not self._open.done():
            self._open.set_result(text)
