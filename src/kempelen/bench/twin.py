"""`kempelen bench twin`: whole games in physics, over the wire, measured against the ground truth."""

import asyncio
import statistics
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np

from kempelen.app.cast import GameRequest
from kempelen.app.config import Config, load_config
from kempelen.app.live_game import LiveGame
from kempelen.app.measure import Measurements
from kempelen.app.people import Question
from kempelen.app.report import GameReport
from kempelen.bench.result import BenchResult, Progress, short_title
from kempelen.bench.special_games import special_game
from kempelen.game.modes import Mode
from kempelen.game.pgn import GameScore, list_games, read_game

SPECIAL_GAMES = 10


@dataclass
class Totals:
    """Of many games.

    Attributes:
        seconds: Of each transfer.
        wrong: Sentences about pieces that are not where the game says.
    """

    errors: list[float] = field(default_factory=list)
    quiet_s: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    working_s: float = 0.0
    wall_s: float = 0.0
    wrong: list[str] = field(default_factory=list)
    reports: list[GameReport] = field(default_factory=list)

    def add(self, report: GameReport, taken: Measurements) -> None:
        """Take in one more game."""
        self.reports.append(report)
        self.errors += taken.errors
        self.seconds += [one.seconds for one in taken.reports]
        self.quiet_s += [move.seconds for move in taken.moves if move.transfers == 1]
        working, wall = taken.twin_seconds
        self.working_s += working
        self.wall_s += wall
        self.wrong += report.disagreements

    def figures(self) -> dict[str, float]:
        """What `kempelen bench twin` is judged by."""
        placements = [report.placement for report in self.reports if report.placement is not None]
        return {
            "transfers": len(self.errors),
            "mean_mm": round(float(np.mean(self.errors)), 4),
            "p95_mm": round(float(np.percentile(self.errors, 95)), 4),
            "max_mm": round(max(self.errors), 4),
            "toppled": sum(placement.toppled for placement in placements),
            "neighbour_max_mm": max(placement.neighbour_max_mm for placement in placements),
            "interventions": sum(report.interventions for report in self.reports),
            "disagreements": len(self.wrong),
            "realtime_factor": round(self.working_s / self.wall_s, 2),
            "move_s_median": round(statistics.median(self.quiet_s), 3),
        }


def run(*, seed: int, pgn: Path | None, data: Path | None, progress: Progress) -> BenchResult:
    """Play the five famous games and ten seeded special ones, or the games of ``pgn``.

    Args:
        seed: Of the special games and of how the pieces stand.
        pgn: Other games instead.
        data: Not used.
        progress: Told before each game.
    """
    del data
    scores = bench_games(seed, pgn)
    totals, rows = Totals(), list[dict[str, Any]]()
    for number, score in enumerate(scores):
        progress(score.title, number / len(scores))
        started = time.perf_counter()
        report, taken = asyncio.run(play_score(score, seed + number))
        totals.add(report, taken)
        rows.append(row_of(score, report, taken, time.perf_counter() - started))
    return BenchResult("twin", totals.figures(), rows)


def bench_games(seed: int, pgn: Path | None) -> list[GameScore]:
    """The famous games and the special ones, or those of a file."""
    if pgn is not None:
        return [read_game(pgn, heading.index) for heading in list_games(pgn)]
    return famous_games() + [special_game(seed + number) for number in range(SPECIAL_GAMES)]


def famous_games() -> list[GameScore]:
    """The five games of the thesis."""
    with as_file(files("kempelen") / "data" / "famous.pgn") as path:
        return [read_game(path, heading.index) for heading in list_games(path)]


async def play_score(
    score: GameScore, seed: int, overrides: Mapping[str, object] | None = None
) -> tuple[GameReport, Measurements]:
    """Play a game on a twin as fast as it can, without eyes.

    Args:
        score: The game.
        seed: Of how the pieces stand.
        overrides: Of the configuration, beside that.
    """
    with tempfile.TemporaryDirectory(prefix="kempelen-bench-") as folder:
        config = twin_config(folder, seed, overrides)
        async with LiveGame(config, GameRequest(Mode.REPLAY, score.start_fen, score=score), nobody) as game:
            return await game.play(), game.measurements


def twin_config(folder: str, seed: int, overrides: Mapping[str, object] | None = None) -> Config:
    """A twin as fast as it can, without eyes.

    Args:
        folder: For its journal.
        seed: Of how the pieces stand.
        overrides: Of the configuration, beside that.
    """
    usual = {
        "data.dir": folder,
        "twin.speed": "max",
        "twin.seed": seed,
        "robot.port": "twin",
        "sensor.kind": "none",
    }
    return load_config(None, {**usual, **(overrides or {})})


async def nobody(question: Question) -> str:
    """Answer for a game that must ask nothing.

    Raises:
        RuntimeError: always.
    """
    raise RuntimeError(f"nobody is here to answer: {question.text}")


def row_of(score: GameScore, report: GameReport, taken: Measurements, wall: float) -> dict[str, Any]:
    """A line of the table of games."""
    placement = report.placement
    return {
        "game": short_title(score.headers),
        "plies": report.plies,
        "transfers": report.transfers,
        "mean_mm": placement.mean_mm if placement else 0.0,
        "max_mm": placement.max_mm if placement else 0.0,
        "toppled": placement.toppled if placement else 0,
        "neighbour_max_mm": placement.neighbour_max_mm if placement else 0.0,
        "interventions": report.interventions,
        "robot_s": report.robot_time_s,
        "realtime_factor": taken.twin_seconds[0] / max(taken.twin_seconds[1], 1e-9),
        "wall_s": wall,
    }
