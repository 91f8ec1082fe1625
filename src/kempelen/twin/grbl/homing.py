"""The homing cycle: seek, pull off, touch again slowly, pull off.

GRBL 1.1 homes z alone first, then x and y together; its relatives have ``$44`` to ``$48`` for that: the axes
of each round as bits.
"""

from math import inf, sqrt
from typing import Any

from kempelen.twin.grbl.machine import Machine
from kempelen.twin.grbl.motion import Ramp
from kempelen.twin.grbl.planner import along
from kempelen.twin.grbl.settings import HOMING_CYCLES, Settings, Vec
from kempelen.twin.grbl.status import Alarm

_CYCLES = ((2,), (0, 1))  # of the stock firmware
_SEARCH = 1.5  # of the travel, how far to look for a switch
_LOCATE = 5.0  # of the pull-off, how far to look for it the second time
_PASSES = 4  # approach, pull off, approach, pull off


def cycles(settings: Settings) -> tuple[tuple[int, ...], ...]:
    """Which axes home together, first to last."""
    if not settings.dialect.cycles:
        return _CYCLES
    axes = range(len(settings.dialect.axes))
    masks = (int(settings[number]) for number in HOMING_CYCLES)
    rounds = (tuple(axis for axis in axes if mask & (1 << axis)) for mask in masks)
    return tuple(together for together in rounds if together)


class HomingCycle:
    """One ``$H``, from its start until it is done or has failed.

    Args:
        settings: $23 to $27, rates, accelerations and travels.
        machine: Is driven.
        axis: To be homed alone; -1 for all.

    Attributes:
        failure: Why it failed; NONE while all is well.
        done: Whether it has ended well.
    """

    __slots__ = (
        "_axes", "_cycle", "_cycles", "_elapsed", "_locked", "_machine", "_pass", "_pause", "_ramp",
        "_resting", "_settings", "_start", "done", "failure",
    )  # fmt: skip

    def __init__(self, settings: Settings, machine: Machine, axis: int = -1) -> None:
        self._settings = settings
        self._machine = machine
        self._cycles = cycles(settings) if axis < 0 else ((axis,),)
        self._cycle = 0
        self._pass = 0
        self._pause = 0.0
        self._resting = False
        self.done = False
        self.failure = Alarm.NONE
        self._begin()

    def _begin(self) -> None:
        settings = self._settings
        self._axes = self._cycles[self._cycle]
        self._elapsed = 0.0
        self._locked: set[int] = set()
        self._start = self._machine.motor
        pull_off = settings[27]
        if self._pass == 0:
            distance = _SEARCH * max(settings.travel[axis] for axis in self._axes)
        else:
            distance = pull_off * _LOCATE if self._approaching else pull_off
        rate = (settings[24] if self._pass == 2 else settings[25]) / 60.0  # noqa: PLR2004 - the second touch
        share = 1.0 / sqrt(len(self._axes))
        unit: Vec = tuple(share if axis in self._axes else 0.0 for axis in range(len(settings.rate)))
        speed = min(rate, along(settings.rate, unit) * share)
        acceleration = along(settings.acceleration, unit) * share
        self._ramp = Ramp.over(distance, 0.0, max(speed, 1.0 / 60.0), 0.0, acceleration)
        if self._approaching:
            self._lock()

    @property
    def axes(self) -> tuple[int, ...]:
        """All that are homed, first to last."""
        return tuple(axis for together in self._cycles for axis in together)

    @property
    def _approaching(self) -> bool:
        return self._pass % 2 == 0

    def _direction(self, axis: int) -> float:
        towards_minimum = bool(int(self._settings[23]) & (1 << axis))
        return -1.0 if towards_minimum == self._approaching else 1.0

    def _lock(self) -> None:
        self._locked |= {axis for axis in self._axes if self._machine.closed(axis)}

    def time_left(self) -> float:
        """Until the next thing happens, s."""
        if self._resting:
            return max(self._pause, 0.0)
        left = self._ramp.duration - self._elapsed
        if self._approaching:
            if len(self._locked) == len(self._axes):
                return 0.0
            left = min(left, min(self._touches()) - self._elapsed)
        return max(left, 0.0)

    def _touches(self) -> list[float]:
        """When each axis still under way reaches its switch, on the ramp's clock."""
        covered = self._ramp.at(self._elapsed)[0]
        times = [inf]
        moving = [axis for axis in self._axes if axis not in self._locked]
        way = [self._direction(axis) if axis in moving else 0.0 for axis in range(len(self._start))]
        for axis in moving:
            ahead = self._machine.distance_to_change(axis, way)
            times.append(self._ramp.time_at(covered + ahead) if ahead < inf else inf)
        return times

    def run(self, dt: float) -> None:
        """Let ``dt`` seconds pass, not more than `time_left`."""
        if self._resting:
            self._pause -= dt
            return
        self._elapsed += dt
        covered = self._ramp.at(self._elapsed)[0]
        motor = list(self._machine.motor)
        for axis in self._axes:
            if axis not in self._locked:
                motor[axis] = self._start[axis] + self._direction(axis) * covered
        self._machine.follow(tuple(motor))

    def event(self) -> None:
        """`time_left` has run out."""
        if self._resting:
            self._resting = False
            self._next()
            return
        ended = self._elapsed >= self._ramp.duration
        if self._approaching:
            self._lock()
            if len(self._locked) < len(self._axes):
                if ended:
                    self.failure = Alarm.HOMING_APPROACH
                return
        elif not ended:
            return
        elif any(self._machine.closed(axis) for axis in self._axes):
            self.failure = Alarm.HOMING_PULL_OFF
            return
        self._pause, self._resting = self._settings[26] / 1000.0, True

    def _next(self) -> None:
        self._pass += 1
        if self._pass == _PASSES:
            self._pass = 0
            self._cycle += 1
        self.done = self._cycle == len(self._cycles)
        if not self.done:
            self._begin()

    def origin(self) -> Vec:
        """What to call the place where the carriage stands after success, mm; axes not homed keep theirs."""
        settings = self._settings
        pull_off, mask = settings[27], int(settings[23])
        named = list(self._machine.motor)
        for axis in self.axes:
            named[axis] = pull_off - settings.travel[axis] if mask & (1 << axis) else -pull_off
        return tuple(named)

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        return {
            "alone": self._cycles[0][0] if len(self.axes) == 1 else -1,
            "cycle": self._cycle,
            "pass": self._pass,
            "pause": self._pause,
            "resting": self._resting,
            "elapsed": self._elapsed,
            "locked": sorted(self._locked),
            "start": list(self._start),
            "failure": int(self.failure),
            "done": self.done,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`; the machine has been restored before."""
        self._cycle, self._pass = int(state["cycle"]), int(state["pass"])
        self.done, self.failure = bool(state["done"]), Alarm(state["failure"])
        if not self.done:
            self._begin()
        self._pause, self._elapsed = float(state["pause"]), float(state["elapsed"])
        self._resting = bool(state["resting"])
        self._locked = set(state["locked"])
        self._start = tuple(state["start"])
