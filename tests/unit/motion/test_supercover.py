"""Dedu's supercover line, against exact geometry."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.motion.supercover import Cell, cells

CELLS = st.tuples(st.integers(-3, 11), st.integers(-3, 11))


def touched(start: Cell, end: Cell) -> set[Cell]:
    """Cells whose closed square the segment between the centres meets, by clipping with exact fractions.

    Cells met only along a shared side's line do not occur: centres lie inside of cells.
    """
    found: set[Cell] = set()
    for x in range(min(start[0], end[0]) - 1, max(start[0], end[0]) + 2):
        for y in range(min(start[1], end[1]) - 1, max(start[1], end[1]) + 2):
            low, high = Fraction(0), Fraction(1)
            for a, b, side in ((start[0], end[0], x), (start[1], end[1], y)):
                p, d = Fraction(a) + Fraction(1, 2), Fraction(b - a)
                if d == 0:
                    if not side <= p <= side + 1:
                        low, high = Fraction(1), Fraction(0)
                    continue
                t0, t1 = sorted(((side - p) / d, (side + 1 - p) / d))
                low, high = max(low, t0), min(high, t1)
            if low <= high:
                found.add((x, y))
    return found


@given(CELLS, CELLS)
def test_exactly_the_squares_that_the_line_meets(start: Cell, end: Cell) -> None:
    line = cells(start, end)
    assert set(line) == touched(start, end)
    assert len(line) == len(set(line))
    assert (line[0], line[-1]) == (start, end)


@given(CELLS, CELLS)
def test_there_and_back_are_the_same_squares(start: Cell, end: Cell) -> None:
    assert set(cells(start, end)) == set(cells(end, start))


@pytest.mark.parametrize(("sx", "sy"), [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_a_line_through_a_corner_takes_both_side_squares(sx: int, sy: int) -> None:
    assert set(cells((0, 0), (sx, sy))) == {(0, 0), (sx, 0), (0, sy), (sx, sy)}
    assert len(cells((0, 0), (3 * sx, 3 * sy))) == 10


def test_knight_move() -> None:
    assert cells((0, 0), (1, 2)) == [(0, 0), (0, 1), (1, 1), (1, 2)]


def test_nowhere() -> None:
    assert cells((2, 3), (2, 3)) == [(2, 3)]
