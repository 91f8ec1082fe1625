"""Killed at any instant, the program goes on, and table and journal agree at the end."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import chess
import hypothesis.strategies as st
import pytest
from hypothesis import HealthCheck, given, settings

from kempelen.core.errors import StoppedError
from kempelen.core.events import Event, GameOver, MoveCommitted
from kempelen.core.places import Layout
from kempelen.core.table import Table, start_layout
from kempelen.game.arbiter import Arbiter
from kempelen.game.journal import GameLog, JournalReader
from kempelen.game.modes import Mode, Pairing
from kempelen.game.opening import new_game
from kempelen.game.options import ArbiterOptions
from kempelen.game.records import Begun, Intended, Purpose
from kempelen.game.state import GameState
from kempelen.testing.hands import FakeHand, FakePerson, FakeTable, Step
from kempelen.testing.kills import Killed, KillSwitch, MortalJournal
from kempelen.testing.players import ScriptedPlayer

# En passant, a bishop's move, castling, a capture, an under-promotion that captures, a promotion to a third
# rook, which no set has: the operator brings it.
FEN = "1n2k3/P1P5/8/3pP3/8/7b/8/R3K2R w KQ d6 0 1"
MOVES = ("exd6", "Bf5", "O-O", "Bb1", "Raxb1", "Kd7", "cxb8=N+", "Kxd6", "a8=R", "Ke5")
TABLE = Table()
# King and rook stand for each other, a bishop stands elsewhere, a pawn is in the tray, a queen in the way.
ELSEWHERE = start_layout(TABLE, chess.Board("1n2k3/P1P5/8/3p4/6b1/8/Q7/K3R2R w - - 0 1"))
SYNC_OFF = "PRAGMA synchronous = OFF"  # the power does not fail in these tests, only the program dies


def final_board() -> chess.Board:
    board = chess.Board(FEN)
    for san in MOVES:
        board.push_san(san)
    return board


@dataclass(frozen=True)
class Death:
    """One end of the program: when, how far the controller goes on alone, and whether it is reset then."""

    at: int
    coast: int = 0
    reset: bool = False
    how: Literal["kill", "cancel", "stop"] = "kill"


class Interruption(KillSwitch):
    """At the instant the program is not killed but asked to end: Ctrl-C, or an e-stop."""

    def __init__(self, at: int, how: str) -> None:
        super().__init__(at)
        self.how = how
        self.arbiter: Arbiter | None = None
        self.task: asyncio.Task[object] | None = None
        self.stopping: asyncio.Task[None] | None = None

    def instant(self) -> None:
        if self.passed == self.at and self.arbiter is not None and self.task is not None:
            if self.how == "cancel":
                self.task.cancel()
            else:
                self.stopping = asyncio.ensure_future(self.arbiter.stop())
        self.passed += 1


@dataclass
class Life:
    """One table, one journal, as many programs as it takes."""

    directory: Path
    hands: Literal["robot", "person"] = "robot"
    take_back: bool = False
    cancel_closes: bool = False
    park: bool = True
    standing: Layout | None = None
    world: FakeTable | None = None
    person: FakePerson | None = None
    tasks: list[asyncio.Task[None]] = field(default_factory=list)

    async def live(self, switch: KillSwitch) -> GameState | None:
        """One program, from its start to its death (None) or to the end of the game."""
        try:
            journal = MortalJournal(self.directory, switch)
        except Killed:
            return None
        journal._connection.execute(SYNC_OFF)
        try:
            log = self._log(journal)
            await self._play(log, switch)
        except (Killed, asyncio.CancelledError, StoppedError):
            return None
        finally:
            await asyncio.gather(*self.tasks, return_exceptions=True)
            journal.close()
        return log.state

    def _log(self, journal: MortalJournal) -> GameLog:
        games = journal.games()
        if games and games[0].over:  # died after the end was written
            return GameLog(journal, 1, journal.state(1))
        if games:
            return journal.reopen(1)
        return new_game(journal, self._pairing(), TABLE, start_fen=FEN, layout=self.standing)

    def _pairing(self) -> Pairing:
        players = [ScriptedPlayer(MOVES) for _ in "wb"]
        if self.hands == "person":
            for player in players:
                player.spec = player.spec.model_copy(update={"kind": "person"})
        return Pairing(Mode.PLAY, *players)

    async def _play(self, log: GameLog, switch: KillSwitch) -> None:
        if self.world is None or self.person is None:
            self.world = FakeTable(log.state.layout)
            self.person = FakePerson(self.world)
        self.world.before_step = switch.before_step
        self.world.cancel_closes = self.cancel_closes
        if log.state.ended:
            return
        options = ArbiterOptions(hands=self.hands, park=self.park)
        arbiter = Arbiter(
            log, FakeHand(self.world), self._pairing(), TABLE, person=self.person, options=options
        )
        if self.take_back:
            arbiter.events.listen(lambda event: self._maybe_take_back(event, arbiter))
        run = asyncio.ensure_future(arbiter.run())
        if isinstance(switch, Interruption):
            switch.arbiter, switch.task = arbiter, run
        over = await run
        assert over == GameOver("0-1", "White resigns")

    def _maybe_take_back(self, event: Event, arbiter: Arbiter) -> None:
        if isinstance(event, MoveCommitted) and event.ply == 9 and not self.tasks:
            self.tasks.append(asyncio.ensure_future(arbiter.takeback(9)))

    def die(self, death: Death) -> None:
        """What the controller does with nobody at the other end of the wire."""
        if self.world is not None:
            self.world.coast(death.coast)
            if death.reset:
                self.world.reset()


def check_story(directory: Path) -> None:
    """What was begun is finished first: nobody moves while moves are still to be taken back."""
    with JournalReader(directory) as reader:
        records = [record for _, record in reader.records(1)]
    assert isinstance(records[0], Begun)
    state = GameState.begin(records[0])
    for record in records[1:]:
        if isinstance(record, Intended) and record.purpose is Purpose.MOVE:
            assert state.back_to is None
        state = state.after(record)


async def survive(life: Life, deaths: Sequence[Death]) -> FakeTable:
    for death in deaths:
        how = death.how
        state = await life.live(KillSwitch(death.at) if how == "kill" else Interruption(death.at, how))
        if state is not None:
            break
        life.die(death)
    else:
        state = await life.live(KillSwitch())
    assert state is not None
    assert life.world is not None
    assert life.person is not None
    assert state.board.fen() == final_board().fen()
    assert state.layout == life.world.layout
    assert state.layout.board_part() == final_board().piece_map()
    assert life.world.held is None
    check_story(life.directory)
    if not any(death.reset or death.how != "kill" for death in deaths):
        assert not any("held?" in request for request in life.person.requests)
    return life.world


async def count_instants(life: Life) -> int:
    switch = KillSwitch()
    assert await life.live(switch) is not None
    return switch.passed


# How a program may end, and what the controller does then.
ENDS = [Death(0, coast, reset) for reset in (False, True) for coast in (0, 1, 9)]


async def survive_everywhere(
    directory: Path, life: Callable[[Path], Life], ends: Sequence[Death], every: int = 1
) -> int:
    """One life for each instant, or for each few; the ends take turns."""
    instants = await count_instants(life(directory / "count"))
    for at in range(0, instants, every):
        await survive(life(directory / str(at)), [replace(ends[at % len(ends)], at=at)])
    return instants


async def test_killed_once_at_every_instant(tmp_path: Path) -> None:
    assert await survive_everywhere(tmp_path, Life, ENDS) >= 250


async def test_killed_once_at_every_instant_of_a_game_by_hand(tmp_path: Path) -> None:
    await survive_everywhere(tmp_path, lambda directory: Life(directory, hands="person"), ENDS)


async def test_killed_once_while_the_position_is_set_up(tmp_path: Path) -> None:
    def life(directory: Path) -> Life:
        return Life(directory, standing=ELSEWHERE)

    await survive_everywhere(tmp_path, life, ENDS, every=3)


async def test_killed_once_without_parking(tmp_path: Path) -> None:
    await survive_everywhere(tmp_path, lambda directory: Life(directory, park=False), ENDS[::-1], every=5)


async def test_cancelled(tmp_path: Path) -> None:
    await survive_everywhere(tmp_path, Life, [Death(0, how="cancel")], every=5)


async def test_cancelled_where_that_resets_the_outputs(tmp_path: Path) -> None:
    def life(directory: Path) -> Life:
        return Life(directory, cancel_closes=True)

    await survive_everywhere(tmp_path, life, [Death(0, how="cancel")], every=2)


async def test_stopped(tmp_path: Path) -> None:
    await survive_everywhere(tmp_path, Life, [Death(0, how="stop")], every=5)


deaths = st.builds(
    Death,
    at=st.integers(0, 250),
    coast=st.integers(0, 4),
    reset=st.booleans(),
    how=st.sampled_from(["kill", "kill", "cancel", "stop"]),
)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    series=st.lists(deaths, min_size=2, max_size=6),
    hands=st.sampled_from(["robot", "robot", "person"]),
    cancel_closes=st.booleans(),
    park=st.booleans(),
)
def test_killed_again_and_again_with_takebacks(
    tmp_path_factory: pytest.TempPathFactory,
    series: list[Death],
    hands: Literal["robot", "person"],
    *,
    cancel_closes: bool,
    park: bool,
) -> None:
    life = Life(
        tmp_path_factory.mktemp("life"), hands=hands, take_back=True, cancel_closes=cancel_closes, park=park
    )
    asyncio.run(survive(life, series))


async def test_a_look_into_the_gripper_is_remembered(tmp_path: Path) -> None:
    """Reset in mid-grip, seen to hold nothing, killed once more: a closed gripper proves nothing now."""
    closing = await instants_at_step(Life(tmp_path / "count"), "close", nth=3)
    for again in range(2, 8):
        life = Life(tmp_path / str(again))
        await survive(life, [Death(closing - 1, reset=True), Death(again)])
        assert life.person is not None
        assert "is K held?" in life.person.requests


async def test_the_hand_steps_aside_before_a_person_reaches_in(tmp_path: Path) -> None:
    """Found by the soak: reset while a piece is brought, the gripper around the last piece moved."""
    bringing = await instants_at_step(Life(tmp_path / "count", park=False), "supply", nth=0)
    for at in range(bringing - 6, bringing + 4):
        await survive(Life(tmp_path / str(at), park=False), [Death(at, reset=True)])


async def instants_at_step(life: Life, name: str, nth: int) -> int:
    """The number of the instant before the ``nth`` motion of that name."""
    switch, found = KillSwitch(), []

    async def before_step(step: Step) -> None:
        if step[0] == name:
            found.append(switch.passed)
        await KillSwitch.before_step(switch, step)

    switch.before_step = before_step  # type: ignore[method-assign]
    assert await life.live(switch) is not None
    return found[nth]


ALL_ENDS = [*ENDS, Death(0, how="cancel"), Death(0, how="stop")]


@pytest.mark.soak
@pytest.mark.parametrize("end", ALL_ENDS, ids=lambda end: f"{end.how}-coast{end.coast}-reset{end.reset:d}")
@pytest.mark.parametrize("park", [True, False])
async def test_every_end_at_every_instant(tmp_path: Path, end: Death, park: bool) -> None:
    def life(directory: Path) -> Life:
        return Life(directory, take_back=True, park=park, cancel_closes=not park)

    await survive_everywhere(tmp_path, life, [end])
