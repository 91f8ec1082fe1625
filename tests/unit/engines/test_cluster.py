"""The cluster with a stand-in for Ray whose workers are tasks of this process."""

import asyncio
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import chess
import pytest

from kempelen.core.errors import ConfigError, EngineError
from kempelen.core.protocols import Thinking
from kempelen.engines import ray_link
from kempelen.engines.cluster import ClusterEngine, parse_cluster
from kempelen.engines.program import Habits
from kempelen.engines.voter import Voter
from kempelen.engines.voting import Effort, Vote
from kempelen.engines.wire import Patience
from kempelen.testing.uci_engines import write_engine

PATIENCE = Patience(grace=5.0, farewell=0.5, restarts=1)
Behaviour = Callable[[int], Any]


class _Actor:
    """Runs methods as tasks."""

    def __init__(self, thing: Any) -> None:
        self._thing = thing

    def __getattr__(self, name: str) -> Any:
        method = getattr(self._thing, name)
        return type("Method", (), {"remote": lambda _, *a: asyncio.ensure_future(method(*a))})()


class FakeRay:
    """As much of Ray as is used."""

    def __init__(self, kind: Callable[..., Any]) -> None:
        self._kind = kind
        self.begun: list[Any] = []
        self.cancelled = self.killed = self.ended = 0

    def init(self, *address: str, **settings: Any) -> None:
        self.begun.append((address, settings))

    def remote(self, _: type) -> "FakeRay":
        self_ = self

        class Actors:
            def options(self, **_: Any) -> "Actors":
                return self

            def remote(self, *arguments: Any) -> _Actor:
                return _Actor(self_._kind(*arguments))

        return Actors()  # type: ignore[return-value]

    def cancel(self, ref: "asyncio.Future[Any]") -> None:
        self.cancelled += 1
        ref.cancel()

    def kill(self, _: Any) -> None:
        self.killed += 1

    def shutdown(self) -> None:
        self.ended += 1


class Parrot:
    """Votes as it is told."""

    behaviours: ClassVar[dict[int, Any]] = {}

    def __init__(self, number: int, engine: str, options: dict[str, Any]) -> None:
        del engine, options
        self._answer = self.behaviours.get(number, Vote("e2e4", 10.0, 5))

    async def ready(self) -> str:
        return "Parrot"

    async def close(self) -> None:
        return

    async def vote(self, start: str, moves: list[str], game: str, effort: Effort) -> Vote:
        del start, moves, game, effort
        if isinstance(self._answer, Exception):
            raise self._answer
        if self._answer == "late":
            await asyncio.Event().wait()
        assert isinstance(self._answer, Vote)
        return self._answer


@pytest.fixture
def ray(monkeypatch: pytest.MonkeyPatch) -> FakeRay:
    monkeypatch.setattr(Parrot, "behaviours", {})
    fake = FakeRay(Parrot)
    monkeypatch.setattr(ray_link, "library", lambda: fake)
    return fake


async def test_the_vote_decides_and_everything_is_ended(ray: FakeRay) -> None:
    Parrot.behaviours = {0: Vote("d2d4", 12.0, 5)}
    thoughts: list[Thinking] = []
    async with ClusterEngine(habits=Habits(patience=PATIENCE)) as engine:
        choice = await engine.choose(chess.Board(), on_thinking=thoughts.append)
        assert engine.name == "Parrot, 4 voters (full strength)"
    assert choice.move.uci() == "e2e4"
    assert len(thoughts) == 4
    assert (ray.killed, ray.ended, ray.cancelled) == (4, 1, 0)
    [(address, settings)] = ray.begun
    assert address == ("local",)
    assert settings["include_dashboard"] is False


@pytest.mark.usefixtures("ray")
async def test_a_lost_worker_costs_its_voice_alone() -> None:
    lost = RuntimeError("The actor died unexpectedly.")
    Parrot.behaviours = {0: lost, 1: lost, 2: Vote("h2h5", 900.0, 40)}
    async with ClusterEngine(habits=Habits(patience=PATIENCE)) as engine:
        assert (await engine.choose(chess.Board())).move.uci() == "e2e4"


async def test_who_is_late_is_not_waited_for(ray: FakeRay) -> None:
    Parrot.behaviours = {3: "late"}
    async with ClusterEngine(habits=Habits(seconds=0.05, patience=PATIENCE)) as engine:
        assert (await engine.choose(chess.Board())).move.uci() == "e2e4"
    assert ray.cancelled == 1


@pytest.mark.usefixtures("ray")
async def test_when_all_are_lost_the_reason_is_told() -> None:
    Parrot.behaviours = dict.fromkeys(range(4), RuntimeError("out of memory"))
    async with ClusterEngine(habits=Habits(patience=PATIENCE)) as engine:
        with pytest.raises(EngineError, match=r"None of 4 voters.*out of memory") as caught:
            await engine.choose(chess.Board())
        with pytest.raises(EngineError, match="the game is over"):
            await engine.choose(chess.Board("7k/6Q1/6K1/8/8/8/8/8 b - - 0 1"))
    assert "resume" in caught.value.hint


