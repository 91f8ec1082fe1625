"""How long a polyline takes on the controller.

The speed model of GRBL 1.1 (`planner.c`): each segment at the highest speed and acceleration that every
axis allows in its direction, corners at the speed of the junction deviation, trapezoids planned over the
whole path, from rest to rest.
"""

from math import sqrt

import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.table import WorkSpace

_STRAIGHT = 0.999999
"""Cosine of the turn from which on the controller takes a corner for none."""


def travel_seconds(vertices: Array, space: WorkSpace) -> float:
    """Predicted time along ``vertices`` (n, 3) mm, s, from rest to rest."""
    steps = np.diff(vertices, axis=0)
    lengths = np.sqrt((steps * steps).sum(axis=1))
    moving = lengths > 0
    steps, lengths = steps[moving], lengths[moving]
    if not len(lengths):
        return 0.0
    units = steps / lengths[:, None]
    top = _axis_limit(units, space.velocity) ** 2
    rate = 2.0 * _axis_limit(units, space.acceleration)
    corner = np.minimum(_junctions(units, space), np.minimum(top[1:], top[:-1]))
    return _seconds(lengths.tolist(), top.tolist(), rate.tolist(), corner.tolist())


def _axis_limit(units: Array, limits: tuple[float, float, float]) -> Array:
    """Largest magnitude (m,) along ``units`` (m, 3) that keeps every axis within its limit."""
    with np.errstate(divide="ignore", over="ignore"):
        limit: Array = (np.asarray(limits) / np.abs(units)).min(axis=1)
    return limit


def _junctions(units: Array, space: WorkSpace) -> Array:
    """Squared speed (m - 1,) at which the corners may be passed, (mm/s)²."""
    before, after = units[:-1], units[1:]
    cosine = (before * after).sum(axis=1)
    bend = after - before
    size = np.sqrt((bend * bend).sum(axis=1))
    speed = np.full(len(cosine), np.inf)
    turning = cosine < _STRAIGHT
    if turning.any():
        rate = _axis_limit(bend[turning] / size[turning, None], space.acceleration)
        half = np.sqrt(
            np.maximum(0.5 * (1.0 + cosine[turning]), 0.0)
        )  # sine of half the angle between the legs
        speed[turning] = rate * space.junction_deviation * half / (1.0 - half)
    return speed


def _seconds(lengths: list[float], top: list[float], rate: list[float], corner: list[float]) -> float:
    """Time of the trapezoids; ``top``, ``corner``: squared speeds, ``rate``: twice the acceleration."""
    speeds = [0.0, *corner, 0.0]
    for i in range(len(lengths) - 1, 0, -1):
        speeds[i] = min(speeds[i], speeds[i + 1] + rate[i] * lengths[i])
    total = 0.0
    for i, length in enumerate(lengths):
        enter = speeds[i]
        leave = speeds[i + 1] = min(speeds[i + 1], enter + rate[i] * length)
        peak = min(top[i], 0.5 * (enter + leave + rate[i] * length))
        v0, v, v1 = sqrt(enter), sqrt(peak), sqrt(leave)
        ramps = (2.0 * peak - enter - leave) / rate[i]
        total += 2.0 * (2.0 * v - v0 - v1) / rate[i] + max(length - ramps, 0.0) / v
    return total
