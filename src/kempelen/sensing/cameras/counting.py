"""Counting the frames that a camera lost."""

from collections import deque
from statistics import median

_INTERVALS = 15


class Counter:
    """From a device's own numbers of frames, which may begin anywhere, wrap around and start again."""

    def __init__(self) -> None:
        self._last: int | None = None
        self.sequence = -1
        self.dropped = 0

    def count(self, number: int) -> int:
        """The sequence of the frame with this number: gaps are kept, a number that falls is one step on."""
        step = 1 if self._last is None or number <= self._last else number - self._last
        self._last = number
        self.dropped += step - 1
        self.sequence += step
        return self.sequence


class PeriodCounter:
    """From the times of frames, for a device that does not number them.

    What one frame takes is the median of the last intervals, not what the device was asked for: cameras slow
    down in dim light, and lose nothing by that.
    """

    def __init__(self) -> None:
        self._last: float | None = None
        self._intervals = deque[float](maxlen=_INTERVALS)
        self.sequence = -1
        self.dropped = 0

    def count(self, time: float) -> int:
        """The sequence of the frame taken at ``time``, s."""
        step = 1
        if self._last is not None and time > self._last:
            interval = time - self._last
            if len(self._intervals) == _INTERVALS:
                step = max(1, round(interval / median(self._intervals)))
            self._intervals.append(interval)
        self._last = time
        self.dropped += step - 1
        self.sequence += step
        return self.sequence
