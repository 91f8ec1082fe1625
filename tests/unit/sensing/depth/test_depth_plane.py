import numpy as np
import pytest

from kempelen.core.errors import BoardNotFoundError
from kempelen.sensing.depth.plane import fit_board_plane


def cloud(n: int, occupied: float, noise: float = 1.5, seed: int = 0) -> np.ndarray:
    """Points of a tilted board 900 mm away, some of them on pieces."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-200, 200, (2, n))
    up = rng.normal(0, noise, n)
    up[: int(occupied * n)] += rng.uniform(10, 90, int(occupied * n))
    normal = np.array([0.2, -0.4, -0.9]) / np.linalg.norm([0.2, -0.4, -0.9])
    across = np.cross(normal, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    middle = np.array([0.0, 0.0, 900.0])
    out: np.ndarray = (
        x[:, None] * across + y[:, None] * np.cross(normal, across) + middle + up[:, None] * normal
    )
    return out


@pytest.mark.parametrize("occupied", [0.0, 0.2, 0.45])
def test_plane_lies_under_the_pieces(occupied: float) -> None:
    plane = fit_board_plane(cloud(4000, occupied))
    board = cloud(4000, 0.0, noise=0.0, seed=5)
    assert np.abs(plane.heights(board)).max() < 1.5
    assert plane.heights(np.zeros((1, 3)))[0] > 500  # the camera is above
    assert 1.0 < plane.noise < 2.5


def test_a_few_points_are_no_plane() -> None:
    with pytest.raises(BoardNotFoundError, match="Only 20 points"):
        fit_board_plane(cloud(20, 0.0))


def test_a_cloud_is_no_plane() -> None:
    scattered = np.random.default_rng(1).uniform((-400, -400, 500), (400, 400, 1300), (3000, 3))
    with pytest.raises(BoardNotFoundError, match="lie on one plane"):
        fit_board_plane(scattered)
