"""`kempelen bench motion`: each planner's carries, as predicted and as the virtual controller drives them.

The same carries for all: those of the five famous games, of any PGN given, and of random legal
positions. Times are compared with the lower bound (see `kempelen.motion.race`); what the controller has
driven, sample by sample, goes through the swept test.
"""

import random
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import chess
import numpy as np

from kempelen.bench.result import BenchResult, Progress, short_title
from kempelen.bench.twin import famous_games
from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceShape
from kempelen.core.places import Layout, Transfer
from kempelen.core.table import Table, WorkSpace, start_layout
from kempelen.game.pgn import GameScore, list_games, read_game
from kempelen.game.transfers import Missing, Request, move_transfers
from kempelen.motion.plan import Plan, plan_approach, plan_carry, plan_leave, propose_carry
from kempelen.motion.planners import DEFAULT_PLANNER, PLANNERS
from kempelen.motion.scene import Scene
from kempelen.motion.sweep import sweep
from kempelen.twin.grbl import execute

POSITIONS = 2000
_LONGEST_PLAYOUT = 120
_SAMPLE_S = 0.004


class Driven(NamedTuple):
    """A path with what it is driven through: what stands there, and what is held."""

    plan: Plan
    scene: Scene
    held: PieceShape | None


@dataclass
class _Tally:
    """What came of one planner's carries."""

    bounds: list[float] = field(default_factory=list)
    predicted: list[float] = field(default_factory=list)
    executed: list[float] = field(default_factory=list)
    segments: list[float] = field(default_factory=list)
    touching: int = 0

    def add(self, plan: Plan, executed: float, touching: bool) -> None:  # noqa: FBT001 - a record
        self.bounds.append(plan.bound)
        self.predicted.append(plan.seconds)
        self.executed.append(executed)
        self.segments.append((len(plan.vertices) - 1) / plan.seconds)
        self.touching += touching

    def over_bound(self, seconds: Sequence[float]) -> float:
        """Geometric mean of times over their bounds."""
        return float(np.exp(np.mean(np.log(np.asarray(seconds) / np.asarray(self.bounds)))))

    def row(self, carries: str, planner: str) -> dict[str, Any]:
        return {
            "carries": carries,
            "planner": planner,
            "n": len(self.bounds),
            "predicted_over_bound": round(self.over_bound(self.predicted), 4),
            "executed_over_bound": round(self.over_bound(self.executed), 4),
            "worst_over_bound": round(float(np.max(np.asarray(self.executed) / np.asarray(self.bounds))), 3),
            "collisions": self.touching,
        }


def run(
    *, seed: int, pgn: Path | None, data: Path | None, progress: Progress, positions: int = POSITIONS
) -> BenchResult:
    """Compare the planners.

    Args:
        seed: Of the random positions.
        pgn: Further games.
        data: Not used.
        progress: Told before each game and now and then between positions.
        positions: How many random legal positions.
    """
    del data
    comparison = _Comparison(Table())
    games = famous_games() + ([read_game(pgn, heading.index) for heading in list_games(pgn)] if pgn else [])
    for number, score in enumerate(games):
        progress(score.title, 0.5 * number / len(games))
        comparison.replay(score)
    rng = random.Random(seed)  # noqa: S311 - seeded positions, not secrets
    for number in range(positions):
        if number % 50 == 0:
            progress(f"random position {number + 1} of {positions}", 0.5 + 0.5 * number / positions)
        comparison.try_position(random_position(rng), rng)
    return BenchResult("motion", comparison.figures(), comparison.rows())


