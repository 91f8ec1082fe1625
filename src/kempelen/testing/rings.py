"""Rings for tests: frames that say which they are, and waiting for what another thread does."""

import time
from collections.abc import Callable

import numpy as np

from kempelen.core.camera import Frame

SHAPE = (40, 60, 3)


def numbered(number: int) -> Frame:
    """Every pixel says which frame it belongs to."""
    return Frame(
        number, number / 30, np.full(SHAPE, number % 251, np.uint8), np.full((20, 30), number, np.float32)
    )


def until(condition: Callable[[], bool]) -> None:
    """Wait for it, 10 s at most."""
    deadline = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.001)
