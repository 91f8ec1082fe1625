"""Engines of the older protocol: told apart, with all their accents; and the real ones play whole games."""

import shutil
from pathlib import Path

import chess
import pytest

from kempelen.core.errors import EngineError
from kempelen.engines import xboard_wire
from kempelen.engines.find import EngineProgram, Shelf, Source
from kempelen.engines.program import Habits, ProgramEngine
from kempelen.engines.strength import FULL, Level, Means
from kempelen.engines.tongues import Tongue
from kempelen.engines.wire import Patience
from kempelen.testing.uci_engines import write_engine

PATIENCE = Patience(hello=10.0, ready=10.0, grace=10.0, farewell=5.0, restarts=1)
SHELF = Shelf("/usr/games:/usr/local/games:/usr/bin", None)


def fake(directory: Path, *arguments: str) -> Path:
    return write_engine(directory, "--protocol", "xboard", "--log", str(directory / "heard"), *arguments)


def engine_of(
    path: Path,
    *,
    tongue: Tongue | None = Tongue.XBOARD,
    level: Level = FULL,
    seconds: float = 0.05,
    **habits: object,
) -> ProgramEngine:
    program = EngineProgram(path.name, (str(path),), Source.NAMED, tongue=tongue)
    settings = Habits(seconds=seconds, patience=PATIENCE, **habits)  # type: ignore[arg-type]
    return ProgramEngine(program, level, settings)


def heard(directory: Path) -> list[str]:
    return (directory / "heard").read_text().splitlines()


async def test_the_protocol_is_found_out(tmp_path: Path) -> None:
    async with engine_of(fake(tmp_path), tongue=None, hash_mb=32, threads=2) as engine:
        assert engine.tongue is Tongue.XBOARD
        assert engine.name == "Fake 1.0 (full strength)"
        assert engine.options["Style"] == "one of calm, wild"
        assert (await engine.choose(chess.Board())).move
    lines = heard(tmp_path)
    assert lines[0] == "uci"
    assert {"memory 32", "cores 2", "level 0 1 0", "time 150", "accepted setboard"} <= set(lines)


async def test_a_game_is_told_move_by_move_and_anew_after_a_takeback(tmp_path: Path) -> None:
    board = chess.Board()
    async with engine_of(fake(tmp_path)) as engine:
        for _ in range(3):
            board.push((await engine.choose(board)).move)
        assert heard(tmp_path).count("new") == 1
        board.pop()
        board.pop()
        await engine.choose(board)
    assert heard(tmp_path).count("new") == 2


async def test_a_position_is_set_up(tmp_path: Path) -> None:
    board = chess.Board("8/P6k/8/8/8/8/8/K7 w - - 0 1")
    async with engine_of(fake(tmp_path)) as engine:
        assert (await engine.choose(board)).move in board.legal_moves
    assert f"setboard {board.fen()}" in heard(tmp_path)


async def test_the_time_is_told_by_the_clock_of_the_game(tmp_path: Path) -> None:
    program = EngineProgram("fake", (str(fake(tmp_path)),), Source.NAMED, tongue=Tongue.XBOARD)
    left = {chess.WHITE: 90.0, chess.BLACK: 7.5}
    async with ProgramEngine(program, habits=Habits(patience=PATIENCE), time_left=left.get) as engine:
        await engine.choose(chess.Board())
    assert {"level 0 2 0", "time 9000", "otim 750"} <= set(heard(tmp_path))


async def test_whole_seconds_are_told_as_such_and_depth_too(tmp_path: Path) -> None:
    async with engine_of(fake(tmp_path), depth=3) as engine:
        await engine.choose(chess.Board(), seconds=2.0)
    assert {"st 2", "sd 3"} <= set(heard(tmp_path))