class _Comparison:
    """All planners on the same carries.

    Args:
        table: With the default sizes and limits.
    """

    def __init__(self, table: Table) -> None:
        self._table = table
        self._games: list[tuple[str, dict[str, _Tally]]] = []
        self._total = {name: _Tally() for name in PLANNERS}
        self._scattered = _Tally()
        self._planning: list[float] = []
        self._quiet: list[float] = []

    def figures(self) -> dict[str, float]:
        over = {name: tally.over_bound(tally.executed) for name, tally in self._total.items()}
        return {
            "executed_over_bound": round(over["asynchronous"], 4),
            "safe_height_over_bound": round(over["safe-height"], 4),
            "supercover_over_bound": round(over["supercover"], 4),
            "collisions": self._total[DEFAULT_PLANNER].touching + self._scattered.touching,
            "plan_ms_median": round(1000 * statistics.median(self._planning), 3),
            "quiet_move_s_median": round(statistics.median(self._quiet), 3),
            "carry_s_mean": round(statistics.fmean(self._total[DEFAULT_PLANNER].executed), 3),
            "lines_per_s_median": round(statistics.median(self._total[DEFAULT_PLANNER].segments), 1),
        }

    def rows(self) -> list[dict[str, Any]]:
        groups = [*self._games, ("all games", self._total)]
        rows = [
            tally.row(title, name) for title, group in groups for name, tally in group.items() if tally.bounds
        ]
        if self._scattered.bounds:
            rows.append(self._scattered.row("random, all legs", DEFAULT_PLANNER))
        return rows

    def replay(self, score: GameScore) -> None:
        """All carries of a game by every planner; the times of its moves with the default one."""
        tallies = {name: _Tally() for name in PLANNERS}
        self._games.append((short_title(score.headers), tallies))
        table, board = self._table, score.start_board()
        layout, gripper = start_layout(table, board), table.gripper
        here = table.park_point(table.centre(table.places[0]))
        for move in score.moves:
            steps = move_steps(board, move, layout, table)
            for before, transfer in steps:
                legs = self._plan(before, transfer, here)
                here, layout = legs[-1].plan.vertices[-1], before.after(transfer)
                self._carry(before, transfer, (tallies, self._total))
            if len(steps) == 1:
                waiting = gripper.close_seconds + gripper.open_seconds
                self._quiet.append(sum(leg.plan.seconds for leg in legs) + waiting)
            board.push(move)

    def try_position(self, board: chess.Board, rng: random.Random) -> None:
        """All legs of a legal move's transfers, driven by the virtual controller."""
        move = rng.choice(list(board.legal_moves))
        here = self._table.park_point(self._table.centre(rng.choice(self._table.places)))
        for before, transfer in move_steps(board, move, start_layout(self._table, board), self._table):
            legs = self._plan(before, transfer, here)
            here = legs[-1].plan.vertices[-1]
            for leg in legs:
                self._scattered.add(leg.plan, *driven(leg))

    def _plan(self, layout: Layout, transfer: Transfer, here: Array) -> list[Driven]:
        """From ``here`` to the piece, with it to its target, to parking: each leg checked, the time taken."""
        began = time.perf_counter()
        table, scene = self._table, Scene(self._table, layout)
        approach = plan_approach(scene, here, transfer.source)
        carry = plan_carry(scene, transfer)
        after = Scene(table, layout.after(transfer))
        leave = plan_leave(after, carry.vertices[-1])
        self._planning.append(time.perf_counter() - began)
        shape = table.pieces[transfer.piece.piece_type]
        return [
            Driven(approach, scene, None),
            Driven(carry, scene.without(transfer.source), shape),
            Driven(leave, after, None),
        ]

    def _carry(self, layout: Layout, transfer: Transfer, tallies: Sequence[dict[str, _Tally]]) -> None:
        """One carry by every planner."""
        for name in PLANNERS:
            leg, plan = propose_carry(Scene(self._table, layout), transfer, planner=name)
            outcome = driven(Driven(plan, leg.scene, leg.held))
            for tally in tallies:
                tally[name].add(plan, *outcome)


def move_steps(
    board: chess.Board, move: chess.Move, layout: Layout, table: Table
) -> list[tuple[Layout, Transfer]]:
    """The transfers of a move, each with what stands before it; the operator does what is asked."""
    wanted = move_transfers(board, move, layout, table)
    while isinstance(wanted, Request):
        if isinstance(wanted, Missing):
            layout = layout.having(wanted.place, wanted.piece)
        else:
            layout = layout.without(wanted.place)
        wanted = move_transfers(board, move, layout, table)
    steps = []
    for transfer in wanted:
        steps.append((layout, transfer))
        layout = layout.after(transfer)
    return steps


def random_position(rng: random.Random) -> chess.Board:
    """A legal position in which the game goes on: random play of random length."""
    while True:
        board = chess.Board()
        for _ in range(rng.randrange(_LONGEST_PLAYOUT)):
            if board.is_game_over():
                break
            board.push(rng.choice(list(board.legal_moves)))
        if not board.is_game_over():
            return board


# --- the virtual controller ------------------------------------------------------------------------------


def driven(leg: Driven) -> tuple[float, bool]:
    """Let the virtual controller drive it: the time, s, and whether what it drove touches anything."""
    space = leg.scene.table.space
    offset = np.array(space.robot_from_machine)
    points = leg.plan.vertices - offset
    lines = ["G90G0", *(f"X{x:.3f}Y{y:.3f}Z{z:.3f}" for x, y, z in points[1:].tolist())]
    x, y, z = points[0].tolist()
    execution = execute(
        lines, travel=space.travel, start=(x, y, z), settings=_settings(space), sample_s=_SAMPLE_S
    )
    return execution.time_s, bool(sweep(execution.samples[:, 1:] + offset, leg.scene, leg.held))


def _settings(space: WorkSpace) -> dict[int, float]:
    """The controller's numbers for the limits that were planned with."""
    settings = {11: space.junction_deviation}
    for axis in range(3):
        settings |= {110 + axis: 60 * space.velocity[axis], 120 + axis: space.acceleration[axis]}
    return settings
