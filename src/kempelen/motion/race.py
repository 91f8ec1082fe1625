"""The race between the horizontal and the vertical axes, and its lower bound.

Let a leg have hurdles ``k``: while the distance s along the line is in [e_k, x_k], z must be at least
h_k. Let t(s) be the time at which the time-optimal horizontal motion, alone, passes s, and X its
duration; let u(h), d(h) be the times from the start to h, and from h to the end, of the time-optimal
vertical motions start to peak and peak to end.

**Lower bound.** Take any motion in the plane that respects the axes' limits and the hurdles, and let Z be the
greatest z it reaches; Z is at least H, the highest hurdle and end.

1. z is at rest at its peak, so the motion lasts at least B(Z) = u(Z) + d(Z).
2. A point at which z has reached h_i comes no earlier than u(h_i): the profile to the peak at rest has
   the greatest speed possible at each height under a rest at the start, the limits and a rest at Z. So s
   = e_i is passed no earlier than u(h_i), and no earlier than t(e_i). The same, seen backwards from the
   end, for x_j: it is passed no later than d(h_j), or X - t(x_j), before the end.
3. From e_i to x_j, where e_i <= x_j, the time is at least t(x_j) - t(e_i): the time-optimal motion has
   everywhere the greatest speed that a rest at the start, the limit and a rest at the end allow.
4. Adding up: the motion lasts at least A(Z) = X + max over (i, j) with e_i <= x_j of
   max(0, u(h_i) - t(e_i)) + max(0, d(h_j) - X + t(x_j)).
5. The condition e_i <= x_j excludes nothing. Let x_j < e_i. If h_i >= h_j, then hurdle i asks for at least as
   much at the end as j does, since x_i > x_j; if h_i < h_j, then j asks for at least as much at the start as
   i does, since e_j < e_i. So a pair (i, i) or (j, j) has at least the same sum.

A falls and B rises with Z, so the least over Z >= H of max(A, B) bounds every motion from below. For
whatever peak P is chosen, no Z gives less than max(B(H), A(ceiling), min(A(P), B(P))): below P, A is at
least A(P); above, B is at least B(P).

**The plan.** z rises at full rate to a peak, waits and falls at full rate; the horizontal axes start
late by the first maximum above and arrive early by the second. That is allowed for all hurdles at once,
and lasts max(A, B): it is the bound itself, as exactly as the peak is searched. What the controller makes
of it is another matter (see `timing`): GRBL limits the acceleration along and across the path one by one,
so that for moments it may exceed an axis' limit or stay below it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

from kempelen.motion.leg import Leg
from kempelen.motion.profile import Profile

_HALVINGS = 14
_WORTH = 1e-4  # s: the peak is not raised for less


@dataclass(frozen=True, slots=True)
class Race:
    """When each axis moves.

    Attributes:
        travel: Horizontal motion.
        up: Vertical motion to the peak.
        down: Vertical motion from the peak.
        peak: z of the peak, mm.
        wait: How long the horizontal axes wait before they start, s.
        seconds: All of it, s.
        bound: No motion in the plane is faster, s.
    """

    travel: Profile
    up: Profile
    down: Profile
    peak: float
    wait: float
    seconds: float
    bound: float


@dataclass(frozen=True, slots=True)
class _Try:
    """The race for one peak: what its hurdles ask at the start and at the end, s."""

    up: Profile
    down: Profile
    wait: float
    early: float

    @property
    def vertical(self) -> float:
        return self.up.seconds + self.down.seconds


def least_seconds(leg: Leg) -> float:
    """The lower bound of a leg's time, s."""
    return run(leg).bound if leg.length > 0.0 else leg.lift(abs(leg.end[2] - leg.start[2])).seconds


@lru_cache(maxsize=8)  # a planner and the bound ask for the same leg
def run(leg: Leg) -> Race:
    """The fastest race over the hurdles of a leg that is not vertical, and its lower bound."""
    travel = leg.travel()
    marks = [
        (
            hurdle.height - leg.start[2],
            travel.passing(hurdle.enter),
            hurdle.height - leg.end[2],
            travel.seconds - travel.passing(hurdle.leave),
        )
        for hurdle in leg.hurdles
    ]

    def attempt(peak: float) -> _Try:
        up, down = leg.lift(peak - leg.start[2]), leg.lift(peak - leg.end[2])
        wait = max((up.passing(rise) - first for rise, first, _, _ in marks), default=0.0)
        early = max((down.passing(fall) - last for _, _, fall, last in marks), default=0.0)
        return _Try(up, down, max(wait, 0.0), max(early, 0.0))

    lowest, highest = attempt(leg.rise), attempt(_enough_height(leg))
    peak, best = _best_peak(attempt, leg, lowest, highest, travel.seconds)
    horizontal = travel.seconds + best.wait + best.early
    seconds = max(horizontal, best.vertical)
    bound = max(
        lowest.vertical,
        travel.seconds + highest.wait + highest.early,
        min(horizontal, best.vertical),
    )
    return Race(travel, best.up, best.down, peak, best.wait + (seconds - horizontal) / 2, seconds, bound)


def _enough_height(leg: Leg) -> float:
    """A peak above which A no longer falls: z passes the highest hurdle at full speed, or at the ceiling."""
    space = leg.scene.table.space
    return min(leg.rise + space.velocity[2] ** 2 / (2 * space.acceleration[2]), space.upper[2])


def _best_peak(
    attempt: Callable[[float], _Try], leg: Leg, lowest: _Try, highest: _Try, travel: float
) -> tuple[float, _Try]:
    """The lowest peak from which going higher gains nothing, by halving: A falls and B rises with it."""
    floor = travel + highest.wait + highest.early + _WORTH

    def enough(one: _Try) -> bool:
        return travel + one.wait + one.early <= max(one.vertical, floor)

    if enough(lowest):
        return leg.rise, lowest
    low, high, best = leg.rise, _enough_height(leg), highest
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        one = attempt(middle)
        if enough(one):
            high, best = middle, one
        else:
            low = middle
    return high, best