async def test_an_engine_may_give_up_or_offer_a_draw(tmp_path: Path) -> None:
    async with engine_of(fake(tmp_path, "--on-go", "resign")) as engine:
        choice = await engine.choose(chess.Board())
        assert choice.resigns
        assert not choice.move
        assert not (await engine.choose(chess.Board())).resigns
    async with engine_of(fake(tmp_path, "--on-go", "draw")) as engine:
        choice = await engine.choose(chess.Board())
    assert choice.offers_draw
    assert choice.move in chess.Board().legal_moves


async def test_a_weak_level_judges_every_move_and_says_so(tmp_path: Path) -> None:
    board = chess.Board("8/P6k/8/8/8/8/8/K7 w - - 0 1")
    async with engine_of(fake(tmp_path), level=Level(Means.SCALE, 1), seed=1) as engine:
        assert engine.name == "Fake 1.0 (level 1, about Elo 400, by sampling)"
        assert (await engine.choose(board)).move in board.legal_moves
    assert heard(tmp_path).count("go") == board.legal_moves.count()


async def test_a_ponderer_is_told_the_answer_alone(tmp_path: Path) -> None:
    board = chess.Board()
    # It answers at once; with little time a busy machine would have it hurried by "?".
    async with engine_of(fake(tmp_path, "--seed", "5"), seconds=9.0, ponder=True) as engine:
        board.push((await engine.choose(board)).move)
        board.push_uci("a7a6")
        told = len(heard(tmp_path))
        board.push((await engine.choose(board)).move)
        assert heard(tmp_path)[told:] == ["st 9", "usermove a7a6"]
        board.pop()  # the person takes back, and plays another move
        board.pop()
        board.push_uci("h7h6")
        assert (await engine.choose(board)).move in board.legal_moves
    assert heard(tmp_path).count("new") == 2


async def test_version_one_is_spoken_where_it_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(xboard_wire, "_OLD", 0.4)
    board = chess.Board()
    async with engine_of(fake(tmp_path, "--old")) as engine:
        for _ in range(2):
            board.push((await engine.choose(board)).move)
    assert board.is_valid()
    unusual = chess.Board("r3k2r/8/8/8/8/8/8/R3K2R w K - 0 1")
    async with engine_of(fake(tmp_path, "--old")) as engine:
        with pytest.raises(EngineError, match="knows no setboard"):
            await engine.choose(unusual)


GAMES = [
    ("phalanx", 0.01, None),
    ("sjeng", 0.01, None),
    ("hoichess", 0.5, 3),  # it looks at its clock once a second: kept short by depth
    ("fairymax", 0.01, None),
    ("gnuchess", 0.01, None),
]


@pytest.mark.parametrize(("name", "seconds", "depth"), GAMES)
async def test_an_engine_of_xboard_plays_a_whole_game(name: str, seconds: float, depth: int | None) -> None:
    if shutil.which(name, path=SHELF.search_path) is None:
        pytest.skip(f"{name} is not installed (Debian: apt install {name})")
    board = chess.Board()
    habits = Habits(seconds=seconds, depth=depth, seed=1)
    async with ProgramEngine(SHELF.find(name), habits=habits) as engine:
        pid = engine.pid
        while not (ended := board.outcome(claim_draw=True)) and board.ply() < 240:
            choice = await engine.choose(board)
            if choice.resigns:
                break
            board.push(choice.move)
        assert engine.pid == pid  # it never had to be started again
        assert engine.tongue is Tongue.XBOARD
    assert ended or choice.resigns or board.ply() == 240


@pytest.mark.skipif(
    shutil.which("fairymax", path=SHELF.search_path) is None, reason="fairymax is not installed"
)
async def test_fairymax_goes_on_from_a_position_without_setboard() -> None:
    board = chess.Board("8/P6k/8/8/8/8/7p/K7 b - - 0 1")
    async with ProgramEngine(SHELF.find("fairymax"), habits=Habits(seconds=0.05)) as engine:
        choice = await engine.choose(board)
    assert choice.move == chess.Move.from_uci("h2h1q")
