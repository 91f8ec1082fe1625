import numpy as np
import pytest

from kempelen.sensing.sighting import OUTER_CORNERS, BoardSighting


def test_pixels_and_squares_are_two_views_of_the_same_points() -> None:
    sighting = BoardSighting(
        np.array([[80.0, 5.0, 100.0], [-3.0, 60.0, 50.0], [1e-4, 0.02, 1.0]]), 0.01, 1.0, "made up"
    )
    assert sighting.board_points(sighting.corners) == pytest.approx(OUTER_CORNERS, abs=1e-9)
    assert sighting.pixels([[0.0, 0.0]])[0] == pytest.approx([100.0, 50.0])
