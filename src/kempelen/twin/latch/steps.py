"""The bridge's clock of steps: blocks of time, and a pace that a hold brings down to nothing and back.

The same arithmetic in whole numbers as ``firmware/latch-bridge/step_logic.h``: a timer ticks 4,000 times a
second and moves the clock of the present block on by the pace, 1024 at full speed. How many steps of a block
have been made is a function of its clock alone, so that a hold changes when the steps come, never which.
"""

from collections import deque
from dataclasses import dataclass
from typing import Any

TICKS = 4000
"""Of a second; no motor steps more often."""
FULL = 1024
"""Pace at full speed; it changes by one a tick, so that a hold takes 0.256 s."""
QUEUE = 64
"""Blocks."""
LONGEST = 10_000
"""ms of a block."""


@dataclass(frozen=True, slots=True)
class Block:
    """So many ms, so many steps of each motor."""

    milliseconds: int
    steps: tuple[int, ...]

    @property
    def total(self) -> int:
        """Length on the clock."""
        return self.milliseconds * (TICKS // 1000) * FULL

    def done(self, clock: int) -> tuple[int, ...]:
        """Steps made when the clock stands there, rounded half up in size."""
        total = self.total
        made = (((2 * abs(steps) * clock + total) // (2 * total), steps) for steps in self.steps)
        return tuple(count if steps > 0 else -count for count, steps in made)


class StepClock:
    """Queue and clock.

    Attributes:
        blocks: To be driven, the present one first.
        pace: 0 at rest, `FULL` at full speed.
        wanted: What the pace is on its way to.
    """

    def __init__(self, motors: int) -> None:
        self.blocks: deque[Block] = deque()
        self.pace = self.wanted = FULL
        self._clock = 0
        self._base = [0] * motors

    @property
    def counts(self) -> tuple[int, ...]:
        """Steps that each motor has made."""
        if not self.blocks:
            return tuple(self._base)
        done = self.blocks[0].done(self._clock)
        return tuple(base + more for base, more in zip(self._base, done, strict=True))

    def name(self, motor: int, count: int) -> None:
        """At rest: a motor's present place is called ``count`` from now on."""
        self._base[motor] = count

    @property
    def full(self) -> bool:
        """Whether there is no room for another block."""
        return len(self.blocks) >= QUEUE

    @property
    def running(self) -> bool:
        """Whether steps are being made, or will be at the next tick."""
        return bool(self.blocks) and (self.pace > 0 or self.wanted > 0)

    def hold(self) -> None:
        """Slow down to rest within the present way."""
        self.wanted = 0

    def resume(self) -> None:
        """Go on."""
        self.wanted = FULL

    def drop(self) -> None:
        """Forget what has not been made."""
        self._base = list(self.counts)
        self.blocks.clear()
        self._clock = 0
        self.pace = self.wanted = FULL

    def run(self, ticks: int) -> int:
        """Let so many ticks pass, or fewer until there is nothing more to do; how many were left."""
        while ticks and self.running:
            if self.pace != self.wanted:
                self.pace += 1 if self.wanted > self.pace else -1
                self._clock += self.pace
                ticks -= 1
            else:
                count = min(ticks, -(-(self.blocks[0].total - self._clock) // FULL))
                self._clock += count * FULL
                ticks -= count
            self._next()
        return ticks

    def _next(self) -> None:
        while self.blocks and self._clock >= self.blocks[0].total:
            block = self.blocks.popleft()
            self._clock -= block.total
            self._base = [base + steps for base, steps in zip(self._base, block.steps, strict=True)]
        if not self.blocks:
            self._clock, self.pace, self.wanted = 0, FULL, FULL

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        return {
            "blocks": [[block.milliseconds, *block.steps] for block in self.blocks],
            "pace": [self.pace, self.wanted],
            "clock": self._clock,
            "base": list(self._base),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`."""
        self.blocks = deque(Block(ms, tuple(steps)) for ms, *steps in state["blocks"])
        self.pace, self.wanted = state["pace"]
        self._clock, self._base = state["clock"], list(state["base"])
