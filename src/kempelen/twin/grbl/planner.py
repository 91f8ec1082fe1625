"""GRBL's look-ahead planner: 15 straight blocks, joined as fast as junction deviation and the axes allow.

Speeds are kept squared (mm²/s²), as the kinematics v² = v0² + 2·a·s wants them. Source: S. Jeon, "Improving
Grbl: Cornering Algorithm" (2011) for the junction speed, and 1.1h's own rules for what is replanned when.
"""

from math import sqrt
from typing import Any

from kempelen.twin.grbl.settings import Settings, Vec

CAPACITY = 15  # of the stock firmware
MIN_SPEED = 1.0 / 60.0  # mm/s: GRBL's MINIMUM_FEED_RATE
_REVERSAL, _STRAIGHT = 0.999999, -0.999999  # cosines beyond which a junction is a full stop, or none at all
_NO_LIMIT = 1.0e38
Steps = tuple[int, ...]


class Block:
    """One straight stretch: geometry fixed, speeds planned.

    Attributes:
        start: Machine frame, mm, of its first step.
        unit: Direction.
        length: mm.
        left: mm still ahead of the stepper.
        acceleration: Along the line, mm/s².
        rapid_rate: Fastest along the line, mm/s.
        programmed_rate: What was asked for, mm/s.
        rapid: Whether rapid override applies, not feed override.
        fixed_feed: Whether no override applies (jogs).
        nominal: Speed to reach, overrides included, mm/s.
        entry: Planned speed at its start, squared.
        max_entry: Its upper bound, squared.
        max_junction: The bound by the corner alone, squared.
        target: End, steps.
    """

    __slots__ = (
        "acceleration", "entry", "fixed_feed", "left", "length", "max_entry", "max_junction", "nominal",
        "programmed_rate", "rapid", "rapid_rate", "start", "target", "unit",
    )  # fmt: skip

    start: Vec
    unit: Vec
    target: Steps
    length: float
    left: float
    acceleration: float
    rapid_rate: float
    programmed_rate: float
    nominal: float
    entry: float
    max_entry: float
    max_junction: float
    rapid: bool
    fixed_feed: bool

    def snapshot(self) -> dict[str, Any]:
        """All fields, JSON-able."""
        return {name: getattr(self, name) for name in Block.__slots__}

    @classmethod
    def from_snapshot(cls, state: dict[str, Any]) -> "Block":
        """The inverse of `snapshot`."""
        block = cls()
        for name, value in state.items():
            setattr(block, name, tuple(value) if isinstance(value, list) else value)
        return block


def along(limits: Vec, unit: Vec) -> float:
    """The largest value along ``unit`` that keeps each axis within its limit."""
    value = _NO_LIMIT
    for limit, part in zip(limits, unit, strict=True):
        if part:
            value = min(value, abs(limit / part))
    return value


