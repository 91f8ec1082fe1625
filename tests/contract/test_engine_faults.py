"""An engine may do anything: a legal move comes of it or a reason, and nothing is left behind."""

import asyncio
import contextlib
import os
from collections.abc import Callable
from pathlib import Path

import chess
import pytest

from kempelen.core.errors import ConfigError, EngineError
from kempelen.core.protocols import Thinking
from kempelen.engines.find import EngineProgram, Source
from kempelen.engines.program import Habits, ProgramEngine
from kempelen.engines.strength import Level, Means
from kempelen.engines.tongues import Tongue
from kempelen.engines.wire import Patience
from kempelen.testing.uci_engines import write_engine

QUICK = Patience(hello=10.0, ready=10.0, grace=10.0, farewell=5.0, restarts=2)
IMPATIENT = Patience(hello=10.0, ready=10.0, grace=0.2, farewell=0.2, restarts=1)


def engine_of(
    path: Path, patience: Patience = QUICK, level: Level | None = None, **habits: object
) -> ProgramEngine:
    tongue = Tongue(path.name) if path.name in set(Tongue) else None
    program = EngineProgram(path.name, (str(path),), Source.NAMED, tongue=tongue)
    settings = Habits(seconds=0.05, patience=patience, **habits)  # type: ignore[arg-type]
    return ProgramEngine(program, level or Level(Means.FULL), settings)


SPEECHES = {"uci": (), "xboard": ("--protocol", "xboard")}


@pytest.fixture(params=SPEECHES)
def fake(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., Path]:
    """Writes the engine that misbehaves, in each of the protocols that engines speak."""
    return lambda *arguments: write_engine(tmp_path, *SPEECHES[request.param], *arguments, name=request.param)


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def children() -> set[int]:
    return {int(pid) for pid in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()}


def living_members(group: int) -> list[int]:
    """Processes of a process group that have not ended; whom init has yet to bury do not count."""
    members = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it ended while we looked
            state, _, process_group, *_ = path.read_text().rpartition(")")[2].split()
            members += [path.parent.name] if int(process_group) == group and state != "Z" else []
    return [int(pid) for pid in members]


async def test_a_whole_game_of_legal_moves(tmp_path: Path) -> None:
    path = write_engine(tmp_path, "--seed", "7", "--log", str(tmp_path / "heard"))
    board = chess.Board()
    async with engine_of(path) as engine:
        pid = engine.pid
        for _ in range(12):
            choice = await engine.choose(board)
            board.push(choice.move)
    assert board.ply() == 12
    assert pid is not None
    assert not is_alive(pid)
    heard = (tmp_path / "heard").read_text()
    assert "setoption name Hash value 64" in heard
    assert "go movetime 50" in heard
    assert heard.count("ucinewgame") == 1
    assert heard.rstrip().endswith("quit")


async def test_another_game_is_announced(tmp_path: Path) -> None:
    path = write_engine(tmp_path, "--log", str(tmp_path / "heard"))
    async with engine_of(path) as engine:
        await engine.choose(chess.Board())
        engine.new_game()
        await engine.choose(chess.Board())
    assert (tmp_path / "heard").read_text().count("ucinewgame") == 2


@pytest.mark.parametrize("deed", ["die", "none", "null", "illegal", "nonsense"])
async def test_a_fault_is_repaired_by_a_restart(fake: Callable[..., Path], tmp_path: Path, deed: str) -> None:
    path = fake("--on-go", deed, "--nth", "2", "--once", str(tmp_path / "done"))
    board = chess.Board()
    async with engine_of(path) as engine:
        board.push((await engine.choose(board)).move)
        first_pid = engine.pid
        choice = await engine.choose(board)
        assert engine.pid != first_pid
    assert choice.move in board.legal_moves
    assert (tmp_path / "done").exists()
    assert first_pid is not None
    assert not is_alive(first_pid)


async def test_a_hang_is_ended_and_the_search_repeated(fake: Callable[..., Path], tmp_path: Path) -> None:
    once, heard = tmp_path / "done", tmp_path / "heard"
    path = fake("--on-go", "hang", "--once", str(once), "--log", str(heard))
    patience = Patience(hello=10.0, ready=10.0, grace=1.5, farewell=0.1, restarts=3)
    async with engine_of(path, patience) as engine:
        first_pid = engine.pid
        choice = await engine.choose(chess.Board())
    assert choice.move in chess.Board().legal_moves
    assert first_pid is not None
    assert not is_alive(first_pid)
    assert heard.read_text().count("\ngo") >= 2


