"""Random transfers in physics, without wire or controller: placement, neighbours and speed.

The hand is driven with trapezoidal profiles per axis, x and y moving while z is above everything. Before each
transfer its piece is put up to ``--scatter`` mm off centre and turned at random.

    python bench/physics_transfers.py --transfers 300 --seed 1 --json out.json
"""

import argparse
import json
import math
import sys
import time
from pathlib import Path

import chess
import numpy as np

from kempelen.core.geometry import Array, Transform
from kempelen.core.places import Place
from kempelen.core.table import Table, start_layout
from kempelen.testing.world_driver import WorldDriver
from kempelen.twin.physics import Scene, World

WORTH_SHOWING = 0.5


def measure(args: argparse.Namespace) -> dict[str, float]:
    """Run the transfers and gather the figures."""
    turn = Transform.about_z(math.radians(args.turn_deg), (150.0, 25.0, 0.0))
    table = Table(robot_from_board=turn)
    world = World(Scene.from_layout(table, start_layout(table, chess.Board()), seed=args.seed))
    where = {p.piece_id: _place_under(table, p.x, p.y) for p in world.scene.pieces}
    rng = np.random.default_rng(args.seed)
    driver = WorldDriver(world, speed=args.speed, rate=args.rate)
    errors, moved, seconds, toppled = [], [0.0], [], 0
    wall = 0.0
    for _ in range(args.transfers):
        piece = world.scene.pieces[rng.integers(len(where))]
        taken = set(where.values())
        free = [place for place in table.places if place not in taken]
        source, target = where[piece.piece_id], free[rng.integers(len(free))]
        _scatter(driver, piece.piece_id, table.centre(source), args.scatter, rng)
        before = {p.piece_id: p for p in world.pieces()}
        begun = time.perf_counter()
        seconds.append(driver.transfer(piece.kind, source, target))
        wall += time.perf_counter() - begun
        where[piece.piece_id] = target
        after = world.pieces()
        moved += [
            p.distance(before[p.piece_id].x, before[p.piece_id].y)
            for p in after
            if p.piece_id != piece.piece_id
        ]
        toppled += sum(not p.upright for p in after)
        x, y, _ = table.centre(target)
        errors.append(world.piece(piece.piece_id).distance(float(x), float(y)))
        if args.verbose or errors[-1] > WORTH_SHOWING:
            sys.stdout.write(f"{source} {target} {errors[-1]:.3f} mm {world.piece(piece.piece_id)}\n")
    return {
        "transfers": len(errors),
        "mean_mm": float(np.mean(errors)),
        "p95_mm": float(np.percentile(errors, 95)),
        "max_mm": max(errors),
        "toppled": toppled,
        "neighbour_max_mm": max(moved),
        "transfer_s_median": float(np.median(seconds)),
        "realtime_factor": sum(seconds) / wall,
    }


def _place_under(table: Table, x: float, y: float) -> Place:
    return min(table.places, key=lambda place: math.dist(table.centre(place)[:2], (x, y)))


def _scatter(
    driver: WorldDriver, piece_id: str, centre: Array, scatter: float, rng: np.random.Generator
) -> None:
    radius, angle = scatter * math.sqrt(rng.random()), rng.uniform(0, math.tau)
    x, y = float(centre[0] + radius * math.cos(angle)), float(centre[1] + radius * math.sin(angle))
    driver.world.place(piece_id, x, y, turn=rng.uniform(0, math.tau))
    driver.settle(closed=False)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--transfers", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scatter", type=float, default=3.0, help="mm")
    parser.add_argument("--speed", type=float, default=300.0, help="mm/s")
    parser.add_argument("--rate", type=float, default=1500.0, help="acceleration, mm/s²")
    parser.add_argument("--turn-deg", type=float, default=0.0, help="of the board")
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    figures = measure(args)
    for name, value in figures.items():
        sys.stdout.write(f"{name:>20}  {value:.4g}\n")
    if args.json:
        args.json.write_text(json.dumps({"bench": "physics_transfers", "figures": figures, "rows": []}))


if __name__ == "__main__":
    main()
