"""`kempelen bench arm`: whole games by the simulated Lab-Volt 5150, on 35 mm squares, with all its drift.

Three parts: the famous and the special games, as `kempelen bench twin` plays them with a gantry; more special
games until there are twenty, in all of which no grasp may fail; and the same arm with nothing done about its
drift, until it misses a piece: the paper's queen first, then the twenty games.
"""

import asyncio
import statistics
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import chess

from kempelen.app.cast import GameRequest
from kempelen.app.live_game import LiveGame
from kempelen.app.measure import Measurements
from kempelen.app.report import GameReport
from kempelen.bench.result import BenchResult, Progress, short_title
from kempelen.bench.special_games import special_game
from kempelen.bench.twin import Totals, bench_games, nobody, play_score, row_of, twin_config
from kempelen.core import events
from kempelen.core.errors import KempelenError
from kempelen.game.modes import Mode
from kempelen.game.pgn import GameScore

GAMES = 20
"""In which no grasp may fail."""
ARM = {"robot.kind": "arm"}
UNCARED = {**ARM, "robot.options": {"drift_budget": False}}
"""Nothing is done about the drift."""

_QUEEN_FEN = "3k4/8/8/8/8/7K/8/4Q3 w - - 0 1"
_KING_WAYS = ("Kc8", "Kg3", "Kd8", "Kh3")
_MOST_BETWEEN = 15


@dataclass
class _Outcome:
    """One game by the arm.

    Attributes:
        rehomings: How often the arm was homed for the sake of the next grasp.
        failed: What it did not put where it belongs, or knocked over, a sentence each.
        ended: What cut the game off; empty when it was played to its end.
    """

    report: GameReport
    taken: Measurements
    rehomings: int
    failed: list[str]
    ended: str = ""


@dataclass
class _Arm:
    """What all the games of the arm come to."""

    totals: Totals = field(default_factory=Totals)
    rehomings: int = 0
    transfers: int = 0
    failed: int = 0
    helps: int = 0
    rows: list[dict[str, Any]] = field(default_factory=list)

    def add(self, score: GameScore, outcome: _Outcome, wall: float, *, judged: bool) -> None:
        self.rehomings += outcome.rehomings
        self.transfers += outcome.report.transfers
        self.failed += len(outcome.failed)
        self.helps += outcome.report.interventions
        if judged:
            self.totals.add(outcome.report, outcome.taken)
        row = row_of(score, outcome.report, outcome.taken, wall)
        row["rehomings"] = outcome.rehomings
        row["failed"] = len(outcome.failed)
        self.rows.append({"data": "with the drift in check", **row})


def run(
    *, seed: int, pgn: Path | None, data: Path | None, games: int = GAMES, progress: Progress
) -> BenchResult:
    """Play all of it.

    Args:
        seed: Of the special games, of how the pieces stand and of the drift.
        pgn: Other games instead of the first fifteen.
        data: Not used.
        games: How many in all; with fewer, the first ones.
        progress: Told before each game.
    """
    del data
    first = bench_games(seed, pgn)[:games]
    more = [special_game(seed + len(first) + number) for number in range(games - len(first))]
    arm = _with_care([*first, *more], len(first), seed, progress)
    progress("The gantry, for comparison", 0.55)
    _, gantry = asyncio.run(play_score(first[0], seed))
    queen, queen_rows = _queen(seed, progress)
    missed, rows = _without_care([*first, *more], seed, progress)
    figures = arm.totals.figures() | {
        "interventions": arm.helps,
        "failed_grasps": arm.failed,
        "failed_grasps_uncorrected": missed,
        "queen_missed_after": queen,
        "rehomings": arm.rehomings,
        "rehomings_per_100": round(100 * arm.rehomings / max(arm.transfers, 1), 1),
        "games": len(arm.rows),
        "transfer_s": _transfer_s(arm.totals.seconds),
        "gantry_transfer_s": _transfer_s([report.seconds for report in gantry.reports]),
    }
    return BenchResult("arm", figures, [*arm.rows, *queen_rows, *rows])


def _transfer_s(seconds: list[float]) -> float:
    return round(statistics.mean(seconds), 3) if seconds else 0.0


