"""Dedu's supercover line, against exact geometry."""

from fractions import Fraction as F

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.motion.supercover import cells

CELLS = st.tuples(st.integers(-3, 11), st.integers(-3, 11))


def touched(start, end):
    """Cells whose closed square the segment between the centres meets, by clipping with exact fractions.

    Cells met only along a shared side's line do not occur: centres lie inside of cells.
    """
    found = set()
    for x in range(min(start[0], end[0]) - 1, max(start[0], end[0]) + 2):
        for y in range(min(start[1], end[1]) - 1, max(start[1], end[1]) + 2):
            low, high = F(0), F(1)
            for a, b, side in ((start[0], end[0], x), (start[1], end[1], y)):
                p, d = F(a) + F(1, 2), F(b - a)
                if d == 0:
                    if not side <= p <= side + 1:
                        low, high = F(1), F(0)
                    continue
                t0, t1 = sorted(((side - p) / d, (side + 1 - p) / d))
                low, high = max(low, t0), min(high, t1)
            if low <= high:
                found.add((x, y))
    return found


@given(CELLS, CELLS)
def test_exactly_the_squares_that_the_line_meets(start, end):
    line = cells(start, end)
    assert set(line) == touched(start, end)
    assert len(line) == len(set(line))
    assert (line[0], line[-1]) == (start, end)


@given(CELLS, CELLS)
def test_there_and_back_are_the_same_squares(start, end):
    assert set(cells(start, end)) == set(cells(end, start))


@pytest.mark.parametrize(("sx", "sy"), [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_a_line_through_a_corner_takes_both_side_squares(sx, sy):
    assert set(cells((0, 0), (sx, sy))) == {(0, 0), (sx, 0), (0, sy), (sx, sy)}
    assert len(cells((0, 0), (3 * sx, 3 * sy))) == 10


def test_knight_move():
    assert cells((0, 0), (1, 2)) == [(0, 0), (0, 1), (1, 1), (1, 2)]


def test_nowhere():
    assert cells((2, 3), (2, 3)) == [(2, 3)]