@pytest.mark.parametrize("deed", ["none", "null"])
async def test_regression_no_move_is_never_taken_for_mate(
    fake: Callable[..., Path], tmp_path: Path, deed: str
) -> None:
    path = fake("--on-go", deed, "--log", str(tmp_path / "heard"))
    async with engine_of(path) as engine:
        with pytest.raises(EngineError, match=r"named no move in 3 attempts.*20 are legal") as caught:
            await engine.choose(chess.Board())
        assert engine.pid is None
    assert "resume" in caught.value.hint
    assert (tmp_path / "heard").read_text().count("\ngo") == 3


async def test_the_last_words_of_the_dead_are_in_the_message(
    fake: Callable[..., Path], capfd: pytest.CaptureFixture[str]
) -> None:
    async with engine_of(fake("--on-go", "die")) as engine:
        with pytest.raises(EngineError, match=r"exit code 3 .*last words: out of matter"):
            await engine.choose(chess.Board())
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")


async def test_an_engine_that_hangs_for_good_is_killed_with_its_children(fake: Callable[..., Path]) -> None:
    path = fake("--on-go", "hang", "--child")
    async with engine_of(path, IMPATIENT) as engine:
        first_pid = engine.pid
        with pytest.raises(EngineError, match=r"not answered within 0\.25 s"):
            await engine.choose(chess.Board())
    assert first_pid is not None
    assert living_members(first_pid) == []


async def test_garbage_is_ignored_and_kept_from_the_terminal(
    fake: Callable[..., Path],
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    thoughts: list[Thinking] = []
    async with engine_of(fake("--on-go", "garbage")) as engine:
        choice = await engine.choose(chess.Board(), on_thinking=thoughts.append)
    assert choice.move in chess.Board().legal_moves
    line = (chess.Move.from_uci("e2e4"), chess.Move.from_uci("e7e5"))
    assert thoughts[0] == Thinking(depth=3, centipawns=12, line=line)
    assert choice.thinking == thoughts[-1]
    assert capfd.readouterr() == ("", "")
    assert not caplog.records


async def test_thoughts_are_told_while_thinking(fake: Callable[..., Path]) -> None:
    thoughts: list[Thinking] = []
    async with engine_of(fake()) as engine:
        choice = await engine.choose(chess.Board(), on_thinking=thoughts.append)
    assert [thought.line for thought in thoughts] == [(choice.move,)]
    assert thoughts[0].centipawns == 50


async def test_a_fault_in_the_listener_does_not_break_the_wire(fake: Callable[..., Path]) -> None:
    def fail(_: Thinking) -> None:
        raise RuntimeError("listener")

    heard: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: heard.append(context["exception"]))
    async with engine_of(fake()) as engine:
        choice = await engine.choose(chess.Board(), on_thinking=fail)
    assert choice.move
    assert [str(error) for error in heard] == ["listener"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--start", "die"), r"ended with exit code 1 .*last words: cannot find my opening book"),
        (("--protocol", "none"), r"neither UCI nor xboard.*has not said 'uciok'.*unknown command\): uci"),
        (("--start", "60"), r"neither UCI nor xboard.*'uciok'.*within 0\.5 s.*features.*within 0\.5 s"),
    ],
)
async def test_what_is_no_engine_is_refused(tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    patience = Patience(hello=0.5, farewell=0.5)
    path = write_engine(tmp_path, *arguments)
    if arguments == ("--start", "die"):
        patience = QUICK
    with pytest.raises(EngineError, match=message) as caught:
        await engine_of(path, patience).__aenter__()
    assert str(path) in caught.value.message
    assert "--engine" in caught.value.hint


async def test_a_slow_starter_is_awaited(fake: Callable[..., Path]) -> None:
    async with engine_of(fake("--start", "0.3")) as engine:
        assert (await engine.choose(chess.Board())).move


async def test_what_cannot_be_executed_is_refused(tmp_path: Path) -> None:
    text, unmarked, orphan = tmp_path / "text", tmp_path / "unmarked", tmp_path / "orphan"
    text.write_text("hello")
    text.chmod(0o755)
    unmarked.write_text("#!/bin/sh\n")
    orphan.write_text("#!/no/such/interpreter\n")
    orphan.chmod(0o755)
    cases = ((text, "no program"), (unmarked, "not executable"), (orphan, "interpreter it names"))
    for path, message in cases:
        with pytest.raises(EngineError, match=message):
            await engine_of(path).__aenter__()
    with pytest.raises(EngineError, match="cannot be started: Not a directory"):
        await engine_of(text / "engine").__aenter__()


async def test_a_cancelled_search_leaves_the_engine_fit(fake: Callable[..., Path], tmp_path: Path) -> None:
    path = fake("--log", str(tmp_path / "heard"))
    async with engine_of(path) as engine:
        pid = engine.pid
        search = asyncio.create_task(engine.choose(chess.Board()))
        await asyncio.sleep(0)
        search.cancel()
        with pytest.raises(asyncio.CancelledError):
            await search
        assert (await engine.choose(chess.Board())).move in chess.Board().legal_moves
        assert engine.pid == pid


@pytest.mark.parametrize("ticks", [1, 20])
async def test_cancelled_while_starting_nothing_is_left(fake: Callable[..., Path], ticks: int) -> None:
    before = children()
    engine = engine_of(fake("--start", "60"), Patience(farewell=5.0))
    task = asyncio.create_task(engine.__aenter__())
    for _ in range(ticks):
        await asyncio.sleep(0)
    [pid] = children() - before
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert not is_alive(pid)


async def test_no_search_when_the_game_is_over(fake: Callable[..., Path]) -> None:
    mate = chess.Board("7k/6Q1/6K1/8/8/8/8/8 b - - 0 1")
    async with engine_of(fake()) as engine:
        with pytest.raises(EngineError, match="the game is over"):
            await engine.choose(mate)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"Stile": "wild"}, "has no option 'Stile'. Did you mean Style"),
        ({"Contempt": 1}, "has no option 'Contempt'"),
        ({"MultiPV": 3}, "set by Kempelen itself"),
    ],
)
async def test_unknown_options_are_refused(tmp_path: Path, options: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        await engine_of(write_engine(tmp_path), options=options).__aenter__()
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("options", "message"), [({"Hash": 4096}, "at most 1024"), ({"Style": "mad"}, "calm, wild")]
)
async def test_option_values_out_of_range_are_refused(
    tmp_path: Path, options: dict[str, object], message: str
) -> None:
    with pytest.raises(EngineError, match=message):
        await engine_of(write_engine(tmp_path), options=options).__aenter__()