def _with_care(games: list[GameScore], judged: int, seed: int, progress: Progress) -> _Arm:
    arm = _Arm()
    for number, score in enumerate(games):
        progress(score.title, 0.5 * number / len(games))
        started = time.perf_counter()
        outcome = asyncio.run(play(score, seed + number, ARM))
        arm.add(score, outcome, time.perf_counter() - started, judged=number < judged)
    return arm


def _queen(seed: int, progress: Progress) -> tuple[int, list[dict[str, Any]]]:
    """The paper's queen, with nothing done about the drift: set down, and missed some moves later.

    Returns:
        After how many moves of the arm with other pieces she is missed, 0 for never; and a row for each try,
        which is a game of its own.
    """
    rows = list[dict[str, Any]]()
    for between in range(1, _MOST_BETWEEN + 1, 2):
        progress(f"A queen, {between} moves after she was set down", 0.6)
        outcome = asyncio.run(play(_queen_after(between), seed, UNCARED))
        missed = [what for what in outcome.failed if "should hold Q" in what]
        what = missed or outcome.failed
        rows.append({"data": "a queen gripped again", "moves": between, "missed": what[0] if what else ""})
        if missed:
            return between, rows
    return 0, rows


def _queen_after(between: int) -> GameScore:
    """A queen is moved, then two kings so many times, then she again."""
    board = chess.Board(_QUEEN_FEN)
    steps = ["Qb4", *(_KING_WAYS[number % 4] for number in range(between)), "Qb1"]
    moves = tuple(board.push_san(step) for step in steps)
    return GameScore({"White": "Queen", "Black": "nobody"}, _QUEEN_FEN, moves, "*")


def _without_care(games: list[GameScore], seed: int, progress: Progress) -> tuple[int, list[dict[str, Any]]]:
    """Games that end with a missed piece, and their table."""
    missed, rows = 0, list[dict[str, Any]]()
    for number, score in enumerate(games):
        progress(f"{score.title}, uncorrected", 0.65 + 0.35 * number / len(games))
        outcome = asyncio.run(play(score, seed + number, UNCARED, until_failure=True))
        missed += bool(outcome.failed or outcome.ended)
        what = outcome.failed[0] if outcome.failed else outcome.ended
        rows.append(
            {
                "data": "nothing done about the drift, until a piece is missed",
                "game": short_title(score.headers),
                "plies": outcome.report.plies,
                "transfers": outcome.report.transfers,
                "missed": what,
            }
        )
    return missed, rows


async def play(
    score: GameScore,
    seed: int,
    overrides: Mapping[str, object],
    *,
    until_failure: bool = False,
) -> _Outcome:
    """Play a game by the arm as fast as the twin can, without eyes.

    Args:
        score: The game.
        seed: Of how the pieces stand and of the drift.
        overrides: Of the configuration.
        until_failure: End it as soon as a piece is not where it belongs.
    """
    with tempfile.TemporaryDirectory(prefix="kempelen-bench-") as folder:
        config = twin_config(folder, seed, overrides)
        request = GameRequest(Mode.REPLAY, score.start_fen, score=score)
        async with LiveGame(config, request, nobody) as game:
            return await _played(game, until_failure=until_failure)


async def _played(game: LiveGame, *, until_failure: bool) -> _Outcome:
    taken, ended = game.measurements, ""
    playing = asyncio.ensure_future(game.play())

    def watch(event: events.Event) -> None:
        if until_failure and isinstance(event, events.MoveProposed) and _failed(taken):
            playing.cancel()

    game.arbiter.events.listen(watch)
    try:
        report = await playing
    except asyncio.CancelledError:
        if (this := asyncio.current_task()) is not None and this.cancelling():  # Ctrl-C, and not ours
            raise
        report = game.report()
    except KempelenError as error:
        if not until_failure:
            raise
        report, ended = game.report(), str(error)
    careful = game.session.careful
    return _Outcome(report, taken, careful.rehomings if careful else 0, _failed(taken), ended)


def _failed(taken: Measurements) -> list[str]:
    return [*taken.lost, *["a piece has fallen over"] * taken.toppled]
