"""A table, a journal and an arbiter, for tests of the arbiter."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager

import chess

from kempelen.core import events
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.table import Table
from kempelen.game.arbiter import Arbiter, ArbiterOptions
from kempelen.game.journal import Journal
from kempelen.game.modes import Mode, Pairing, TakeOver
from kempelen.game.opening import new_game
from kempelen.game.pgn import parse_game
from kempelen.game.players import PersonPlayer
from kempelen.testing.hands import FakeHand, FakePerson, FakeTable, Step
from kempelen.testing.players import ScriptedPlayer

TABLE = Table()
FOOLS_MATE = ("f3", "e5", "g4", "Qh4#")


class Bench:
    """A table, a journal, an arbiter at work."""

    def __init__(
        self,
        journal: Journal,
        pairing: Pairing,
        *,
        fen: str = chess.STARTING_FEN,
        table: Table = TABLE,
        person: bool = True,
        take_over: TakeOver | None = None,
        options: ArbiterOptions | None = None,
        verifier: "Sequence[str] | None" = None,
    ) -> None:
        self.log = new_game(journal, pairing, table, start_fen=fen, take_over=take_over, options=options)
        self.world = FakeTable(self.log.state.layout, self._before_step)
        self.hand = FakeHand(self.world)
        self.person = FakePerson(self.world)
        self.eyes = Eyes(verifier) if verifier is not None else None
        self.arbiter = Arbiter(
            self.log,
            self.hand,
            pairing,
            table,
            person=self.person if person else None,
            take_over=take_over,
            options=options,
            verifier=self.eyes,
        )
        self.seen: list[events.Event] = []
        self.arbiter.events.listen(self.seen.append)
        self._stop_at: Step | None = None
        self._reached = asyncio.Event()
        self._go = asyncio.Event()

    async def _before_step(self, step: Step) -> None:
        await asyncio.sleep(0)
        if step == self._stop_at:
            self._stop_at = None
            self._reached.set()
            await self._go.wait()

    async def until(self, name: str, place: str | None = None) -> None:
        """Until the hand is about to do a step; it waits there for `go`."""
        self._reached.clear()
        self._go.clear()
        self._stop_at = (name, Place(place) if place else None)
        await self._reached.wait()

    def go(self) -> None:
        self._go.set()

    def of(self, kind: type[events.Event]) -> list[events.Event]:
        return [event for event in self.seen if isinstance(event, kind)]

    async def see(self, kind: type[events.Event], count: int = 1) -> events.Event:
        """Until so many events of a kind have come."""
        with self.arbiter.events.reader() as reader:
            if len(self.of(kind)) >= count:
                return self.of(kind)[count - 1]
            async for event in reader:
                if isinstance(event, kind) and len(self.of(kind)) >= count:
                    return event
        raise AssertionError(f"the game ended without {count} {kind}")

    @asynccontextmanager
    async def playing(self) -> AsyncIterator["asyncio.Task[events.GameOver]"]:
        """The game runs; whatever is left of it ends with the block."""
        task = asyncio.ensure_future(self.arbiter.run())
        try:
            yield task
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    @property
    def sans(self) -> list[str]:
        return [event.san for event in self.seen if isinstance(event, events.MoveCommitted)]


class Eyes:
    """A verifier that finds the given faults, one at each look."""

    def __init__(self, faults: Sequence[str]) -> None:
        self.faults = list(faults)
        self.looks: list[tuple[Transfer | None, Layout]] = []

    async def confirm(self, transfer: Transfer | None, standing: Layout) -> str:
        self.looks.append((transfer, standing))
        return self.faults.pop(0) if self.faults else ""


def watch(moves: Sequence[str]) -> Pairing:
    return Pairing(Mode.WATCH, ScriptedPlayer(moves, name="A"), ScriptedPlayer(moves, name="B"))


def replay(moves: str, result: str = "*") -> Pairing:
    return Pairing.replay(parse_game(f'[White "W"]\n[Black "B"]\n[Result "{result}"]\n\n{moves} {result}'))


def play(moves: Sequence[str] = (), *, agrees: bool = False) -> tuple[PersonPlayer, Pairing]:
    person = PersonPlayer("Anna")
    return person, Pairing.play(person, ScriptedPlayer(moves, name="Engine", agrees=agrees))


async def settle() -> None:
    """Let every task go on as far as it can."""
    for _ in range(50):
        await asyncio.sleep(0)
