"""`kempelen bench nodes`: commands over the network, links that fail in mid-move, a hall of tables.

* Round trip: a command to a robot node in another process, over zenoh on the loopback interface, and back.
* Link faults: short games whose robot is at a node. In each one the link is cut, delayed, reordered, made to
  lose or to repeat, at a seeded instant while a piece is being carried; a cut may last so long that the
  arbiter gives up and another one goes on from the journal. In the end game, journal and table are compared:
  a move is lost that is not in all three, and doubled when more pieces were carried than the moves need.
* Hall: tables without physics in one process, each with its arbiter, journal and robot; memory and processor
  time of each, and whether a view in another process sees them all.
"""

import asyncio
import random
import statistics
import sys
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import chess
import numpy as np

from kempelen.bench.result import BenchResult, Progress
from kempelen.core import events
from kempelen.core.errors import KempelenError
from kempelen.core.protocols import Checkpoint
from kempelen.core.table import Table, start_layout
from kempelen.game.arbiter import Arbiter
from kempelen.game.journal import Journal
from kempelen.game.modes import Pairing
from kempelen.game.opening import new_game
from kempelen.game.pgn import GameScore
from kempelen.game.state import GameState
from kempelen.game.transfers import Request, move_transfers
from kempelen.nodes.local_link import LocalNet, Weather
from kempelen.nodes.remote_robot import RemoteRobot, Waits
from kempelen.nodes.robot_node import Patience, RobotNode
from kempelen.nodes.status import HallView
from kempelen.nodes.zenoh_link import Network, ZenohLink
from kempelen.robots.hand import CartesianHand
from kempelen.twin.light import LightRobot, LightTable

FAULTS = 300
TABLES = 100
ROUND_TRIPS = 1000
_AT_ONCE = 25
_MOVES = ("e4", "d5", "exd5", "Qxd5", "Nc3", "Qa5", "Nf3", "Bg4", "Be2", "Nc6", "O-O", "O-O-O")
_PACE = 15.0
_WAITS = Waits(answer=0.15, again=0.02, news=0.08, beat=0.05, valid=0.4, found=6.0, lost=1.6)
_PATIENCE = Patience(rest=0.25, forfeit=0.8, look=0.02)
_LIVES = 8
_HALL_S = 20.0
KINDS = ("cut", "long cut", "delay", "reorder", "loss", "repeat")


def run(
    *,
    seed: int,
    pgn: Path | None,
    data: Path | None,
    progress: Progress,
    faults: int = FAULTS,
    tables: int = TABLES,
) -> BenchResult:
    """Measure all three.

    Args:
        seed: Of the faults.
        pgn: Not used.
        data: Not used.
        progress: Told now and then.
        faults: How many games with a fault each.
        tables: In the hall.
    """
    del pgn, data
    return asyncio.run(_run(seed, faults, tables, progress))


async def _run(seed: int, faults: int, tables: int, progress: Progress) -> BenchResult:
    progress("round trips", 0.0)
    trips = await _round_trips()
    told = await _all_faults(seed, faults, progress)
    progress(f"a hall of {tables} tables", 0.9)
    hall = await _hall(tables)
    figures = {
        "round_trip_ms_p50": round(1e3 * statistics.median(trips), 3),
        "round_trip_ms_p95": round(1e3 * float(np.percentile(trips, 95)), 3),
        "link_faults": len(told),
        "moves": len(_MOVES) * len(told),
        "moves_lost": sum(game.lost for game in told),
        "moves_doubled": sum(game.doubled for game in told),
        "interventions": sum(game.helps for game in told),
        "resumed": sum(game.lives - 1 for game in told),
        **hall,
    }
    return BenchResult("nodes", figures, [_row(kind, told) for kind in KINDS])


# --- round trip -------------------------------------------------------------------------------------------


