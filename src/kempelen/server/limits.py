"""How often something may be done: token buckets, of which only a bounded number is kept."""

import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass

_KEPT = 4096


@dataclass(frozen=True)
class Rate:
    """A limit.

    Attributes:
        per_second: In the long run.
        burst: At once.
    """

    per_second: float
    burst: float


@dataclass(slots=True)
class _Bucket:
    level: float
    at: float


class Limiter:
    """One bucket for each client; that of whoever came longest ago is forgotten first.

    Args:
        rate: The limit.
        clock: s, monotonic.
    """

    def __init__(self, rate: Rate, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._rate = rate
        self._clock = clock
        self._buckets: OrderedDict[Hashable, _Bucket] = OrderedDict()

    def take(self, who: Hashable) -> bool:
        """Whether this client may, now; counts it when it may."""
        now = self._clock()
        bucket = self._buckets.pop(who, None) or _Bucket(self._rate.burst, now)
        self._buckets[who] = bucket
        if len(self._buckets) > _KEPT:
            self._buckets.popitem(last=False)
        bucket.level = min(self._rate.burst, bucket.level + (now - bucket.at) * self._rate.per_second)
        bucket.at = now
        if bucket.level < 1:
            return False
        bucket.level -= 1
        return True
