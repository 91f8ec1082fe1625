"""Cut a race into a polyline for a controller that knows straight lines only.

Between two switches of acceleration a the curve is a parabola. From a point with velocity v, a chord
that lasts T lies |a x v| T² / (8 |v + a T / 2|) off the curve at most. The controller passes the corner
between two chords at

    v² = (rate across the path) * (junction deviation) / (chord's distance from the curve) * (radius),

so the finer the cut, the faster the corners. Each chord lies off by `FINENESS` times the junction
deviation, less where the axes together turn the path faster than the controller believes they can (its
limit across the path is that of the axis that would be strained most, while in the race both axes pull
at their limits).
"""

from itertools import pairwise
from math import sqrt

from kempelen.motion.leg import Leg
from kempelen.motion.race import Race

FINENESS = 1.0
"""Distance of the chords from the curve over the junction deviation: at 1 the axes' limits are kept."""
SHORTEST = 0.4
"""Length of a chord worth sending, mm, unless the curve turns within less."""
_TURNLESS = 1e-6
_INSTANT = 1e-9

_Pair = tuple[float, float]
"""Along the line, and up."""


def cut(leg: Leg, race: Race) -> list[_Pair]:
    """The race's curve as points (distance along the line, z), mm, from the leg's start to its end."""
    space = leg.scene.table.space
    limits = (race.travel.acceleration, space.acceleration[2])
    deviation = FINENESS * space.junction_deviation
    s, z, vs, vz = 0.0, leg.start[2], 0.0, 0.0
    points = [(s, z)]
    for span, rate_s, rate_z in _spans(race):
        left = span
        while left > _INSTANT:
            step = _chord((vs, vz), (rate_s, rate_z), limits, deviation)
            if step > 0.7 * left:  # rather two halves, or the whole, than a crumb at the end
                step = left if step >= left else 0.5 * left
            s += vs * step + 0.5 * rate_s * step * step
            z += vz * step + 0.5 * rate_z * step * step
            vs += rate_s * step
            vz += rate_z * step
            left -= step
            points.append((s, z))
    points[-1] = (leg.length, leg.end[2])
    return _without_crumbs(points, deviation)


def _without_crumbs(points: list[_Pair], deviation: float) -> list[_Pair]:
    """Leave out the ends of chords too short to be worth it, where the path stays as close to the curve."""
    kept = [points[0]]
    for (s, z), (after_s, after_z) in pairwise(points[1:]):
        before_s, before_z = kept[-1]
        gap = min(abs(s - before_s) + abs(z - before_z), abs(after_s - s) + abs(after_z - z))
        if gap < SHORTEST:
            along_s, along_z = after_s - before_s, after_z - before_z
            off = abs((s - before_s) * along_z - (z - before_z) * along_s)
            if off <= deviation * sqrt(along_s * along_s + along_z * along_z):
                continue
        kept.append((s, z))
    return [*kept, points[-1]]


def _chord(velocity: _Pair, rate: _Pair, limits: _Pair, deviation: float) -> float:
    """About the longest time, s, whose chord is fine enough; infinite on a straight line."""
    (vs, vz), (rate_s, rate_z) = velocity, rate
    turn = abs(rate_s * vz - rate_z * vs)
    if turn < _TURNLESS:
        return float("inf")
    # As if at the speed of its beginning, then at that of its middle.
    step = sqrt(8.0 * deviation * sqrt(vs * vs + vz * vz) / turn)
    ms, mz = vs + 0.5 * rate_s * step, vz + 0.5 * rate_z * step
    speed = sqrt(ms * ms + mz * mz)
    believed = speed * min(limits[0] / max(abs(mz), _INSTANT), limits[1] / max(abs(ms), _INSTANT))
    return sqrt(8.0 * deviation * speed / turn * min(believed * speed / turn, 1.0))


def _spans(race: Race) -> list[tuple[float, float, float]]:
    """Durations of constant acceleration with the accelerations along the line and up."""
    events = [(time, 0, change) for time, change in race.travel.switches(race.wait)]
    events += [(time, 1, change) for time, change in race.up.switches(0.0)]
    fall = race.seconds - race.down.seconds
    events += [(time, 1, change) for time, change in race.down.switches(fall, -1.0)]
    events.sort(key=lambda event: event[0])
    rates = [0.0, 0.0]
    spans, last = [], 0.0
    for time, axis, change in events:
        if time - last > _INSTANT:
            spans.append((time - last, rates[0], rates[1]))
            last = time
        rates[axis] += change
    return spans
