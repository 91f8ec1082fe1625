"""Jogging: short commands, kept alive by the caller, never more than two ahead of the machine.

A jog command that waits in the controller's receive buffer survives the cancel byte, so the end is always:
produce nothing more, await the acknowledgements outstanding, cancel, poll until Idle, cancelling again while
it says Jog.
"""

import asyncio
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from kempelen.core.errors import KempelenError, MotionError, StoppedError
from kempelen.core.geometry import Array
from kempelen.core.table import WorkSpace
from kempelen.robots.grbl import codec
from kempelen.robots.grbl.gcode import number, words
from kempelen.robots.grbl.link import Link
from kempelen.robots.grbl.timing import Timing

_SHORTEST = 0.01  # mm; what is left at the edge of the work space is not worth a command


class JogWay(Protocol):
    """Where a jog goes, one short command after the other."""

    fastest: float

    def go_on(self, velocity: Array, seconds: float) -> tuple[str, float]:
        """The next command (``$J=...``, empty when nothing moves by a step) and how long it takes, s.

        Args:
            velocity: (3,) mm/s wanted of the tool point.
            seconds: Wanted length.

        Returns:
            0 seconds at the edge of what the machine reaches.
        """
        ...


class StraightWay:
    """A jog of straight axes, within the work space.

    Args:
        start: (x, y, z) mm where the tool point is, robot frame.
        space: Jogs end at its faces.
    """

    def __init__(self, start: Sequence[float], space: WorkSpace) -> None:
        self.fastest = float(min(space.velocity))
        self._target: Array = np.array(start)
        self._space = space

    def go_on(self, velocity: Array, seconds: float) -> tuple[str, float]:
        """The next command and how long it takes, s; 0 s at the edge."""
        target = np.clip(self._target + velocity * seconds, self._space.lower, self._space.upper)
        length, speed = float(np.linalg.norm(target - self._target)), float(np.linalg.norm(velocity))
        if length < _SHORTEST:
            return "", 0.0
        self._target = target
        return f"$J=G21G90{words(target.tolist())}F{number(60.0 * speed)}", length / speed


class Jogger:
    """One stretch of jogging, from the first keep-alive to rest.

    Args:
        link: Free of streams.
        way: Makes the lines.
        timing: Patience.
    """

    def __init__(self, link: Link, way: JogWay, timing: Timing) -> None:
        self._link = link
        self._way = way
        self._timing = timing
        self._velocity: Array = np.zeros(3)
        self._deadline = 0.0
        self._queued_until = 0.0
        self._error: StoppedError | None = None
        self._news = asyncio.Event()

    def keep(self, direction: tuple[float, float, float], speed: float) -> None:
        """Go on along ``direction`` at ``speed`` mm/s for another keep-alive period.

        Raises:
            MotionError: no direction, or a speed that is not positive.
        """
        vector = np.asarray(direction, dtype=np.float64)
        length = float(np.linalg.norm(vector))
        if not (np.isfinite(length) and length > 0 and np.isfinite(speed) and speed > 0):
            raise MotionError(
                f"Cannot jog along {direction} at {speed} mm/s.", hint="Give a direction and a speed above 0."
            )
        self._velocity = vector / length * min(speed, self._way.fastest)
        self._deadline = asyncio.get_running_loop().time() + self._timing.keep_alive
        self._news.set()

    def end(self, error: StoppedError | None = None) -> None:
        """Produce nothing more; with an error, `run` ends with it and leaves coming to rest to the caller."""
        self._deadline = 0.0
        self._error = error
        self._news.set()

    async def run(self) -> None:
        """Jog until the keep-alives end, then come to rest.

        Raises:
            KempelenError: the controller refused, the line was lost, or a stop ended it.
        """
        try:
            while (wait := self._pause()) is not None:
                if wait > 0 or not await self._segment():
                    await self._rest_until_news(max(wait, self._timing.jog_segment / 2))
        except StoppedError:
            raise  # `stop` has ended everything, and sees to the rest itself
        except BaseException:
            await self._come_to_rest()
            raise
        if self._error is not None:
            raise self._error
        await self._come_to_rest()

    def _pause(self) -> float | None:
        """Seconds until the next command may be queued; None at the end."""
        now = asyncio.get_running_loop().time()
        if now >= self._deadline or self._link.lost is not None:
            return None
        return max(0.0, self._queued_until - now - self._timing.jog_segment)

    async def _rest_until_news(self, seconds: float) -> None:
        self._news.clear()
        try:
            async with asyncio.timeout(seconds):
                await self._news.wait()
        except TimeoutError:
            return

    async def _segment(self) -> bool:
        """Queue one short command; False at the edge of the work space."""
        line, seconds = self._way.go_on(self._velocity, self._timing.jog_segment)
        if not seconds:
            return False
        now = asyncio.get_running_loop().time()
        self._queued_until = max(now, self._queued_until) + seconds
        if line:
            await self._link.request(line)
        return True

    async def _come_to_rest(self) -> None:
        """Every acknowledgement is in by now: `Link.request` has waited for it."""
        try:
            while self._link.lost is None:
                self._link.realtime(codec.JOG_CANCEL)
                status = await self._link.ask(self._timing.answer)
                if not status.moving:
                    return
                await asyncio.sleep(self._timing.poll)
        except KempelenError:
            if self._link.lost is None:
                raise