async def test_options_reach_the_engine(tmp_path: Path) -> None:
    path = write_engine(tmp_path, "--log", str(tmp_path / "heard"))
    async with engine_of(path, options={"Style": "wild"}, threads=2, hash_mb=32) as engine:
        assert engine.options["Style"] == "one of calm, wild"
        assert engine.options["Hash"] == "number 1 to 1024"
        assert engine.name == "Fake 1.0 (full strength)"
    heard = (tmp_path / "heard").read_text()
    for line in ("Style value wild", "Threads value 2", "Hash value 32"):
        assert f"setoption name {line}" in heard


async def test_sampled_moves_repeat_with_their_seed_and_differ_without(tmp_path: Path) -> None:
    path = write_engine(tmp_path, "--multipv", "--log", str(tmp_path / "heard"))

    async def game(seed: int) -> list[str]:
        board = chess.Board()
        async with engine_of(path, level=Level(Means.SCALE, 1), seed=seed) as engine:
            for _ in range(6):
                board.push((await engine.choose(board)).move)
        return [move.uci() for move in board.move_stack]

    first, again, other = await game(1), await game(1), await game(2)
    assert first == again
    assert first != other
    assert "setoption name MultiPV value 64" in (tmp_path / "heard").read_text()


async def test_an_engine_without_the_means_cannot_play_a_level(tmp_path: Path) -> None:
    with pytest.raises(EngineError, match="neither UCI_Elo nor MultiPV"):
        await engine_of(write_engine(tmp_path), level=Level(Means.ELO, 1500)).__aenter__()


def test_habits_out_of_range_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"0 s per move"):
        Habits(seconds=0.0)
    with pytest.raises(ConfigError, match="at least 1 thread"):
        Habits(threads=0)


async def test_a_line_without_end_does_not_fill_the_memory(fake: Callable[..., Path]) -> None:
    path = fake("--on-go", "flood")
    async with engine_of(path) as engine:
        assert (await engine.choose(chess.Board())).move in chess.Board().legal_moves
