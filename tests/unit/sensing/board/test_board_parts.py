import numpy as np
import pytest
from tests.unit.sensing.board.chequer import CAMERA, depth_of, view

from kempelen.core.camera import Frame
from kempelen.core.errors import BoardNotFoundError
from kempelen.core.geometry import Array
from kempelen.sensing.board.fit import BoardFit, fit_board
from kempelen.sensing.board.lattice import apply, fit_homography, inverse
from kempelen.sensing.board.placement import Placement
from kempelen.sensing.board.plane import depth_points, find_plane, find_table, image_from_plane, meet
from kempelen.sensing.board.pose import camera_from_board
from kempelen.sensing.board.search import Candidate

INNER = np.stack(np.meshgrid(np.arange(1.0, 8.0), np.arange(1.0, 8.0)), axis=-1).reshape(-1, 2)
CORNERS = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]])


def hinged(gap: float, axis: int) -> tuple[Array, Array]:
    """Pixels of the inner and of the outer corners of a board whose halves lie apart."""
    truth, _ = view(turn=0.2)

    def opened(places: Array) -> Array:
        out = places.copy()
        out[:, axis] += np.sign(out[:, axis] - 4) * gap / 2
        return apply(truth, out)[0]

    return opened(INNER), opened(CORNERS)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("gap", [0.1, 0.25])
def test_a_hinge_is_measured_and_the_outer_corners_are_right(gap: float, axis: int) -> None:
    pixels, ends = hinged(gap, axis)
    noisy = pixels + np.random.default_rng(0).normal(0, 0.1, pixels.shape)

    fitted = fit_board(INNER, noisy)

    assert fitted is not None
    assert fitted.hinge == axis
    assert fitted.gap == pytest.approx(gap, abs=0.03)
    assert apply(fitted.pixels_from_window, CORNERS)[0] == pytest.approx(ends, abs=1.0)


def test_a_plain_board_has_no_hinge() -> None:
    pixels, _ = hinged(0.0, 0)

    fitted = fit_board(INNER, pixels + np.random.default_rng(0).normal(0, 0.4, pixels.shape))

    assert fitted is not None
    assert fitted.hinge is None


def test_a_few_false_corners_hardly_matter() -> None:
    pixels, ends = hinged(0.0, 0)
    pixels[[3, 20, 31, 40]] += ((6, -5), (-7, 4), (5, 5), (-4, 8))

    fitted = fit_board(INNER, pixels)

    assert fitted is not None
    assert apply(fitted.pixels_from_window, CORNERS)[0] == pytest.approx(ends, abs=1.0)


def test_points_on_a_line_determine_no_homography() -> None:
    line = np.column_stack([np.arange(6.0), np.zeros(6)])

    assert fit_homography(line, line * 30 + 5) is None


def test_the_table_is_found_under_what_stands_on_it() -> None:
    _, pose = view(tilt=0.6, distance=900)
    depth = depth_of(pose, noise=3.0)
    depth[100:260, 200:420] -= 90.0  # a box
    depth[300:340, :] = 0.0  # nothing measured

    plane = find_table(depth_points(Frame(0, 0.0, None, depth, CAMERA, CAMERA)))

    assert plane.normal @ pose.rotation[:, 2] > 0.9999
    assert plane.offset == pytest.approx(-float(pose.rotation[:, 2] @ pose.translation), abs=3.0)
    spot = CAMERA.project((pose @ np.array([40.0, 70.0, 0.0]))[None])
    assert meet(plane, CAMERA.rays(spot))[0] == pytest.approx(pose @ np.array([40.0, 70.0, 0.0]), abs=6.0)


def test_depth_without_a_plane_is_refused() -> None:
    clouds = np.random.default_rng(0).uniform(500, 4000, (480, 640)).astype(np.float32)

    with pytest.raises(BoardNotFoundError, match="No table"):
        find_table(depth_points(Frame(0, 0.0, None, clouds, CAMERA, CAMERA)))
    with pytest.raises(BoardNotFoundError, match="has 0 points"):
        find_table(depth_points(Frame(0, 0.0, None, np.zeros_like(clouds), CAMERA, CAMERA)))


def test_depth_on_one_line_is_refused() -> None:
    depth = np.zeros((480, 640), dtype=np.float32)
    depth[240, :] = 900.0

    points = depth_points(Frame(0, 0.0, None, depth, CAMERA, CAMERA))

    assert len(points) > 100
    for find in (find_table, find_plane):
        with pytest.raises(BoardNotFoundError, match="on one line"):
            find(points)


def test_a_picture_square_on_to_the_table_shows_squares_as_squares() -> None:
    truth, pose = view(tilt=0.9, turn=0.4)
    plane = find_table(depth_points(Frame(0, 0.0, None, depth_of(pose), CAMERA, CAMERA)))

    homography, size = image_from_plane(plane, CAMERA)
    flat = apply(inverse(homography), apply(truth, CORNERS)[0])[0]

    sides = np.linalg.norm(np.roll(flat, -1, axis=0) - flat, axis=1)
    assert sides == pytest.approx(np.full(4, sides.mean()), rel=0.01)
    assert (flat > 0).all()
    assert (flat < size).all()


def test_the_pose_of_an_exact_picture_is_exact() -> None:
    truth, pose = view(tilt=0.7, turn=2.2)

    found = camera_from_board(truth, 40.0, CAMERA)

    assert found is not None
    assert found[0].translation == pytest.approx(pose.translation, abs=0.01)
    assert found[1] < 0.01


def test_a_mirrored_board_has_no_pose() -> None:
    truth, _ = view()

    assert camera_from_board(truth @ np.diag([-1.0, 1.0, 1.0]), 40.0, CAMERA) is None


def candidate(blank_rows: list[int], blank_columns: list[int], *, full_ends: bool) -> Candidate:
    rows, columns = np.full(8, 9.0), np.full(8, 9.0)
    rows[blank_rows] = columns[blank_columns] = -1.0
    placement = Placement(
        np.zeros(2, dtype=np.int64), 0.998, 90.0, rows, columns, np.ones((8, 8), dtype=bool)
    )
    return Candidate(placement, BoardFit(np.eye(3), 0.01), dark_corner=True, full_ends=full_ends)


def test_a_blank_row_takes_more_certainty_unless_men_are_known_to_hide_it() -> None:
    assert candidate([], [], full_ends=False).sure
    assert not candidate([0, 7], [], full_ends=False).sure
    assert candidate([0, 7], [], full_ends=True).sure
    assert candidate([], [7], full_ends=True).sure
    assert not candidate([3], [], full_ends=True).sure
    assert not candidate([0], [7], full_ends=True).sure
