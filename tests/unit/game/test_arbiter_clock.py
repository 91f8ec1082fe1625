"""A game with a chess clock: it runs while a side decides, lasts in the journal, and ends the game."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import cast

import chess
import pytest
from tests.unit.game.arbiter_bench import Bench

from kempelen.core import events
from kempelen.core.protocols import Engine
from kempelen.game.clock import ClockReading, TimeControl
from kempelen.game.game_log import score_of
from kempelen.game.journal import Journal
from kempelen.game.modes import Pairing
from kempelen.game.players import EnginePlayer, PersonPlayer
from kempelen.game.records import Clocked
from kempelen.game.turn_clock import TurnClock
from kempelen.testing.players import ScriptedPlayer


class Hours:
    """A time that passes when it is told to."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def journal(tmp_path: Path) -> Iterator[Journal]:
    with Journal(tmp_path / "journal.sqlite") as journal:
        yield journal


def timed(journal: Journal, hours: Hours, person: PersonPlayer, resume: Bench | None = None) -> Bench:
    """A person with White against a script, a minute and two seconds a move."""
    pairing = Pairing.play(person, ScriptedPlayer(["e4", "e5", "d4", "Nc6"]))
    bench = Bench(journal, pairing, clock=TimeControl(60, 2), resume=resume)
    bench.arbiter.clock = TurnClock(bench.log, bench.arbiter.events, hours)
    return bench


async def asked(person: PersonPlayer) -> None:
    while not person.to_move:
        await person.wanted.wait()


def clocked(journal: Journal, game: int) -> list[Clocked]:
    """What the journal has of the clock."""
    return [record for _, record in journal.records(game) if isinstance(record, Clocked)]


async def test_time_runs_while_a_side_decides_and_lasts_over_an_exit(journal: Journal) -> None:
    hours, person = Hours(), PersonPlayer()
    bench = timed(journal, hours, person)
    async with bench.playing():
        await asked(person)
        hours.now += 10
        assert bench.arbiter.clock.read() == ClockReading(50, 60, chess.WHITE)
        await bench.arbiter.pause()
        hours.now += 100
        assert bench.arbiter.clock.read() == ClockReading(50, 60)
        await bench.arbiter.resume()
        hours.now += 1
        person.submit("e4")
        await bench.until("down", "e2")
        hours.now += 100  # the robot's time is nobody's
        assert bench.arbiter.clock.read() == ClockReading(51, 60)
        bench.go()
        await bench.see(events.MoveCommitted, 2)
        await asked(person)
        assert bench.arbiter.clock.left(chess.BLACK) == 62
        hours.now += 4
    bench = timed(journal, hours, person, resume=bench)
    assert bench.arbiter.clock.read() == ClockReading(47, 62)
    assert score_of(bench.log.state).headers["TimeControl"] == "60+2"


async def test_what_runs_is_told(journal: Journal) -> None:
    hours, person = Hours(), PersonPlayer()
    bench = timed(journal, hours, person)
    async with bench.playing():
        await asked(person)
        hours.now += 3
        await bench.arbiter.pause()
    assert bench.of(events.ClockChanged)[:2] == [
        events.ClockChanged(60, 60, chess.WHITE),
        events.ClockChanged(57, 60, None),
    ]


async def test_a_fallen_flag_ends_the_game(journal: Journal) -> None:
    pairing = Pairing.play(PersonPlayer(), ScriptedPlayer(["e5"]))
    bench = Bench(journal, pairing, clock=TimeControl(0.02))
    over = await bench.arbiter.run()
    assert over == events.GameOver("0-1", "White forfeits on time")
    assert bench.log.state.clock == (0, 0.02)


async def test_a_long_thought_is_in_the_journal_before_it_ends(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kempelen.game.turn_clock.KEPT_S", 0.001)
    hours, person = Hours(), PersonPlayer()
    bench = timed(journal, hours, person)
    async with bench.playing():
        await asked(person)
        hours.now += 7
        while not (kept := clocked(journal, bench.log.game)):  # noqa: ASYNC110 - the journal tells nobody
            await asyncio.sleep(0)
        assert kept == [Clocked(white=53, black=60)]


async def test_no_time_runs_in_a_game_without_a_clock(journal: Journal) -> None:
    person = PersonPlayer()
    bench = Bench(journal, Pairing.play(person, ScriptedPlayer(["e5"])))
    async with bench.playing():
        await asked(person)
        assert (bench.arbiter.clock.read(), bench.arbiter.clock.left(chess.WHITE)) == (None, None)
        await bench.arbiter.pause()
        await bench.arbiter.resume()
    assert bench.of(events.ClockChanged) == []


@pytest.mark.parametrize(("left", "seconds"), [(None, 1.0), (300.0, 1.0), (6.0, 0.2), (0.1, 0.02)])
async def test_an_engine_saves_time_when_there_is_little(left: float | None, seconds: float) -> None:
    player = EnginePlayer(cast("Engine", _Engine()), seconds=1.0, time_left=lambda _: left)
    assert player._affordable(chess.WHITE) == pytest.approx(seconds)


class _Engine:
    name = "engine"
