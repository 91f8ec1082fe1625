"""Closing the loop: does the table show what the journal says?

Without a board sensor the hand is trusted (`Trust`). With one, `SensorVerifier` looks before a move counts.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import chess

from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.senses import BoardSensor, Observation

LOOKS_IN_PASSING = 3
"""Observations after which a view that is not clear counts as hidden."""


@dataclass(frozen=True, slots=True)
class Fault:
    """The table is not as it should be.

    Attributes:
        text: One plain sentence that tells a person what to put right: "put the white knight back on f3".
        missed: Transfers whose piece still stands where it stood: the robot may try them again.
        doubtful: It cannot be made out whether anything is wrong: a person's word settles it.
        piece: That is missed, if one is.
        place: Where it belongs.
    """

    text: str
    missed: tuple[Transfer, ...] = ()
    doubtful: bool = False
    piece: chess.Piece | None = None
    place: Place | None = None


class Verifier(Protocol):
    """Compares the table with what should stand there."""

    @property
    def looks(self) -> bool:
        """Whether there is anything to look with: the hand then goes out of its view first."""
        ...

    async def confirm(self, transfers: Sequence[Transfer], standing: Layout) -> Fault | None:
        """Look at the table, for as long as it takes to be sure.

        Args:
            transfers: Those just made, for naming what went wrong.
            standing: What should stand where now.

        Returns:
            None when the table agrees.
        """
        ...

    async def in_view(self) -> bool:
        """Whether the board can be seen with the robot where it is."""
        ...

    async def unobstructed(self) -> None:
        """Returns when no hand is over the board; to be asked only while the robot's own is not."""
        ...


class Trust:
    """No sensor: what the hand reports is believed."""

    looks = False

    async def confirm(self, transfers: Sequence[Transfer], standing: Layout) -> Fault | None:  # noqa: ARG002 - nothing to look at
        """Always agrees."""
        return None

    async def in_view(self) -> bool:
        """Nothing is seen."""
        return False

    async def unobstructed(self) -> None:
        """Nobody can tell."""


class Judge(Protocol):
    """Weighs observations until it is sure whether they show what should stand there."""

    def update(self, seen: Observation) -> "bool | Fault":
        """With one more observation: True when all is right, False when that cannot be told yet."""
        ...


class SensorVerifier:
    """Looks with a board sensor.

    A sensor that sees nothing is waited for: what cannot be seen is never taken for right. The operator is
    told by whoever watches the sensor.

    Args:
        sensor: Whose observations are all of frames taken after `observe` was called.
        judge: Makes a judge for transfers and what should stand after them.

    Attributes:
        looks: Switched off by an operator who wants to go on without eyes.
    """

    def __init__(self, sensor: BoardSensor, judge: Callable[[Sequence[Transfer], Layout], Judge]) -> None:
        self._sensor = sensor
        self._judge = judge
        self.looks = True

    async def confirm(self, transfers: Sequence[Transfer], standing: Layout) -> Fault | None:
        """Look until it is sure."""
        judge = self._judge(transfers, standing)
        async for seen in self._sensor.observe():
            verdict = judge.update(seen)
            if verdict is True or not self.looks:
                break
            if isinstance(verdict, Fault):
                return verdict
        return None

    async def in_view(self) -> bool:
        """Whether one of the next few observations is of a clear view."""
        count = 0
        async for seen in self._sensor.observe():
            count += 1
            if seen.valid or not self.looks or count == LOOKS_IN_PASSING:
                return seen.valid
        return False

    async def unobstructed(self) -> None:
        """Returns when no hand is over the board. One that cannot be seen bars nobody: that is told apart."""
        async for seen in self._sensor.observe():
            if not (seen.hand and self.looks):
                return
