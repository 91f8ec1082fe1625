"""One game from the command to its report."""

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import chess
import pytest

from kempelen.app.cast import GameRequest
from kempelen.app.config import load_config
from kempelen.app.live_game import LiveGame
from kempelen.app.people import Question
from kempelen.core.errors import ConfigError, GameError, LinkError
from kempelen.core.events import CheckpointReached, Event
from kempelen.game.journal import Journal, JournalReader
from kempelen.game.modes import Mode
from kempelen.game.pgn import GameScore
from kempelen.testing.uci_engines import write_engine

MOVES = tuple(map(chess.Move.from_uci, ("e2e4", "e7e5", "g1f3", "b8c6")))
SCORE = GameScore({"White": "Ada", "Black": "Bob", "Date": "1843.10.01"}, chess.STARTING_FEN, MOVES, "1-0")
REPLAY = GameRequest(Mode.REPLAY, score=SCORE)


async def nobody(question: Question) -> str:
    raise AssertionError(f"nobody is here to answer: {question}")


def live(folder: Path, request: GameRequest | int = REPLAY, **options: Any) -> LiveGame:
    settings = {"data.dir": str(folder), "twin.speed": "max"}
    settings |= {key.replace("__", "."): value for key, value in options.items()}
    return LiveGame(load_config(None, settings), request, nobody)


@pytest.mark.physics
async def test_a_replay_and_what_onlookers_see_of_it(tmp_path: Path) -> None:
    async with live(tmp_path) as game:
        assert (game.length, game.seconds_left, game.notices) == (4, None, [])
        assert game.layout == game.arbiter.state.begun.layout
        report = await game.play()
        assert game.board.move_stack == list(MOVES)
        assert game.robot.homed
        assert game.pgn.read_text().count("Nc6") == 1
    assert (report.result, report.plies, report.disagreements) == ("1-0", 4, [])
    assert not list((tmp_path / "twin").iterdir())  # a finished game needs its table no more


async def test_a_game_without_a_table_never_began(tmp_path: Path) -> None:
    with pytest.raises(LinkError):
        await live(tmp_path, robot__port="/dev/ttyNONE7").__aenter__()
    with JournalReader(tmp_path) as journal:
        assert journal.games() == []
    with Journal(tmp_path / "journal.sqlite3") as journal:  # nor is it locked
        assert journal.next_game == 1


@pytest.mark.physics
async def test_a_game_cut_off_in_mid_transfer_is_reported_and_goes_on(tmp_path: Path) -> None:
    carrying = asyncio.Event()

    def hear(event: Event) -> None:
        if isinstance(event, CheckpointReached) and event.checkpoint == "carrying":
            carrying.set()

    async with live(tmp_path, twin__speed=2) as game:
        game.arbiter.events.listen(hear)
        playing = asyncio.ensure_future(game.play())
        await carrying.wait()
        playing.cancel()
        await asyncio.gather(playing, return_exceptions=True)
        report = game.report()
    assert (report.result, report.reason, report.plies) == ("*", "interrupted", 0)
    assert report.disagreements == []
    async with live(tmp_path, 1) as game:
        report = await game.play()
    assert (report.plies, report.interventions, report.disagreements) == (4, 0, [])


@pytest.mark.physics
async def test_other_players_and_back_to_the_score(tmp_path: Path) -> None:
    request = replace(REPLAY, take_over_move=2)
    async with live(tmp_path, request, engine__path=str(write_engine(tmp_path))) as game:
        playing = asyncio.ensure_future(game.play())
        await game.cast.person.wanted.wait()
        lengths = [game.length]
        await game.swap_mode(GameRequest(Mode.REPLAY))
        assert [game.arbiter.pairing[colour].spec.name for colour in (True, False)] == ["Ada", "Bob"]
        lengths.append(game.length)
        report = await playing
    assert lengths == [None, 4]
    assert (report.plies, report.result) == (4, "1-0")


@pytest.mark.physics
async def test_a_game_that_has_left_the_score_cannot_follow_it(tmp_path: Path) -> None:
    request = replace(REPLAY, take_over_move=2)
    async with live(tmp_path, request, engine__path=str(write_engine(tmp_path))) as game:
        person, playing = game.cast.person, asyncio.ensure_future(game.play())
        await person.wanted.wait()
        person.submit("a3")
        await person.wanted.wait()
        with pytest.raises(GameError, match="left the score after 2 half-moves.*takeback"):
            await game.swap_mode(GameRequest(Mode.REPLAY))
        other = replace(SCORE, start_fen="4k3/8/8/8/8/8/8/4K2R w K - 0 1")
        with pytest.raises(GameError, match="another position"):
            await game.swap_mode(GameRequest(Mode.REPLAY, score=other))
        await game.arbiter.takeback(2)
        await game.swap_mode(GameRequest(Mode.REPLAY))
        assert (await playing).plies == 4


@pytest.mark.physics
async def test_the_pace_of_a_twin_can_be_changed(tmp_path: Path) -> None:
    async with live(tmp_path, twin__speed=1) as game:
        with pytest.raises(ConfigError, match="is no time scale"):
            await game.set_speed("warp")
        await game.set_speed("max")
        report = await game.play()
    assert report.wall_time_s < report.robot_time_s
