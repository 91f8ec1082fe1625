"""Finding a motor's switch: off it if it is pressed, onto it fast, back, onto it slowly, back."""

from dataclasses import asdict, dataclass
from enum import IntEnum
from typing import Any

from kempelen.twin.latch.steps import TICKS


class Phase(IntEnum):
    """What the search is at."""

    LEAVE = 0
    SEEK = 1
    BACK = 2
    TOUCH = 3
    OFF = 4
    DONE = 5


class Failure(IntEnum):
    """Why it ended; the numbers of the alarms."""

    NONE = 0
    STAYS_CLOSED = 8
    NOT_FOUND = 9


@dataclass(slots=True)
class Seek:
    """One ``H`` command.

    Attributes:
        motor: 0 for the base.
        way: +1 or -1 towards the switch.
        rate: Steps/s of the search.
        slow: Steps/s of the second touch.
        off: Steps to back off.
        most: Steps after which the search is given up.
        home: What the motor counts at the end.
        made: Steps of the present phase.
        closed_at: What it counted at the second touch.
        waiting: Ticks since the last step.
    """

    motor: int
    way: int
    rate: int
    slow: int
    off: int
    most: int
    home: int
    phase: Phase = Phase.LEAVE
    failure: Failure = Failure.NONE
    made: int = 0
    closed_at: int = 0
    waiting: int = 0

    @property
    def over(self) -> bool:
        """Whether it has ended, well or not."""
        return self.phase is Phase.DONE or self.failure is not Failure.NONE

    @property
    def interval(self) -> int:
        """Ticks from one step to the next."""
        return max(TICKS // (self.slow if self.phase is Phase.TOUCH else self.rate), 1)

    def run(self, ticks: int, *, closed: bool, count: int) -> tuple[int, int]:
        """Let ticks pass until the next step, or all of them.

        Args:
            ticks: That may pass.
            closed: Whether the switch is.
            count: What the motor counts.

        Returns:
            The step to make now (-1, 0 or +1), and how many ticks are left.
        """
        while not self.over and self._decide(closed=closed, count=count):
            continue  # a phase may be over before its first step
        due = self.interval - self.waiting
        if self.over or ticks < due:
            self.waiting += ticks
            return 0, 0
        self.waiting = 0
        self.made += 1
        step = self.way if self.phase in {Phase.SEEK, Phase.TOUCH} else -self.way
        return step, ticks - due

    def _decide(self, *, closed: bool, count: int) -> bool:
        """Enter the next phase where the present one is at its end; whether it was."""
        if self.phase in {Phase.BACK, Phase.OFF}:
            if self.made < self.off:
                return False
            return self._fail(Failure.STAYS_CLOSED) if closed else self._enter(Phase(self.phase + 1))
        if closed == (self.phase is not Phase.LEAVE):
            self.closed_at = count
            return self._enter(Phase(self.phase + 1))
        if self.made < self.most:
            return False
        return self._fail(Failure.STAYS_CLOSED if closed else Failure.NOT_FOUND)

    def _enter(self, phase: Phase) -> bool:
        self.phase, self.made, self.waiting = phase, 0, 0
        return True

    def _fail(self, failure: Failure) -> bool:
        self.failure = failure
        return False

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        return asdict(self)

    @classmethod
    def from_snapshot(cls, state: dict[str, Any]) -> "Seek":
        """The inverse of `snapshot`."""
        return cls(**(state | {"phase": Phase(state["phase"]), "failure": Failure(state["failure"])}))
