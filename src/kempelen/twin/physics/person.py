"""A person's hand: takes a piece, lifts it over the others and sets it down, not quite in the middle.

The hand may cheat where the robot may not: what it holds goes where the hand goes. Let go, the piece is as
free as any other.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from kempelen.core.errors import TwinError
from kempelen.core.geometry import Array
from kempelen.twin.physics.errand import Errand, Grasp, Point, errand_of
from kempelen.twin.physics.hand import resting_place
from kempelen.twin.physics.scene import StandingPiece
from kempelen.twin.physics.simulation import Simulation

OVERHEAD = 30.0
"""Room between what is carried and the tallest piece, mm."""
NEARBY = 25.0
"""How far from where it should be a piece is still recognised, mm."""
DRAWER = (-1000.0, -1000.0)
"""Where further pieces come from, robot frame, mm: far from the machine."""
DRAWER_PITCH = 60.0
LONGEST_PAUSE = 60.0
"""s"""
PACE = (0.12, 0.75, 1.4)
"""Of the natural logarithm of how slow a motion is the spread; least and greatest pace."""
_NOTHING = (1.0, 0.0, 0.0, 0.0)


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
        self._hand = self._rest()

    def _rest(self) -> Point:
        scene = self._simulation.scene
        x, y, z = resting_place(scene.table, at_white=scene.person == "white").tolist()
        return x, y, z

    @property
    def busy(self) -> bool:
        """Whether the hand is over the table or will be."""
        return self._grasp is not None or bool(self._errands)

    @property
    def hand(self) -> Array:
        """(3,) mm, robot frame: where the finger tips are."""
        return np.array(self._hand)

    def carry(
        self,
        source: tuple[float, float],
        target: Point,
        *,
        exact: bool = False,
        **manner: Any,
    ) -> Callable[[], bool]:
        """Take the piece that stands near ``source`` to ``target`` on a surface, robot frame, mm.

        Args:
            source: (x, y).
            target: (x, y, z).
            exact: Whether the hand is not clumsy this time.
            manner: ``via``, ``pause``, ``slide``, ``lying`` of the `Errand`.

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
        return self.take(piece, target, exact=exact, **manner)

    def supply(self, kind: str, white: bool, target: Point) -> Callable[[], bool]:  # noqa: FBT001
        """Bring a new piece of that kind and colour to ``target``; returns whether that is done."""
        number = len(self._simulation.scene.pieces)
        row, column = divmod(number, 8)
        x, y = DRAWER[0] - row * DRAWER_PITCH, DRAWER[1] - column * DRAWER_PITCH
        z = self._simulation.scene.table_top
        name = f"{'w' if white else 'b'}{kind}x{number}"
        return self.take(self._simulation.add(StandingPiece(name, kind, white, x, y, z)), target)

    def take(self, piece: int, target: Point, *, exact: bool = False, **manner: Any) -> Callable[[], bool]:
        """Queue an errand for the piece of that number; returns whether it is done."""
        if not all(map(math.isfinite, target)):
            raise TwinError(f"A person cannot put a piece to {target} mm.", hint="Name a place.")
        radius, angle = self._slop * math.sqrt(self._rng.random()), self._rng.uniform(0, math.tau)
        turn = float(self._rng.uniform(-math.pi, math.pi))
        radius *= not exact
        where = (target[0] + radius * math.cos(angle), target[1] + radius * math.sin(angle), target[2])
        return self._queue(Errand(0, piece, where, turn, **manner))

    def hover(self, over: Point, seconds: float) -> Callable[[], bool]:
        """Hold the finger tips at a point, robot frame, mm, for so long; returns whether that is over."""
        if not all(map(math.isfinite, over)):
            raise TwinError(f"A person cannot hold a hand at {over} mm.", hint="Name a place.")
        return self._queue(Errand(0, -1, over, pause=seconds))

    def _queue(self, errand: Errand) -> Callable[[], bool]:
        if not 0 <= errand.pause <= LONGEST_PAUSE:
            raise TwinError(
                f"A person does not stop for {errand.pause} s.", hint=f"Give 0 to {LONGEST_PAUSE:.0f} s."
            )
        spread, least, most = PACE
        pace = min(max(math.exp(spread * self._rng.standard_normal()), least), most)
        self._asked += 1
        number = self._asked
        self._errands.append(replace(errand, number=number, pace=pace))
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
        elif grasp.elapsed >= grasp.release_time and piece >= 0:
            self._simulation.bear(piece, 0.0)
        x, y, z = grasp.tip(grasp.elapsed).tolist()
        self._hand = (x, y, z)
        if self._over(grasp):
            self._grasp, self._done = None, grasp.errand.number
        else:
            grasp.elapsed += dt

    def _over(self, grasp: Grasp) -> bool:
        """Whether the next errand may begin: a hand with more to do does not go home in between."""
        away = grasp.release_time + (grasp.end_time - grasp.release_time) / 3
        return grasp.done or (bool(self._errands) and grasp.elapsed >= away)

    def _reach_for(self, errand: Errand) -> Grasp:
        simulation, scene = self._simulation, self._simulation.scene
        if errand.piece < 0:
            return Grasp(errand, self._hand, self._rest(), errand.target, _NOTHING, 0.0, 0.0, 0.0)
        positions = simulation.positions
        x, y, z = positions[errand.piece].tolist()
        w, i, j, k = simulation.attitude(errand.piece).tolist()
        height = float(positions[:, 2].max()) + scene.table.pieces.tallest + OVERHEAD
        if errand.slide:
            height = max(z, errand.target[2])
        shape = scene.shape(scene.pieces[errand.piece])
        return Grasp(
            errand, self._hand, self._rest(), (x, y, z), (w, i, j, k), height, shape.height,
            shape.base_diameter / 2,
        )  # fmt: skip

    def state(self) -> dict[str, Any]:
        """JSON-able state."""
        return {
            "rng": self._rng.bit_generator.state,
            "errands": [asdict(errand) for errand in self._errands],
            "grasp": None if self._grasp is None else self._grasp.state(),
            "hand": self._hand,
            "asked": self._asked,
            "done": self._done,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from `state`."""
        self._rng.bit_generator.state = state["rng"]
        self._errands = deque(errand_of(errand) for errand in state["errands"])
        self._grasp = Grasp.of(state["grasp"]) if state["grasp"] else None
        x, y, z = state["hand"]
        self._hand = (float(x), float(y), float(z))
        self._asked, self._done = int(state["asked"]), int(state["done"])


def manner(request: Mapping[str, Any]) -> dict[str, Any]:
    """How an errand is to be done, as the side door is asked: keywords of `Person.carry`.

    Args:
        request: May hold ``via`` (points, robot frame, mm), ``pause`` (s), ``slide``, ``lying``, ``exact``.
    """
    out: dict[str, Any] = {name: True for name in ("slide", "lying", "exact") if request.get(name)}
    if "via" in request:
        out["via"] = tuple((float(x), float(y)) for x, y in request["via"])
    if "pause" in request:
        out["pause"] = float(request["pause"])
    return out
