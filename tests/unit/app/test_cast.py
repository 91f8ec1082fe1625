"""Players for every mode, and the same ones again from the journal."""

from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import chess
import pytest

from kempelen.app.cast import Cast, EngineWish, GameRequest, score_of
from kempelen.app.config import Config, load_config
from kempelen.core.errors import ConfigError, EngineError
from kempelen.game.modes import Mode
from kempelen.game.pgn import GameScore
from kempelen.game.players import PersonPlayer, ReplayPlayer
from kempelen.game.records import PairingSpec, PlayerSpec
from kempelen.testing.uci_engines import write_engine

SCORE = GameScore({"White": "A", "Black": "B"}, chess.STARTING_FEN, (chess.Move.from_uci("e2e4"),), "*")


@pytest.fixture
def config(tmp_path: Path) -> Config:
    engine = write_engine(tmp_path)
    return load_config(
        None, {"engine.path": str(engine), "engine.move_time": 0.05, "data.dir": str(tmp_path)}
    )


async def test_play_has_a_person_and_an_engine(config: Config) -> None:
    async with AsyncExitStack() as stack:
        cast = Cast(config, stack)
        pairing = await cast.pairing(GameRequest(Mode.PLAY, person_plays=chess.BLACK))
        assert pairing.black is cast.person
        assert pairing.people == (chess.BLACK,)
        assert pairing.white.spec.details["move_time"] == 0.05


async def test_watch_starts_a_second_engine_only_when_it_differs(config: Config, tmp_path: Path) -> None:
    other = write_engine(tmp_path, name="other")
    async with AsyncExitStack() as stack:
        cast = Cast(config, stack)
        await cast.pairing(GameRequest(Mode.WATCH))
        assert len(cast._engines) == 1
        pairing = await cast.pairing(GameRequest(Mode.WATCH, opponent=str(other)))
        assert len(cast._engines) == 2
        assert pairing.black.spec.details["engine"] == str(other)


async def test_a_replay_needs_a_score_and_no_engine(config: Config) -> None:
    async with AsyncExitStack() as stack:
        cast = Cast(config, stack)
        pairing = await cast.pairing(GameRequest(Mode.REPLAY, score=SCORE))
        assert score_of(pairing.white.spec) is not None
        assert cast._engines == {}
        assert await cast.take_over(GameRequest(Mode.REPLAY, score=SCORE)) is None
        with pytest.raises(ConfigError, match="A replay needs a game"):
            await cast.pairing(GameRequest(Mode.REPLAY))


async def test_a_take_over_at_a_move(config: Config) -> None:
    async with AsyncExitStack() as stack:
        cast = Cast(config, stack)
        request = GameRequest(Mode.REPLAY, score=SCORE, take_over_move=20, person_plays=chess.BLACK)
        take_over = await cast.take_over(request)
        assert take_over is not None
        assert take_over.ply == 39
        assert take_over.pairing.people == (chess.BLACK,)


async def again(config: Config, request: GameRequest, wish: EngineWish | None = None) -> tuple[Any, Cast]:
    async with AsyncExitStack() as stack:
        spec = (await Cast(config, stack).pairing(request)).spec
    async with AsyncExitStack() as stack:
        cast = Cast(Config(), stack, wish)
        return await cast.again(spec), cast


async def test_the_same_players_again(config: Config) -> None:
    pairing, cast = await again(config, GameRequest(Mode.PLAY))
    assert isinstance(pairing.white, PersonPlayer)
    assert pairing.white is cast.person
    assert pairing.black.spec.details == {"engine": config.engine.path, "level": "full", "move_time": 0.05}
    pairing, _ = await again(config, GameRequest(Mode.REPLAY, score=SCORE))
    assert isinstance(pairing.white, ReplayPlayer)
    assert pairing.white.score.moves == SCORE.moves


async def test_engines_of_a_game_that_goes_on_may_be_changed(config: Config, tmp_path: Path) -> None:
    other = str(write_engine(tmp_path, name="other"))
    pairing, cast = await again(config, GameRequest(Mode.PLAY), EngineWish(path=other, move_time=0.2))
    assert pairing.black.spec.details == {"engine": other, "level": "full", "move_time": 0.2}
    assert cast._usual == (other, "full", 0.2)


async def test_an_engine_that_is_gone(config: Config) -> None:
    engine = PlayerSpec(kind="engine", name="X", details={"engine": "/gone", "level": "full", "move_time": 1})
    spec = PairingSpec(mode="watch", white=engine, black=engine)
    async with AsyncExitStack() as stack:
        with pytest.raises(EngineError, match="neither a file nor a program"):
            await Cast(config, stack).again(spec)


def test_only_replays_have_a_score(config: Config) -> None:
    del config
    assert score_of(PersonPlayer().spec) is None
