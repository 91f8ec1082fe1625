"""How well the pieces were really placed: the twin's ground truth against what the game says.

For reports only. No driver, tracker or arbiter sees any of it (decision 1).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import chess
import numpy as np

from kempelen.core.places import Layout, Place
from kempelen.core.table import Table

TOPPLED_RAD = math.radians(30)
NEIGHBOUR_MM = 1.0


class Pose(NamedTuple):
    """A piece's base centre, robot frame, mm, and its lean, rad."""

    x: float
    y: float
    z: float
    tilt: float


def poses(truth: Mapping[str, Any]) -> dict[str, Pose]:
    """Piece id to pose, from the twin's answer to ``truth``."""
    return {p["id"]: Pose(p["x"], p["y"], p["z"], p["tilt"]) for p in truth["pieces"]}


@dataclass(frozen=True, slots=True)
class Placement:
    """Summary over all transfers; lengths in mm."""

    n: int
    mean_mm: float
    p95_mm: float
    max_mm: float
    toppled: int
    neighbour_max_mm: float


@dataclass
class PlacementAudit:
    """Collects errors move by move.

    Attributes:
        errors: Distance of each placed piece from its place's centre, mm.
        neighbours: Furthest that a piece not being carried moved, for each move, mm.
        lost: Sentences about places that do not hold what the game says.
    """

    table: Table
    before: dict[str, Pose]
    errors: list[float] = field(default_factory=list)
    neighbours: list[float] = field(default_factory=list)
    toppled: int = 0
    lost: list[str] = field(default_factory=list)

    def after_move(self, placed: Mapping[Place, chess.Piece], truth: Mapping[str, Any]) -> None:
        """Measure once the pieces of a move have settled.

        Args:
            placed: Where the move put pieces, and which.
            truth: The twin's answer to ``settle``.
        """
        now = poses(truth)
        kinds = {p["id"]: (p["kind"], p["white"]) for p in truth["pieces"]}
        carried = set()
        for place, piece in placed.items():
            name, error = self._nearest(place, now)
            carried.add(name)
            self.errors.append(error)
            if kinds[name] != (piece.symbol().upper(), piece.color) or error > self.table.square / 2:
                self.lost.append(f"{place} should hold {piece.symbol()}, nearest is {name} at {error:.1f} mm")
        self.toppled += sum(
            pose.tilt > TOPPLED_RAD >= self.before.get(name, pose).tilt
            or (pose.tilt > TOPPLED_RAD and name in carried)
            for name, pose in now.items()
        )
        self.neighbours.append(self._furthest_neighbour(now, carried))
        self.before = now

    def _nearest(self, place: Place, now: Mapping[str, Pose]) -> tuple[str, float]:
        centre = self.table.centre(place)
        distance = {name: math.hypot(p.x - centre[0], p.y - centre[1]) for name, p in now.items()}
        name = min(distance, key=distance.__getitem__)
        return name, distance[name]

    def _furthest_neighbour(self, now: Mapping[str, Pose], carried: set[str]) -> float:
        moved = [
            math.hypot(pose.x - self.before[name].x, pose.y - self.before[name].y)
            for name, pose in now.items()
            if name not in carried and name in self.before
        ]
        return max(moved, default=0.0)

    @property
    def collisions(self) -> int:
        """Moves in which a piece that was not carried moved over 1 mm."""
        return sum(distance > NEIGHBOUR_MM for distance in self.neighbours)

    def summary(self) -> Placement:
        """Over everything measured so far."""
        errors = np.array(self.errors or [0.0])
        return Placement(
            n=len(self.errors),
            mean_mm=round(float(errors.mean()), 4),
            p95_mm=round(float(np.percentile(errors, 95)), 4),
            max_mm=round(float(errors.max()), 4),
            toppled=self.toppled,
            neighbour_max_mm=round(max(self.neighbours, default=0.0), 4),
        )


def disagreements(
    table: Table, layout: Layout, truth: Mapping[str, Any], tolerance: float = 5.0
) -> list[str]:
    """Where the physical table and a layout differ; empty when they agree.

    Args:
        table: Where the places are.
        layout: What the game says.
        truth: The twin's answer to ``settle``.
        tolerance: From the centre of a place, mm.
    """
    left = {p["id"]: p for p in truth["pieces"]}
    wrong = []
    for place, piece in layout.items():
        x, y, _ = table.centre(place)
        here = [p for p in left.values() if math.hypot(p["x"] - x, p["y"] - y) <= tolerance]
        match = [p for p in here if (p["kind"], p["white"]) == (piece.symbol().upper(), piece.color)]
        if not match:
            seen = ", ".join(p["id"] for p in here) or "nothing"
            wrong.append(f"{place}: the game says {piece.symbol()}, the table has {seen}")
            continue
        if match[0]["tilt"] > TOPPLED_RAD:
            wrong.append(f"{place}: {piece.symbol()} has fallen over")
        left.pop(match[0]["id"])
    return wrong


def standing_error(table: Table, begun: Layout, layout: Layout, truth: Mapping[str, Any]) -> float:
    """Distance, mm, from its place's centre of the worst piece that the game has put anywhere.

    Args:
        table: Where the places are.
        begun: What stood where when the game began: what still stands there may never have been touched.
        layout: What the game says stands where.
        truth: The twin's answer to ``settle``.
    """
    moved = [table.centre(place) for place, piece in layout.items() if begun.get(place) != piece]
    return max(
        (min(math.hypot(p["x"] - x, p["y"] - y) for p in truth["pieces"]) for x, y, _ in moved), default=0.0
    )
