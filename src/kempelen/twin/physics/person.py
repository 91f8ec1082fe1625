"""A person's hand: takes a piece, lifts it over the others and sets it down, not quite in the middle.

The hand may cheat where the robot may not: what it holds goes where the hand goes. Let go, the piece is as
free as any other.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from kempelen.core.errors import TwinError
from kempelen.core.geometry import Array
from kempelen.twin.physics.scene import StandingPiece
from kempelen.twin.physics.simulation import Simulation

Point = tuple[float, float, float]

REACH_SECONDS = 0.35
LIFT_SECONDS = 0.3
LOWER_SECONDS = 0.35
CARRY_SPEED = 700.0
"""Mean speed of a carry, mm/s."""
CARRY_SECONDS = 0.25
"""Least time of a carry, s."""
OVERHEAD = 30.0
"""Room between what is carried and the tallest piece, mm."""
RELEASE_HEIGHT = 0.3
NEARBY = 25.0
"""How far from where it should be a piece is still recognised, mm."""
DRAWER = (-1000.0, -1000.0)
"""Where further pieces come from, robot frame, mm: far from the machine."""
DRAWER_PITCH = 60.0


@dataclass(frozen=True, slots=True)
class Errand:
    """One piece to take somewhere.

    Attributes:
        number: Of the errand.
        piece: Number in the scene.
        target: (x, y, z) on the surface where the hand will let go, robot frame, mm.
        turn: Of the piece about its axis when let go, rad.
    """

    number: int
    piece: int
    target: Point
    turn: float


@dataclass(frozen=True, slots=True)
class Grasp:
    """An errand under way.

    Attributes:
        errand: What is to be done.
        source: (x, y, z) of the base's centre where the piece was taken, mm.
        attitude: (w, x, y, z) of the piece there.
        height: Of the base's centre during the carry, mm.
        elapsed: Seconds since the hand set out.
    """

    errand: Errand
    source: Point
    attitude: tuple[float, float, float, float]
    height: float
    elapsed: float = 0.0

    @property
    def carry_seconds(self) -> float:
        """Time of the way across."""
        way = math.dist(self.errand.target[:2], self.source[:2])
        return CARRY_SECONDS + min(way, 1000.0) / CARRY_SPEED

    @property
    def release_time(self) -> float:
        """When the hand lets go, s since it set out."""
        return REACH_SECONDS + LIFT_SECONDS + self.carry_seconds + LOWER_SECONDS

    @property
    def holding(self) -> bool:
        """Whether the piece is in the hand."""
        return REACH_SECONDS <= self.elapsed < self.release_time

    @property
    def done(self) -> bool:
        """Whether the hand is out of the way again."""
        return self.elapsed >= self.release_time + REACH_SECONDS

    def pose(self, elapsed: float) -> tuple[Array, Array]:
        """(3,) mm base's centre and (4,) attitude of the held piece at a time since the hand set out."""
        at = min(max(elapsed, REACH_SECONDS), self.release_time) - REACH_SECONDS
        up = _ease(at / LIFT_SECONDS)
        across = _ease((at - LIFT_SECONDS) / self.carry_seconds)
        down = _ease((at - LIFT_SECONDS - self.carry_seconds) / LOWER_SECONDS)
        source, goal = np.array(self.source), np.array(self.errand.target)
        where = source + across * (goal - source)
        lowered = goal[2] + RELEASE_HEIGHT
        where[2] = source[2] + up * (self.height - source[2]) + down * (lowered - self.height)
        return where, self._attitude(up)

    def _attitude(self, share: float) -> Array:
        """From how the piece stood or lay to upright."""
        start = np.array(self.attitude)
        end = np.array([math.cos(self.errand.turn / 2), 0.0, 0.0, math.sin(self.errand.turn / 2)])
        mixed = (1 - share) * start + share * (end if start @ end >= 0 else -end)
        return np.asarray(mixed / np.linalg.norm(mixed))


def _ease(share: float) -> float:
    """Minimum-jerk course from 0 to 1 (Flash and Hogan 1985)."""
    s = min(max(share, 0.0), 1.0)
    return s * s * s * (10 - 15 * s + 6 * s * s)


