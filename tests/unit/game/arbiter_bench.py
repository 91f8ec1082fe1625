"""A table, a journal and an arbiter, for tests of the arbiter."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager

import chess

from kempelen.core import events
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.table import Table
from kempelen.game.arbiter import Arbiter
from kempelen.game.clock import TimeControl
from kempelen.game.journal import Journal
from kempelen.game.modes import Mode, Pairing, TakeOver
from kempelen.game.opening import new_game
from kempelen.game.options import ArbiterOptions
from kempelen.game.pgn import parse_game
from kempelen.game.players import PersonPlayer
from kempelen.game.verify import Fault
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
        eyes: bool = False,
        clock: TimeControl | None = None,
        resume: "Bench | None" = None,
    ) -> None:
        if resume is None:
            self.log = new_game(
                journal, pairing, table, start_fen=fen, take_over=take_over, options=options, clock=clock
            )
            self.world = FakeTable(self.log.state.layout, self._before_step)
        else:  # the program before this one was killed; its table is still there
            self.log = journal.reopen(resume.log.game)
            self.world = resume.world
            self.world.before_step = self._before_step
        self.hand = FakeHand(self.world)
        self.person = FakePerson(self.world)
        self.eyes = Eyes(self.world) if eyes else None
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
    """A verifier with true eyes: sees what stands on the squares, and nothing while the hand is down there.

    Attributes:
        looks: May be switched off.
        looked: At which transfers, and whether the hand was in the way.
        hands_off: Set while no person's hand is over the board.
        dazzled: Whether a hand at the tray keeps them from being sure, though the board is in view.
    """

    def __init__(self, world: FakeTable) -> None:
        self.looks = True
        self.looked: list[tuple[str, ...]] = []
        self.hands_off = asyncio.Event()
        self.hands_off.set()
        self.dazzled = False
        self._world = world

    async def confirm(self, transfers: Sequence[Transfer], standing: Layout) -> Fault | None:
        await asyncio.sleep(0)
        hidden = self._world.down_at
        assert hidden is None or not hidden.is_square, "it looks while the robot's hand is in the way"
        if self.dazzled and hidden is not None:
            await asyncio.Event().wait()
        self.looked.append(tuple(map(str, transfers)))
        truth, wanted = self._world.layout.board_part(), standing.board_part()
        wrong = sorted(chess.square_name(s) for s in chess.SQUARES if truth.get(s) != wanted.get(s))
        missed = tuple(t for t in transfers if self._stands_still(t))
        return Fault(f"Put {', '.join(wrong)} right.", missed) if wrong else None

    def _stands_still(self, transfer: Transfer) -> bool:
        return self._world.standing.get(transfer.source) == transfer.piece

    async def in_view(self) -> bool:
        await asyncio.sleep(0)
        return self._world.down_at is None or not self._world.down_at.is_square

    async def unobstructed(self) -> None:
        await self.hands_off.wait()


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
