"""`kempelen bench setup`: positions set up in the fewest transfers, planned for and in physics.

Pairs of positions out of random games, planned for from one to the other; a plan is optimal when it has as
many transfers as the formula says (`kempelen.motion.setting_up`, which the tests hold against a search).
Beside them stand two ways of doing without a planner: clear the board and set everything anew, and the same
transfers with targets and order taken at random. Then whole games are played on the twin, and after each one
the robot sets up the board again.
"""

import asyncio
import random
import statistics
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import chess
import numpy as np

from kempelen.app.cast import GameRequest
from kempelen.app.config import Config
from kempelen.app.live_game import LiveGame
from kempelen.app.report import GameReport
from kempelen.app.standing import LAST, setup_request
from kempelen.bench.motion import random_position
from kempelen.bench.result import BenchResult, Progress, short_title
from kempelen.bench.twin import bench_games, nobody, twin_config
from kempelen.core.places import Layout, Place
from kempelen.core.table import FULL_SET, Table, start_layout
from kempelen.game.modes import Mode
from kempelen.game.pgn import GameScore
from kempelen.motion.setting_up import Differences, plan_setting_up

PAIRS = 1000
RESETS = 10
_PLANNED = 0.3  # share of the time that the plans take


@dataclass
class _Plans:
    """What came of the pairs."""

    optimal: int = 0
    seconds: list[float] = field(default_factory=list)
    transfers: list[int] = field(default_factory=list)
    anew: list[int] = field(default_factory=list)
    travel: list[float] = field(default_factory=list)

    def figures(self) -> dict[str, float]:
        return {
            "pairs": len(self.transfers),
            "optimal": self.optimal,
            "plan_ms_p50": round(1e3 * statistics.median(self.seconds), 3),
            "plan_ms_p95": round(1e3 * float(np.percentile(self.seconds, 95)), 3),
            "plan_ms_max": round(1e3 * max(self.seconds), 3),
            "transfers_mean": round(statistics.mean(self.transfers), 2),
            "anew_over_fewest": round(sum(self.anew) / sum(self.transfers), 3),
            "travel_over_random": round(statistics.mean(self.travel), 3),
        }


def run(
    *,
    seed: int,
    pgn: Path | None,
    data: Path | None,
    progress: Progress,
    pairs: int = PAIRS,
    resets: int = RESETS,
) -> BenchResult:
    """Plan for pairs of positions, then set up the board after games on the twin.

    Args:
        seed: Of the positions and of the special games.
        pgn: Games to be played instead.
        data: Not used.
        progress: Told now and then.
        pairs: How many pairs of positions.
        resets: How many games at most.
    """
    del data
    plans = _planned(random.Random(seed), pairs, progress)  # noqa: S311 - seeded positions, not secrets
    rows, reports = list[dict[str, Any]](), list[GameReport]()
    scores = bench_games(seed, pgn)[:resets]
    for number, score in enumerate(scores):
        progress(score.title, _PLANNED + (1 - _PLANNED) * number / len(scores))
        report = asyncio.run(_reset_after(score, seed + number))
        reports.append(report)
        rows.append(_row(score, report))
    return BenchResult("setup", {**plans.figures(), **_resets(reports)}, rows)


# --- plans ------------------------------------------------------------------------------------------------


def _planned(rng: random.Random, pairs: int, progress: Progress) -> _Plans:
    table, plans = Table(), _Plans()
    for number in range(pairs):
        if number % 50 == 0:
            progress(f"pair {number + 1} of {pairs}", _PLANNED * number / pairs)
        standing = start_layout(table, _of_one_set(rng))
        wanted = _of_one_set(rng).piece_map()
        started = time.perf_counter()
        plan = plan_setting_up(table, standing, wanted)
        plans.seconds.append(time.perf_counter() - started)
        after = standing
        for transfer in plan.transfers:
            after = after.after(transfer)
        right = after.board_part() == wanted and len(plan.transfers) == plan.fewest
        plans.optimal += right
        plans.transfers.append(len(plan.transfers))
        plans.anew.append(len(standing.board_part()) + len(wanted))
        plans.travel.append(plan.travel / max(_random_travel(table, standing, wanted, rng), 1.0))
    return plans


def _of_one_set(rng: random.Random) -> chess.Board:
    """A position that can be set up with 32 pieces and the spare queens."""
    while True:
        board = random_position(rng)
        counts = [
            len(board.pieces(kind, colour)) - FULL_SET[kind] for kind in FULL_SET for colour in chess.COLORS
        ]
        if max(counts) <= 0:
            return board


def _random_travel(
    table: Table, standing: Layout, wanted: dict[chess.Square, chess.Piece], rng: random.Random
) -> float:
    """The hand's way, mm, when like pieces go to targets at random, in a random order that is possible.

    Pieces that wait for each other are taken as if their targets were free, in favour of the random way.
    """
    ways = _random_pairs(table, standing, wanted, rng)
    rng.shuffle(ways)
    points = np.array([point for source, target in ways for point in (source, target)])
    return float(np.hypot(*np.diff(points, axis=0).T).sum()) if len(points) else 0.0


def _random_pairs(
    table: Table, standing: Layout, wanted: dict[chess.Square, chess.Piece], rng: random.Random
) -> list[tuple[Any, Any]]:
    differences = Differences.between(standing, wanted)
    free = [table.centre(slot)[:2] for slot in table.slots if slot not in standing]
    ways: list[tuple[Any, Any]] = []
    for piece in {*standing.values()}:
        wrong = [Place.at(s) for s, held in differences.wrong.items() if held == piece]
        trays = [place for place, held in standing.items() if held == piece and not place.is_square]
        targets = [Place.at(s) for s, meant in differences.unfilled.items() if meant == piece]
        for pool in (wrong, trays, targets):
            rng.shuffle(pool)
        sources = wrong + trays[: max(len(targets) - len(wrong), 0)]
        ends = [table.centre(place)[:2] for place in targets]
        ends += [rng.choice(free) for _ in range(len(sources) - len(ends))]
        ways += [(table.centre(source)[:2], end) for source, end in zip(sources, ends, strict=True)]
    return ways


# --- in physics -------------------------------------------------------------------------------------------


async def _reset_after(score: GameScore, seed: int) -> GameReport:
    """Play a game, then have the robot set up the board again; the report of that."""
    with tempfile.TemporaryDirectory(prefix="kempelen-bench-") as folder:
        config = twin_config(folder, seed)
        await _played(config, GameRequest(Mode.REPLAY, score.start_fen, score=score))
        return await _played(config, setup_request(config, chess.STARTING_FEN, LAST))


async def _played(config: Config, request: GameRequest) -> GameReport:
    async with LiveGame(config, request, nobody) as game:
        return await game.play()


def _resets(reports: list[GameReport]) -> dict[str, float]:
    placements = [report.placement for report in reports if report.placement is not None]
    return {
        "resets": len(reports),
        "reset_transfers": sum(report.transfers for report in reports),
        "interventions": sum(report.interventions for report in reports),
        "disagreements": sum(len(report.disagreements) for report in reports),
        "toppled": sum(placement.toppled for placement in placements),
        "max_mm": max((placement.max_mm for placement in placements), default=0.0),
    }


def _row(score: GameScore, report: GameReport) -> dict[str, Any]:
    placement = report.placement
    return {
        "after the game": short_title(score.headers),
        "transfers": report.transfers,
        "mean_mm": placement.mean_mm if placement else 0.0,
        "max_mm": placement.max_mm if placement else 0.0,
        "toppled": placement.toppled if placement else 0,
        "interventions": report.interventions,
        "robot_s": report.robot_time_s,
    }