class Planner:
    """The ring of blocks between parser and stepper.

    Attributes:
        blocks: First to be driven first; the stepper works on the first one.
        position: Where the last block ends, steps.
        feed_override: Percent.
        rapid_override: Percent.
    """

    __slots__ = (
        "_last_nominal", "_last_unit", "_planned", "blocks", "feed_override", "position", "rapid_override",
        "settings",
    )  # fmt: skip

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.feed_override = 100
        self.rapid_override = 100
        self.position: Steps = (0,) * len(settings.steps)
        self.reset()

    def reset(self) -> None:
        """Forget all blocks."""
        self.blocks: list[Block] = []
        self._planned = 0
        self._last_unit: Vec = (0.0,) * len(self.settings.steps)
        self._last_nominal = 0.0

    @property
    def full(self) -> bool:
        """Whether there is no room for another block."""
        return len(self.blocks) >= self.settings.dialect.blocks

    def append(self, target: Vec, rate: float, *, rapid: bool, inverse: bool, fixed: bool) -> bool:
        """Queue a line to ``target`` (mm); False when it is shorter than a step.

        Args:
            target: Machine frame, mm.
            rate: mm/s; 1/s when ``inverse``.
            rapid: At the axes' own limits, whatever the rate.
            inverse: The rate is the reciprocal of the time to take.
            fixed: Overrides do not apply.
        """
        block = self._measured(target)
        if block is None:
            return False
        block.rapid, block.fixed_feed = rapid, fixed
        block.programmed_rate = rate * block.length if inverse else rate
        block.max_junction = self._junction(block) if self.blocks else 0.0
        block.entry = 0.0
        self._set_nominal(block, self._last_nominal)
        self._last_nominal = block.nominal
        self._last_unit = block.unit
        self.position = block.target
        self.blocks.append(block)
        self._recalculate()
        return True

    def _measured(self, target: Vec) -> Block | None:
        steps, here = self.settings.steps, self.position
        there = tuple([round(place * scale) for place, scale in zip(target, steps, strict=True)])
        if there == here:
            return None
        way = [(to - at) / scale for to, at, scale in zip(there, here, steps, strict=True)]
        length = sqrt(sum([part * part for part in way]))
        block = Block()
        block.target = there
        block.start = tuple([at / scale for at, scale in zip(here, steps, strict=True)])
        block.unit = unit = tuple([part / length for part in way])
        block.length = block.left = length
        block.acceleration = along(self.settings.acceleration, unit)
        block.rapid_rate = along(self.settings.rate, unit)
        return block

    def _junction(self, block: Block) -> float:
        """Highest speed squared at the corner before ``block``."""
        before, after = self._last_unit, block.unit
        cosine = -sum([a * b for a, b in zip(before, after, strict=True)])
        if cosine > _REVERSAL:
            return 0.0
        if cosine < _STRAIGHT:
            return _NO_LIMIT
        turn = [b - a for a, b in zip(before, after, strict=True)]
        size = sqrt(sum([part * part for part in turn]))
        acceleration = along(self.settings.acceleration, tuple([part / size for part in turn]))
        sine = sqrt(0.5 * (1.0 - cosine))
        return acceleration * self.settings.deviation * sine / (1.0 - sine)

    def _set_nominal(self, block: Block, previous: float) -> None:
        if block.rapid:
            nominal = block.rapid_rate * 0.01 * self.rapid_override
        else:
            nominal = block.programmed_rate
            if not block.fixed_feed:
                nominal *= 0.01 * self.feed_override
            nominal = min(nominal, block.rapid_rate)
        block.nominal = nominal = max(nominal, MIN_SPEED)
        slower = min(nominal, previous)
        block.max_entry = min(slower * slower, block.max_junction)

    def _recalculate(self) -> None:
        """Plan backwards from a stop at the end, then forwards from what is already optimal."""
        blocks, planned = self.blocks, self._planned
        last = len(blocks) - 1
        if last <= planned:
            return
        block = blocks[last]
        speed = block.entry = min(block.max_entry, 2.0 * block.acceleration * block.left)
        for index in range(last - 1, planned, -1):
            block = blocks[index]
            if block.entry != block.max_entry:
                block.entry = min(speed + 2.0 * block.acceleration * block.left, block.max_entry)
            speed = block.entry
        self._forward()

    def _forward(self) -> None:
        blocks = self.blocks
        following = blocks[self._planned]
        for index in range(self._planned + 1, len(blocks)):
            block, following = following, blocks[index]
            if block.entry < following.entry:
                reachable = block.entry + 2.0 * block.acceleration * block.left
                if reachable < following.entry:
                    following.entry = reachable
                    self._planned = index
            if following.entry == following.max_entry:
                self._planned = index

    def exit_speed_squared(self) -> float:
        """At the end of the first block, mm²/s²."""
        return self.blocks[1].entry if len(self.blocks) > 1 else 0.0

    def discard(self) -> None:
        """The first block has been driven."""
        del self.blocks[0]
        if self._planned:
            self._planned -= 1

    def replan(self) -> None:
        """Plan anew from the first block's present speed: after a hold."""
        self._planned = 0
        self._recalculate()

    def override(self) -> None:
        """Take over changed overrides."""
        previous = _NO_LIMIT
        for block in self.blocks:
            self._set_nominal(block, previous)
            previous = block.nominal
        self._last_nominal = previous
        self.replan()

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        return {
            "blocks": [block.snapshot() for block in self.blocks],
            "position": list(self.position),
            "overrides": [self.feed_override, self.rapid_override],
            "planned": self._planned,
            "last": [list(self._last_unit), self._last_nominal],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`."""
        self.blocks = [Block.from_snapshot(block) for block in state["blocks"]]
        self.position = tuple(map(int, state["position"]))
        self.feed_override, self.rapid_override = map(int, state["overrides"])
        self._planned = int(state["planned"])
        unit, self._last_nominal = state["last"]
        self._last_unit = tuple(unit)
