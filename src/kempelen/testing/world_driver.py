"""Drives the twin's physics without wire or controller: rest to rest on each axis, as a machine would."""

from math import ceil, copysign, sqrt

import chess
import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.places import Place
from kempelen.core.table import Table, start_layout
from kempelen.motion.profile import Profile
from kempelen.twin.physics import Scene, World
from kempelen.twin.physics.scene import KINDS_BY_LETTER

TICK = 0.008
ROOM = 8.0
TABLE = Table()
SCENE = Scene.from_layout(TABLE, start_layout(TABLE, chess.Board()), seed=3)
"""The start position on the usual table."""


def at(place: str) -> tuple[float, float, float]:
    """(x, y, z) mm, robot frame, of a place of the usual table."""
    x, y, z = map(float, TABLE.centre(Place(place)))
    return x, y, z


def travelled(profile: Profile, t: float) -> float:
    """How far along a profile is after ``t`` s, mm."""
    if t <= 0.0 or profile.distance == 0.0:
        return 0.0
    if t >= profile.seconds:
        return profile.distance
    left = profile.seconds - t
    if left < profile.ramp:
        return profile.distance - profile.acceleration * left**2 / 2
    return profile.acceleration * min(t, profile.ramp) ** 2 / 2 + profile.speed * max(t - profile.ramp, 0.0)


class WorldDriver:
    """Carries pieces by a safe height, x and y moving while z is above everything.

    Args:
        world: To drive.
        speed: Of each axis, mm/s; default the work space's.
        rate: Acceleration of each axis, mm/s²; default the work space's.
    """

    def __init__(self, world: World, *, speed: float | None = None, rate: float | None = None) -> None:
        self.world = world
        self.table = world.scene.table
        self._speed = speed or self.table.space.velocity[0]
        self._rate = rate or self.table.space.acceleration[0]

    def wait(self, seconds: float, *, closed: bool) -> None:
        """Stand still."""
        here = self.world.tool_mm
        for _ in range(ceil(seconds / TICK - 1e-9)):
            self.world.step(TICK, here, closed)

    def settle(self, *, closed: bool, at_most: float = 2.0) -> None:
        """Stand still until nothing moves.

        Raises:
            TimeoutError: something moves for longer than ``at_most`` simulated seconds.
        """
        end = self.world.time + at_most
        self.wait(TICK, closed=closed)
        while not self.world.settled():
            if self.world.time > end:
                raise TimeoutError(f"still moving after {at_most} s")
            self.wait(TICK, closed=closed)

    def go(self, goal: Array, top: float, *, closed: bool) -> None:
        """Up to ``top`` mm or higher, across, down, the axes overlapping where there is room."""
        start = np.array(self.world.tool_mm)
        top = max(top, float(start[2]))
        up, down = self._over(top - start[2]), self._over(top - goal[2])
        across = [self._over(abs(goal[axis] - start[axis])) for axis in (0, 1)]
        overlap = sqrt(2 * ROOM / self._rate)
        begin = max(up.seconds - overlap, 0.0)
        arrive = begin + max(profile.seconds for profile in across)
        drop = max(arrive - overlap, up.seconds)
        for k in range(1, ceil(max(drop + down.seconds, arrive) / TICK) + 1):
            t = k * TICK
            x, y = (
                start[axis] + copysign(travelled(across[axis], t - begin), goal[axis] - start[axis])
                for axis in (0, 1)
            )
            z = start[2] + travelled(up, t) if t <= drop else top - travelled(down, t - drop)
            self.world.step(TICK, (float(x), float(y), float(z)), closed)

    def _over(self, distance: float) -> Profile:
        return Profile.over(float(distance), self._speed, self._rate)

    def fetch(self, kind: str, source: Place) -> None:
        """Go to a piece and close."""
        goal = self.table.grip_point(source, KINDS_BY_LETTER[kind])
        self.go(goal, self.table.pieces.tallest + self.table.gripper.below_tool + ROOM, closed=False)
        self.wait(self.table.gripper.close_seconds, closed=True)

    def deliver(self, kind: str, target: Place) -> None:
        """Carry what is held, and open."""
        number = KINDS_BY_LETTER[kind]
        top = self.table.pieces.tallest + self.table.pieces[number].grip_height + ROOM
        self.go(self.table.release_point(target, number), top, closed=True)
        self.wait(self.table.gripper.open_seconds, closed=False)

    def transfer(self, kind: str, source: Place, target: Place) -> float:
        """Fetch and deliver; returns the robot's time, s."""
        start = self.world.time
        self.fetch(kind, source)
        self.deliver(kind, target)
        return self.world.time - start
