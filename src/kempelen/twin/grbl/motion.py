"""From planned blocks to where the motors are at a given time, in closed form within a block."""

from math import inf, sqrt
from typing import Any

from kempelen.twin.grbl.planner import Block, Planner
from kempelen.twin.grbl.settings import Vec

_LEAST_ACCELERATION = 1e-3  # mm/s²


class Ramp:
    """Motion over a distance: at most accelerate, cruise, decelerate.

    Attributes:
        phases: (duration s, acceleration mm/s²) each.
        start_speed: mm/s.
        end_speed: mm/s.
        duration: s.
        length: mm driven in that time.
    """

    __slots__ = ("duration", "end_speed", "length", "phases", "start_speed")

    def __init__(
        self, phases: tuple[tuple[float, float], ...], start: float, end: float, length: float
    ) -> None:
        self.phases = phases
        self.start_speed = start
        self.end_speed = end
        self.length = length
        duration = 0.0
        for phase in phases:
            duration += phase[0]
        self.duration = duration

    @classmethod
    def over(cls, length: float, start: float, cruise: float, end: float, acceleration: float) -> "Ramp":
        """As fast as ``cruise`` and ``acceleration`` allow; the end speed is a wish.

        A start speed above ``cruise`` (a lowered override) is brought down first. When the length is too
        short to reach ``end``, the ramp ends as near to it as it can.
        """
        a = max(_LEAST_ACCELERATION, acceleration)
        v0, v1 = start * start, end * end
        if v0 - v1 >= 2.0 * a * length:
            last = sqrt(max(v0 - 2.0 * a * length, 0.0))
            return cls((((start - last) / a, -a),), start, last, length)
        if v1 - v0 >= 2.0 * a * length:
            last = sqrt(v0 + 2.0 * a * length)
            return cls((((last - start) / a, a),), start, last, length)
        if start > cruise:
            peak, rise = cruise, (v0 - cruise * cruise) / (2.0 * a)
            first = ((start - cruise) / a, -a)
        else:
            top = a * length + 0.5 * (v0 + v1)
            peak = cruise if cruise * cruise < top else sqrt(top)
            rise = (peak * peak - v0) / (2.0 * a)
            first = ((peak - start) / a, a)
        level = length - rise - (peak * peak - v1) / (2.0 * a)
        return cls((first, (max(level, 0.0) / peak, 0.0), ((peak - end) / a, -a)), start, end, length)

    @classmethod
    def stop(cls, length: float, start: float, acceleration: float) -> "Ramp":
        """Decelerate to rest, or as far as ``length`` allows."""
        a = max(_LEAST_ACCELERATION, acceleration)
        needed = start * start / (2.0 * a)
        if needed >= length:
            return cls.over(length, start, start, 0.0, a)
        return cls(((start / a, -a),), start, 0.0, needed)

    def at(self, elapsed: float) -> tuple[float, float]:
        """(distance mm, speed mm/s) after ``elapsed`` seconds."""
        distance, speed = 0.0, self.start_speed
        for duration, acceleration in self.phases:
            if elapsed < duration:
                return (
                    distance + (speed + 0.5 * acceleration * elapsed) * elapsed,
                    speed + acceleration * elapsed,
                )
            distance += (speed + 0.5 * acceleration * duration) * duration
            speed += acceleration * duration
            elapsed -= duration
        return self.length, self.end_speed

    def time_at(self, distance: float) -> float:
        """When ``distance`` mm have been driven, s; infinity when they never are."""
        if distance > self.length:
            return inf
        elapsed, speed = 0.0, self.start_speed
        for duration, acceleration in self.phases:
            covered = (speed + 0.5 * acceleration * duration) * duration
            if distance <= covered:
                root = sqrt(max(speed * speed + 2.0 * acceleration * distance, 0.0))
                return elapsed + (2.0 * distance / (speed + root) if speed + root else 0.0)
            distance -= covered
            elapsed += duration
            speed += acceleration * duration
        return self.duration