@asynccontextmanager
async def _elsewhere(*arguments: str) -> AsyncIterator[tuple[ZenohLink, int]]:
    """Another process on the loopback interface: a link to it, and its number."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "kempelen.bench.nodes_process", *arguments,
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
    )  # fmt: skip
    try:
        greeting = await process.stdout.readline() if process.stdout else b""
        endpoint = greeting.decode().strip()
        async with ZenohLink(Network(connect=(endpoint,), discover=False)) as link:
            yield link, process.pid
    finally:
        if process.stdin is not None:
            process.stdin.close()
        await process.wait()


async def _round_trips() -> list[float]:
    async with _elsewhere("robot") as (link, _), RemoteRobot(link, "bench") as robot:
        trips: list[float] = []
        for _ in range(ROUND_TRIPS):
            started = time.perf_counter()
            await robot.recover()  # of a light robot: nothing to be done, but told and answered
            trips.append(time.perf_counter() - started)
        return trips


# --- link faults ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Told:
    """What came of one game."""

    kind: str
    lost: int
    doubled: int
    helps: int
    lives: int
    seconds: float


async def _all_faults(seed: int, faults: int, progress: Progress) -> list[_Told]:
    gate, told = asyncio.Semaphore(_AT_ONCE), list[_Told]()

    async def one(number: int) -> None:
        async with gate:
            with tempfile.TemporaryDirectory(prefix="kempelen-bench-") as folder:
                game = _FaultyGame(random.Random(f"{seed}-{number}"), Path(folder))  # noqa: S311 - no secrets
                told.append(await game.play())
            progress(f"link fault {len(told)} of {faults}", 0.1 + 0.8 * len(told) / faults)

    await asyncio.gather(*(one(number) for number in range(faults)))
    return told


class _FaultyGame:
    """A short game whose robot is at a node, with one fault of the link in mid-move."""

    def __init__(self, rng: random.Random, folder: Path) -> None:
        self._rng = rng
        self._folder = folder
        self._kind = rng.choice(KINDS)
        self._weather = Weather(rng)
        self._net = LocalNet(self._weather)
        self._table = Table()
        self._world = LightTable(self._table, start_layout(self._table, chess.Board()))
        self._score = _score()
        self._needed = _transfers(self._score, self._table)
        self._at = rng.randrange(self._needed)
        self._checkpoints = 0
        self._storm: asyncio.Task[None] | None = None

    async def play(self) -> _Told:
        started, lives = time.perf_counter(), 0
        link = self._net.join()
        async with link, LightRobot(self._table, self._world, pace=_PACE) as robot:
            async with RobotNode(robot, link, "bench", patience=_PATIENCE):
                state = None
                while (state is None or state.ended is None) and lives < _LIVES:
                    lives += 1
                    state = await self._live(first=lives == 1)
            if self._storm is not None:
                await self._storm
        return self._judge(state, lives, time.perf_counter() - started)

    async def _live(self, *, first: bool) -> GameState | None:
        """One arbiter, until the game is over or its link has been lost for too long."""
        pairing = Pairing.replay(self._score)
        with Journal(self._folder / "journal.sqlite3") as journal:
            log = new_game(journal, pairing, self._table) if first else journal.reopen(1)
            try:
                async with self._net.join() as link, RemoteRobot(link, "bench", waits=_WAITS) as robot:
                    arbiter = Arbiter(log, CartesianHand(robot, self._table), pairing, self._table)
                    arbiter.events.listen(self._hear)
                    await arbiter.run()
            except KempelenError:
                return log.state
            return log.state

    def _hear(self, event: events.Event) -> None:
        if isinstance(event, events.CheckpointReached) and event.checkpoint is Checkpoint.CARRYING:
            self._checkpoints += 1
            if self._checkpoints > self._at and self._storm is None:
                self._storm = asyncio.create_task(self._break())

    async def _break(self) -> None:
        """The fault, at an instant of the carry."""
        rng, weather = self._rng, self._weather
        await asyncio.sleep(rng.uniform(0.0, 0.12))
        match self._kind:
            case "cut":
                weather.cut = True
                await asyncio.sleep(rng.uniform(0.02, 1.2))
            case "long cut":
                weather.cut = True
                await asyncio.sleep(_WAITS.lost + rng.uniform(0.5, 1.0))
            case "delay":
                weather.delay = (rng.uniform(0.0, 0.3), rng.uniform(0.3, 0.6))
                await asyncio.sleep(rng.uniform(0.3, 1.0))
            case "reorder":
                weather.delay = (0.0, rng.uniform(0.05, 0.5))
                await asyncio.sleep(rng.uniform(0.3, 1.5))
            case "loss":
                weather.loss = rng.uniform(0.3, 0.9)
                await asyncio.sleep(rng.uniform(0.3, 1.5))
            case _:
                weather.twice, weather.delay = 1.0, (0.0, rng.uniform(0.0, 0.1))
                await asyncio.sleep(rng.uniform(0.3, 1.5))
        weather.cut, weather.loss, weather.twice, weather.delay = False, 0.0, 0.0, (0.0, 0.0)

    def _judge(self, state: GameState | None, lives: int, seconds: float) -> _Told:
        played = [] if state is None else state.board.move_stack
        missing = sum(1 for wanted in self._score.moves[len(played) :]) + sum(
            1 for made, wanted in zip(played, self._score.moves, strict=False) if made != wanted
        )
        if state is not None and not missing and state.layout != self._world.layout:
            missing += 1
        return _Told(
            kind=self._kind,
            lost=missing + len(self._world.faults),
            doubled=max(self._world.carried - self._needed, 0),
            helps=state.helps if state is not None else 0,
            lives=lives,
            seconds=seconds,
        )


def _score() -> GameScore:
    board = chess.Board()
    moves = [board.push_san(san) for san in _MOVES]
    return GameScore({}, chess.STARTING_FEN, tuple(moves))


def _transfers(score: GameScore, table: Table) -> int:
    """How many pieces have to be carried."""
    board, layout, count = score.start_board(), start_layout(table, chess.Board()), 0
    for move in score.moves:
        transfers = move_transfers(board, move, layout, table)
        if isinstance(transfers, Request):
            raise TypeError("the moves of this bench need nothing that the table lacks")
        for transfer in transfers:
            layout = layout.after(transfer)
        count += len(transfers)
        board.push(move)
    return count


def _row(kind: str, told: list[_Told]) -> dict[str, Any]:
    games = [game for game in told if game.kind == kind]
    return {
        "fault": kind,
        "games": len(games),
        "lost": sum(game.lost for game in games),
        "doubled": sum(game.doubled for game in games),
        "resumed": sum(game.lives - 1 for game in games),
        "interventions": sum(game.helps for game in games),
        "s_mean": round(statistics.mean(game.seconds for game in games), 2) if games else 0.0,
    }


# --- the hall ---------------------------------------------------------------------------------------------


async def _hall(tables: int) -> dict[str, float]:
    """A hall in another process, beside one with a single table for what a process costs by itself."""
    alone = await _watched(1)
    many = await _watched(tables)
    each = max(tables - 1, 1)
    return {
        "tables": tables,
        "tables_seen": many.seen,
        "mb_per_table": round((many.memory_mb - alone.memory_mb) / each, 3),
        "cpu_percent_per_table": round(100 * (many.busy - alone.busy) / each, 3),
        "hall_mb": round(many.memory_mb, 1),
        "hall_cpu_percent": round(100 * many.busy, 1),
        "news_per_s": round(many.news_per_s, 1),
    }


@dataclass
class _Watched:
    seen: int
    memory_mb: float
    busy: float
    news_per_s: float


async def _watched(tables: int) -> _Watched:
    async with _elsewhere("hall", str(tables)) as (link, pid):
        news = 0

        def count(_table: str) -> None:
            nonlocal news
            news += 1

        view = HallView(link, count)
        await view.open()
        await asyncio.sleep(_HALL_S / 4)  # everything is set up
        before, first, started = _busy_s(pid), news, time.perf_counter()
        await asyncio.sleep(_HALL_S)
        seconds = time.perf_counter() - started
        seen = sum(seen.here and seen.status is not None for seen in view.tables.values())
        return _Watched(seen, _memory_mb(pid), (_busy_s(pid) - before) / seconds, (news - first) / seconds)


def _busy_s(pid: int) -> float:
    """Processor time of a process so far (proc(5): utime and stime, 100 to the second)."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / 100


def _memory_mb(pid: int) -> float:
    """What of its memory is its own alone or shared with nobody who counts it, too: VmRSS."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return 0.0
