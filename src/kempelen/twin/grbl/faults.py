"""Things that go wrong, on demand and reproducibly."""

import random
from dataclasses import dataclass, field
from typing import Any

_LINE_NOISE = 256


@dataclass(slots=True)
class Faults:
    """What is broken at present; every attribute may be changed at run time.

    Attributes:
        seed: Of the line noise.
        garble_in: Probability that a byte from the host arrives as another one.
        garble_out: The same for bytes to the host.
        swallow_oks: How many of the next ``ok`` answers are lost.
        reply_delay_s: How much later answers leave.
        stalled: Axes (0 for X, 1 for Y ...) whose motor turns without effect.
        dead_switches: Axes whose switch never closes.
        lost_steps: Steps to lose at once, per axis; taken by the controller.
        reset: The board resets itself; taken by the controller.
        link_drop: The wire breaks; taken by the loop.
    """

    seed: int = 0
    garble_in: float = 0.0
    garble_out: float = 0.0
    swallow_oks: int = 0
    reply_delay_s: float = 0.0
    stalled: set[int] = field(default_factory=set)
    dead_switches: set[int] = field(default_factory=set)
    lost_steps: list[int] = field(default_factory=lambda: [0, 0, 0])
    reset: bool = False
    link_drop: bool = False
    _random: random.Random = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)  # noqa: S311 - reproducible noise, not a secret

    def lose_steps(self, axis: int, steps: int) -> None:
        """Let the carriage slip by ``steps`` (signed) along an axis."""
        self.lost_steps += [0] * (axis + 1 - len(self.lost_steps))
        self.lost_steps[axis] += steps

    def take_link_drop(self) -> bool:
        """Whether the wire is to be dropped now; asking once clears it."""
        dropped, self.link_drop = self.link_drop, False
        return dropped

    def take_reset(self) -> bool:
        """Whether the board is to reset itself now; asking once clears it."""
        due, self.reset = self.reset, False
        return due

    def take_lost_steps(self) -> list[int] | None:
        """Steps to lose now, per axis; None mostly."""
        if not any(self.lost_steps):
            return None
        lost, self.lost_steps = self.lost_steps, [0] * len(self.lost_steps)
        return lost

    def garbled_in(self, data: bytes) -> bytes:
        """What arrives at the controller."""
        return self._noisy(data, self.garble_in) if self.garble_in else data

    def garbled_out(self, data: bytes) -> bytes:
        """What arrives at the host."""
        return self._noisy(data, self.garble_out) if self.garble_out else data

    def _noisy(self, data: bytes, chance: float) -> bytes:
        noise = self._random
        return bytes(noise.randrange(_LINE_NOISE) if noise.random() < chance else byte for byte in data)

    def swallows_ok(self) -> bool:
        """Whether the ``ok`` at hand is lost."""
        if self.swallow_oks <= 0:
            return False
        self.swallow_oks -= 1
        return True

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        version, words, gauss = self._random.getstate()
        return {
            "seed": self.seed,
            "garble": [self.garble_in, self.garble_out],
            "swallow_oks": self.swallow_oks,
            "reply_delay_s": self.reply_delay_s,
            "stalled": sorted(self.stalled),
            "dead_switches": sorted(self.dead_switches),
            "lost_steps": list(self.lost_steps),
            "reset": self.reset,
            "link_drop": self.link_drop,
            "random": [version, list(words), gauss],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`."""
        self.seed = int(state["seed"])
        self.garble_in, self.garble_out = state["garble"]
        self.swallow_oks = int(state["swallow_oks"])
        self.reply_delay_s = float(state["reply_delay_s"])
        self.stalled = set(state["stalled"])
        self.dead_switches = set(state["dead_switches"])
        self.lost_steps = [int(steps) for steps in state["lost_steps"]]
        self.reset = bool(state["reset"])
        self.link_drop = bool(state["link_drop"])
        version, words, gauss = state["random"]
        self._random.setstate((version, tuple(words), gauss))