class Stepper:
    """Drives the planner's first block.

    Attributes:
        position: What the motors have been told, machine frame; only current while at rest or
            after `sync`.
        holding: Decelerating to a stop, whatever the plan says.
        trip: Distance along the block at which a limit switch changes, mm; infinity for none.
    """

    __slots__ = (
        "_block", "_done", "_elapsed", "_exit", "_nominal", "_planner", "_ramp", "_speed", "holding",
        "position", "trip",
    )  # fmt: skip

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self.position: Vec = (0.0,) * len(planner.settings.steps)
        self.reset()

    def reset(self) -> None:
        """Stop dead where the motors are."""
        self._block: Block | None = None
        self._ramp: Ramp | None = None
        self._done = 0.0  # mm along the block at the ramp's start
        self._elapsed = 0.0
        self._speed = 0.0
        self._exit = self._nominal = -1.0
        self.holding = False
        self.trip = inf

    @property
    def block(self) -> Block | None:
        """The block being driven."""
        return self._block

    @property
    def speed(self) -> float:
        """Present speed along the path, mm/s."""
        return self._ramp.at(self._elapsed)[1] if self._ramp else self._speed

    def velocity(self) -> Vec:
        """Present velocity of the axes, mm/s."""
        if self._block is None:
            return (0.0,) * len(self.position)
        speed = self.speed
        return tuple(part * speed for part in self._block.unit)

    def sync(self) -> Vec:
        """Update and return `position`; also tells the planner how far the block has got."""
        block = self._block
        if block is None or self._ramp is None:
            return self.position
        distance, speed = self._ramp.at(self._elapsed)
        distance += self._done
        self.position = tuple([a + b * distance for a, b in zip(block.start, block.unit, strict=True)])
        block.left = block.length - distance
        block.entry = speed * speed
        return self.position

    def plan(self) -> bool:
        """Load or replan the block at hand where needed; True when a new block was loaded."""
        block, loaded = self._block, False
        if block is None:
            self._block = block = self._planner.blocks[0]
            self._done, self._elapsed, self._ramp, loaded = block.length - block.left, 0.0, None, True
        end = self._planner.exit_speed_squared()
        if self._ramp is None or (not self.holding and (end != self._exit or block.nominal != self._nominal)):
            self._shape(block, end)
        return loaded

    def _shape(self, block: Block, end: float) -> None:
        if self._ramp is not None:
            distance, self._speed = self._ramp.at(self._elapsed)
            self._done = min(self._done + distance, block.length)
        self._exit, self._nominal, self._elapsed = end, block.nominal, 0.0
        left = block.length - self._done
        if self.holding:
            self._ramp = Ramp.stop(left, self._speed, block.acceleration)
        else:
            self._ramp = Ramp.over(left, self._speed, block.nominal, sqrt(end), block.acceleration)

    def hold(self) -> None:
        """Begin to decelerate, at the rate of each block on the way."""
        self.holding = True
        if self._block is not None:
            self._shape(self._block, self._exit)

    def time_left(self) -> float:
        """Until the block ends, the hold is complete or a limit switch changes, s."""
        ramp = self._ramp
        if ramp is None:
            return 0.0
        left = ramp.duration - self._elapsed
        if self.trip < inf:
            left = min(left, ramp.time_at(max(self.trip - self._done, 0.0)) - self._elapsed)
        return max(left, 0.0)

    def run(self, dt: float) -> None:
        """Let ``dt`` seconds pass, not more than `time_left`."""
        self._elapsed += dt

    def tripped(self) -> bool:
        """Whether it is the limit switch on the way that has ended `time_left`."""
        if self.trip == inf or self._ramp is None:
            return False
        return self._ramp.time_at(max(self.trip - self._done, 0.0)) < self._ramp.duration

    def finish(self) -> bool:
        """What was running has ended; True when the motors are now at rest."""
        block, ramp = self._block, self._ramp
        if block is None or ramp is None:
            return True
        self._elapsed = ramp.duration
        self._speed = ramp.end_speed
        if self.holding and self._done + ramp.length < block.length:
            self.sync()
            self._block, self._ramp = None, None
            return True
        steps = self._planner.settings.steps
        self.position = tuple([place / scale for place, scale in zip(block.target, steps, strict=True)])
        self._planner.discard()
        self._block, self._ramp, self.trip = None, None, inf
        return not self._planner.blocks or (self.holding and self._speed == 0.0)

    def rest(self) -> None:
        """The motors stand; the next block starts from there."""
        self._speed = 0.0
        self.holding = False
        self._block, self._ramp, self.trip = None, None, inf

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        ramp = self._ramp
        return {
            "position": list(self.position),
            "loaded": self._block is not None,
            "ramp": ramp and [[list(p) for p in ramp.phases], ramp.start_speed, ramp.end_speed, ramp.length],
            "motion": [self._done, self._elapsed, self._speed, self._exit, self._nominal],
            "holding": self.holding,
            "trip": None if self.trip == inf else self.trip,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`; the planner has been restored before."""
        self.position = tuple(state["position"])
        self._block = self._planner.blocks[0] if state["loaded"] else None
        self._ramp = None
        if state["ramp"] is not None:
            phases, start, end, length = state["ramp"]
            self._ramp = Ramp(tuple((p[0], p[1]) for p in phases), start, end, length)
        self._done, self._elapsed, self._speed, self._exit, self._nominal = state["motion"]
        self.holding = bool(state["holding"])
        self.trip = inf if state["trip"] is None else state["trip"]
