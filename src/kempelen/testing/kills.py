"""The program dies at a chosen instant, as after ``kill -9``: nothing it does afterwards reaches the world.

Instants are counted: before each motion of a `FakeTable`, before and after each write of a `MortalJournal`.
"""

import asyncio
from pathlib import Path

from kempelen.game.journal import Journal
from kempelen.game.records import Record
from kempelen.testing.hands import Step


class Killed(BaseException):
    """The program is dead; no handler for errors may see this as one."""


class KillSwitch:
    """Counts instants and kills at one of them.

    Args:
        at: Number of the fatal instant, from 0; None: never.

    Attributes:
        passed: Instants so far.
        dead: Whether the kill has happened.
    """

    def __init__(self, at: int | None = None) -> None:
        self.at = at
        self.passed = 0
        self.dead = False

    def instant(self) -> None:
        """An instant passes, or is the last one."""
        self.dead = self.dead or self.passed == self.at
        if self.dead:
            raise Killed
        self.passed += 1

    async def before_step(self, step: Step) -> None:
        """For `FakeTable.before_step`."""
        del step
        await asyncio.sleep(0)
        self.instant()


class MortalJournal(Journal):
    """A journal whose program may die before or after each write."""

    def __init__(self, path: Path, switch: KillSwitch) -> None:
        self._switch = switch
        super().__init__(path)

    def append(self, game: int, record: Record) -> None:
        """Write, if still alive."""
        self._switch.instant()
        super().append(game, record)
        self._switch.instant()
