"""Surfaces of board and trays, and the parking points above their sides."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.geometry import Transform
from kempelen.core.table import Table, Tray


def leaning(turn: float, lean: float) -> Transform:
    c, s = np.cos(lean), np.sin(lean)
    tilt = Transform(np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), np.zeros(3))
    return Transform.about_z(turn, (100.0, 50.0, 7.0)) @ tilt


@given(st.floats(-3.1, 3.1), st.floats(-0.03, 0.03))
def test_every_place_lies_on_its_surface(turn: float, lean: float) -> None:
    trays = (Tray(name="left", origin=(-90.0, 25.0), height=-12.0),)
    table = Table(robot_from_board=leaning(turn, lean), trays=trays)
    surfaces = {surface.name: surface for surface in table.surfaces}
    for place in table.places:
        x, y, z = table.centre(place)
        surface = surfaces[place.tray or "board"]
        assert surface.height(x, y) == pytest.approx(z, abs=1e-9)
        u, v = surface.local(x, y)
        assert 20 < u < surface.size[0] - 20
        assert 20 < v < surface.size[1] - 20


def test_level_and_square_by_hand() -> None:
    board, left, right = Table().surfaces
    assert (board.corner, board.size, board.slope) == ((150.0, 25.0, 0.0), (400.0, 400.0), (0.0, 0.0))
    assert (left.corner, left.size) == ((35.0, 25.0, 0.0), (100.0, 400.0))
    assert (right.name, right.local(565.0, 25.0)) == ("right", (0.0, 0.0))


def test_parking_is_above_the_nearer_side_and_above_every_piece() -> None:
    table = Table()
    for x, side in ((170.0, 150.0), (340.0, 150.0), (360.0, 550.0), (640.0, 550.0)):
        park = table.park_point(np.array([x, 123.0, 20.0]))
        assert park.tolist() == [side, 123.0, table.park_height]
    king = table.pieces.king
    assert table.park_height - king.grip_height > king.height
    assert table.upwards.tolist() == [0, 0, 1]