class Person:
    """The hand and its errands, one after the other.

    Args:
        simulation: Whose pieces it moves.
        seed: Of its clumsiness.
        slop: Greatest distance from where a piece was meant to stand, mm.
    """

    def __init__(self, simulation: Simulation, *, seed: int = 0, slop: float = 2.0) -> None:
        self._simulation = simulation
        self._rng = np.random.default_rng(seed)
        self._slop = slop
        self._errands: deque[Errand] = deque()
        self._grasp: Grasp | None = None
        self._asked = self._done = 0

    @property
    def busy(self) -> bool:
        """Whether the hand is over the table or will be."""
        return self._grasp is not None or bool(self._errands)

    def carry(self, source: tuple[float, float], target: Point) -> Callable[[], bool]:
        """Take the piece that stands near ``source`` to ``target`` on a surface, robot frame, mm.

        Returns:
            Whether that is done.

        Raises:
            TwinError: no piece is near the source.
        """
        away = np.linalg.norm(self._simulation.positions[:, :2] - np.array(source), axis=1)
        piece = int(away.argmin()) if len(away) else -1
        if piece < 0 or not away[piece] <= NEARBY:
            raise TwinError(
                f"The person finds no piece within {NEARBY:.0f} mm of ({source[0]:.1f}, {source[1]:.1f}) mm.",
                hint="Name a place where one stands.",
            )
        return self.take(piece, target)

    def supply(self, kind: str, white: bool, target: Point) -> Callable[[], bool]:  # noqa: FBT001
        """Bring a new piece of that kind and colour to ``target``; returns whether that is done."""
        number = len(self._simulation.scene.pieces)
        row, column = divmod(number, 8)
        x, y = DRAWER[0] - row * DRAWER_PITCH, DRAWER[1] - column * DRAWER_PITCH
        z = self._simulation.scene.table_top
        name = f"{'w' if white else 'b'}{kind}x{number}"
        return self.take(self._simulation.add(StandingPiece(name, kind, white, x, y, z)), target)

    def take(self, piece: int, target: Point) -> Callable[[], bool]:
        """Queue an errand for the piece of that number; returns whether it is done."""
        if not all(map(math.isfinite, target)):
            raise TwinError(f"A person cannot put a piece to {target} mm.", hint="Name a place.")
        radius, angle = self._slop * math.sqrt(self._rng.random()), self._rng.uniform(0, math.tau)
        turn = float(self._rng.uniform(-math.pi, math.pi))
        where = (target[0] + radius * math.cos(angle), target[1] + radius * math.sin(angle), target[2])
        self._asked += 1
        number = self._asked
        self._errands.append(Errand(number, piece, where, turn))
        return lambda: self._done >= number

    def advance(self, dt: float) -> None:
        """Let the hand go on for ``dt`` seconds; what it holds is given the speed to be there in time."""
        if self._grasp is None:
            if not self._errands:
                return
            self._grasp = self._reach_for(self._errands.popleft())
        grasp, piece = self._grasp, self._grasp.errand.piece
        if grasp.holding:
            (here, attitude), (there, _) = grasp.pose(grasp.elapsed), grasp.pose(grasp.elapsed + dt)
            self._simulation.put(piece, here, attitude, (there - here) / dt)
            self._simulation.bear(piece, 1.0)
        elif grasp.elapsed >= grasp.release_time:
            self._simulation.bear(piece, 0.0)
        if grasp.done:
            self._grasp, self._done = None, grasp.errand.number
        else:
            self._grasp = replace(grasp, elapsed=grasp.elapsed + dt)

    def _reach_for(self, errand: Errand) -> Grasp:
        positions, scene = self._simulation.positions, self._simulation.scene
        x, y, z = positions[errand.piece].tolist()
        w, i, j, k = self._simulation.attitude(errand.piece).tolist()
        height = float(positions[:, 2].max()) + scene.table.pieces.tallest + OVERHEAD
        return Grasp(errand, (x, y, z), (w, i, j, k), height)

    def state(self) -> dict[str, Any]:
        """JSON-able state."""
        return {
            "rng": self._rng.bit_generator.state,
            "errands": [asdict(errand) for errand in self._errands],
            "grasp": None if self._grasp is None else asdict(self._grasp),
            "asked": self._asked,
            "done": self._done,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from `state`."""
        self._rng.bit_generator.state = state["rng"]
        self._errands = deque(_errand(errand) for errand in state["errands"])
        self._grasp = _grasp(state["grasp"]) if state["grasp"] else None
        self._asked, self._done = int(state["asked"]), int(state["done"])


def _errand(state: dict[str, Any]) -> Errand:
    return Errand(**{**state, "target": tuple(state["target"])})


def _grasp(state: dict[str, Any]) -> Grasp:
    return Grasp(
        **{
            **state,
            "errand": _errand(state["errand"]),
            "source": tuple(state["source"]),
            "attitude": tuple(state["attitude"]),
        }
    )