async def test_a_cancelled_choice_stops_the_voters(ray: FakeRay) -> None:
    Parrot.behaviours = dict.fromkeys(range(4), "late")
    async with ClusterEngine(habits=Habits(seconds=60.0, patience=PATIENCE)) as engine:
        task = asyncio.ensure_future(engine.choose(chess.Board()))
        for _ in range(5):
            await asyncio.sleep(0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
    assert ray.cancelled == 4


async def test_two_engines_share_one_connection_but_not_two_clusters(ray: FakeRay) -> None:
    async with ClusterEngine(habits=Habits(patience=PATIENCE)):
        async with ClusterEngine(habits=Habits(patience=PATIENCE)):
            assert len(ray.begun) == 1
        assert ray.ended == 0
        with pytest.raises(ConfigError, match="works with the cluster"):
            await ClusterEngine("ray://elsewhere:10001").__aenter__()
    assert ray.ended == 1


async def test_a_cluster_that_does_not_answer_is_explained(
    ray: FakeRay, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ConnectionError("ray client connection timeout")

    monkeypatch.setattr(ray, "init", fail)
    with pytest.raises(EngineError, match="ray://hall:10001 could not be joined: ray client connection"):
        await ClusterEngine("ray://hall:10001").__aenter__()


async def test_voters_search_with_engines_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ray_link, "library", lambda: FakeRay(Voter))
    path = write_engine(tmp_path, "--multipv", "--log", str(tmp_path / "heard"))
    board = chess.Board()
    board.push_uci("e2e4")
    async with ClusterEngine(
        engine=str(path), habits=Habits(patience=PATIENCE, voters=2), nodes=100
    ) as engine:
        assert engine.name == "Fake 1.0, 2 voters (full strength)"
        assert (await engine.choose(board)).move in board.legal_moves
    heard = (tmp_path / "heard").read_text()
    assert sorted(line for line in heard.splitlines() if line.startswith("go")) == [
        "go nodes 100",
        "go nodes 2",
        "go nodes 8",
        "go nodes 90",
    ]


async def test_a_voter_whose_engine_dies_has_another_one_the_next_time(tmp_path: Path) -> None:
    path = write_engine(tmp_path, "--on-go", "die", "--once", str(tmp_path / "done"))
    async with Voter(0, str(path), {}) as voter:
        with pytest.raises(EngineError, match="exit code 3"):
            await voter.vote(chess.STARTING_FEN, [], "game", Effort(nodes=10))
        assert (await voter.vote(chess.STARTING_FEN, ["e2e4"], "game", Effort(nodes=10))).depth == 1


@pytest.mark.parametrize(
    ("engine", "address"),
    [
        ("cluster", ""),
        ("cluster:ray://hall", "ray://hall:10001"),
        ("cluster:ray://hall:7000", "ray://hall:7000"),
        ("clusterfish", None),
        ("stockfish", None),
    ],
)
def test_how_a_cluster_is_named(engine: str, address: str | None) -> None:
    assert parse_cluster(engine) == address


@pytest.mark.parametrize("engine", ["cluster:", "cluster:hall", "cluster:ray://"])
def test_what_names_no_cluster(engine: str) -> None:
    with pytest.raises(ConfigError, match="names no cluster"):
        parse_cluster(engine)


def test_ray_is_told_to_be_silent_and_missed_politely(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_: str) -> None:
        raise ImportError("No module named 'ray'")

    monkeypatch.delenv("RAY_USAGE_STATS_ENABLED", raising=False)
    monkeypatch.setattr("importlib.import_module", missing)
    with pytest.raises(ConfigError, match="needs Ray") as caught:
        ray_link.library()
    assert "kempelen[cluster]" in caught.value.hint
    assert os.environ["RAY_USAGE_STATS_ENABLED"] == "0"


@pytest.mark.soak
@pytest.mark.skipif(shutil.which("stockfish", path="/usr/games:/usr/bin") is None, reason="needs stockfish")
@pytest.mark.filterwarnings("ignore")
async def test_a_real_cluster_on_this_machine_survives_the_death_of_a_worker() -> None:
    ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'kempelen[cluster]'")
    board = chess.Board()
    async with ClusterEngine(engine="stockfish", habits=Habits(seconds=0.5), nodes=2000) as engine:
        for _ in range(4):
            board.push((await engine.choose(board)).move)
        ray.kill(engine._voters[0], no_restart=False)
        for _ in range(4):
            board.push((await engine.choose(board)).move)
    assert board.ply() == 8
