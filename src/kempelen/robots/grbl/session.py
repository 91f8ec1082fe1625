"""A connected controller and the manoeuvres that several jobs share: rest, reset, restore, unlock."""

import asyncio
from collections.abc import Coroutine, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempelen.core.protocols import GripperState
from kempelen.robots.grbl import codec
from kempelen.robots.grbl.condition import Condition
from kempelen.robots.grbl.connect import Greeting, at_rest
from kempelen.robots.grbl.gcode import GripperWiring, Program
from kempelen.robots.grbl.link import Link, SilenceError
from kempelen.robots.grbl.mechanics import Mechanics
from kempelen.robots.grbl.stream import Stream
from kempelen.robots.grbl.timing import Timing

_RESETS = 4


@dataclass(slots=True, eq=False)
class Session:
    """Everything known between connecting and losing the line.

    Attributes:
        greeting: What was found on connecting.
        work: The group at work and its stream; None while none is on the wire.
        dwell: The longest pause in that group, s.
    """

    link: Link
    condition: Condition
    greeting: Greeting
    mechanics: Mechanics
    wiring: GripperWiring
    timing: Timing
    work: tuple[Program, Stream] | None = None
    dwell: float = 0.0

    async def begin(self) -> None:
        """Believe what was found on connecting, and no more."""
        condition, greeting = self.condition, self.greeting
        condition.clear()
        condition.connected, condition.memory_kept = True, greeting.memory_kept
        condition.know_offset(greeting.work_offset)
        condition.told(greeting.gripper)
        if greeting.reopen:
            condition.wanted = GripperState.OPEN
            await self.restore()
        condition.publish()

    def note_gripper(self) -> None:
        """What the acknowledged lines have done to the gripper."""
        if self.work is not None and self.condition.alarm is None:
            program, stream = self.work
            state = program.gripper_after(stream.acknowledged)
            if state is not None:
                self.condition.told(state)

    async def reset(self, *, keeps_position: bool) -> None:
        """Soft reset; returns after the banner.

        Raises:
            LinkError: no banner, or the line was lost.
        """
        mark = self.link.banners
        self.condition.keeps_position = keeps_position
        self.link.realtime(codec.RESET)
        try:
            await self.restarted(mark)
        finally:
            self.condition.keeps_position = False

    async def restarted(self, mark: int) -> None:
        """After a reset byte, until there have been more than ``mark`` banners.

        The byte is repeated: in the half second after an alarm the firmware forgets it.

        Raises:
            LinkError: no banner, or the line was lost.
        """
        patience = self.timing.banner / _RESETS
        for _ in range(_RESETS - 1):
            with suppress(SilenceError):
                await self.link.until(lambda: self.link.banners > mark, patience, "banner")
                return
            self.link.realtime(codec.RESET)
        await self.link.until(lambda: self.link.banners > mark, patience, "banner after several resets")

    async def halt(self) -> None:
        """Hold, wait for Hold:0, reset: at rest, position kept, nothing left in any buffer.

        Raises:
            LinkError: the line fell silent.
            AlarmError: an alarm came first.
        """
        self.link.realtime(codec.HOLD)
        status = await at_rest(self.link, self.timing)
        self.note_gripper()
        self.work = None
        if status.state != "Alarm":
            await self.reset(keeps_position=True)
            await self.restore()

    async def restore(self) -> None:
        """After a reset: modal state, the memory mark, and the gripper as it was last told.

        Raises:
            LinkError: the line fell silent.
        """
        status = await self.link.ask(self.timing.answer)
        if status.state != "Idle":
            return
        await self.link.request(self.mechanics.mark)
        wanted = self.condition.wanted
        if wanted not in {self.condition.gripper, GripperState.UNKNOWN}:
            await self.link.request(self.wiring.line(wanted))
            self.condition.told(wanted)
        self.condition.publish()

    async def unlock(self) -> None:
        """Clear whatever keeps the controller from taking lines, then `restore`.

        Raises:
            LinkError: the line fell silent.
        """
        condition = self.condition
        if condition.silent:
            await self.reset(keeps_position=condition.homed)
        elif condition.banner_due:
            await self.link.until(
                lambda: not condition.banner_due, self.timing.banner, "banner after an alarm"
            )
        status = await at_rest(self.link, self.timing)
        if status.state not in {"Idle", "Alarm"}:
            await self.reset(keeps_position=condition.homed)
            status = await at_rest(self.link, self.timing)
        if status.state == "Alarm":
            await self.link.request(self.mechanics.unlock)
        condition.clear()
        await self.restore()


def apart(a: Sequence[float] | None, b: Sequence[float]) -> float:
    """Largest distance along an axis; infinite when one of the points is unknown."""
    if a is None or len(a) != len(b):
        return float("inf")
    return float(np.abs(np.subtract(a, b)).max())


async def finish(work: Coroutine[Any, Any, None]) -> None:
    """Run ``work`` to its end, however often the caller is cancelled meanwhile."""
    task = asyncio.ensure_future(work)
    cancelled: asyncio.CancelledError | None = None
    while not task.done():
        try:
            await asyncio.shield(task)
        except asyncio.CancelledError as error:
            cancelled = error
    task.result()
    if cancelled is not None:
        raise cancelled
