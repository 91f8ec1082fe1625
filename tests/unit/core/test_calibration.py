from dataclasses import replace
from datetime import UTC, datetime
from itertools import combinations
from math import degrees, hypot, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.calibration import CORNERS, Calibration, Tolerances, Touched, calibrate
from kempelen.core.errors import CalibrationError
from kempelen.core.geometry import Array, Transform
from kempelen.core.places import Place
from kempelen.core.table import Table

WHEN = datetime(2026, 5, 1, 12, 30, tzinfo=UTC)
UNIT = {"a1": (0, 0), "h1": (8, 0), "h8": (8, 8), "a8": (0, 8)}
SUBSETS = [names for n in (2, 3, 4) for names in combinations(CORNERS, n)]


def touch(
    pose: Transform, square: float, names: tuple[str, ...] = CORNERS, inset: float = 0.0
) -> dict[str, Array]:
    """What an errorless robot would touch."""
    points = {}
    for name in names:
        x, y = (inset + u * (8 - 2 * inset) / 8 for u in UNIT[name])
        points[name] = pose @ np.array([x * square, y * square, 0.0])
    return points


def level(angle: float = 0.3, at: tuple[float, float, float] = (120.0, 40.0, 3.0)) -> Transform:
    return Transform.about_z(angle, at)


def assert_same(pose: Transform, other: Transform, within: float = 1e-6) -> None:
    np.testing.assert_allclose(pose.matrix, other.matrix, atol=within)


@given(
    angle=st.floats(-np.pi, np.pi),
    x=st.floats(-500, 500),
    y=st.floats(-500, 500),
    z=st.floats(-50, 50),
    square=st.floats(20, 100),
    names=st.sampled_from(SUBSETS),
    known=st.booleans(),
    touched=st.sampled_from(["corner", "centre"]),
)
def test_any_board_is_found_from_any_two_to_four_corners(
    angle: float,
    x: float,
    y: float,
    z: float,
    square: float,
    names: tuple[str, ...],
    known: bool,
    touched: Touched,
) -> None:
    pose = level(angle, (x, y, z))
    points = touch(pose, square, names, 0.5 if touched == "centre" else 0.0)
    found = calibrate(points, date=WHEN, square=square if known else None, touched=touched)
    assert_same(found.robot_from_board, pose)
    assert found.square == pytest.approx(square)
    assert found.rms < 1e-6
    assert set(found.residuals) == set(names)


def test_calibration_keeps_rotation_and_offset() -> None:
    """Regression: the original kept only a tile width and ignored rotation and offset."""
    found = calibrate(touch(level(radians(30), (200.0, 10.0, 0.0)), 40.0), date=WHEN)
    table = Table(robot_from_board=found.robot_from_board, square=found.square)
    # h1's centre: 7.5 squares along rank 1 and half a square up, turned by 30 degrees about (200, 10).
    c, s = np.cos(radians(30)), np.sin(radians(30))
    np.testing.assert_allclose(
        table.centre(Place("h1")), [200 + 300 * c - 20 * s, 10 + 300 * s + 20 * c, 0.0], atol=1e-6
    )


@given(slope_x=st.floats(-0.02, 0.02), slope_y=st.floats(-0.02, 0.02), angle=st.floats(-3, 3))
def test_a_tilted_board_is_found_whole(slope_x: float, slope_y: float, angle: float) -> None:
    normal = np.array([-slope_x, -slope_y, 1.0]) / hypot(slope_x, slope_y, 1.0)
    across = np.cross(normal, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    tilted = Transform(
        np.column_stack([np.cross(across, normal), across, normal]), np.array([10.0, 20.0, 5.0])
    )
    pose = tilted @ Transform.about_z(angle)
    for names in (("a1", "h1", "a8"), CORNERS):
        found = calibrate(touch(pose, 50.0, names), date=WHEN, square=50.0)
        assert_same(found.robot_from_board, pose)


def test_two_corners_measure_the_tilt_along_their_line_and_none_across() -> None:
    found = calibrate({"a1": (0, 0, 0), "h1": (400, 0, 4)}, date=WHEN)
    up = found.robot_from_board.rotation[:, 2]
    assert up[0] == pytest.approx(-0.01, abs=1e-5)
    assert up[1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("names", SUBSETS)
def test_a_scattered_hand_is_averaged_and_the_residual_reported(names: tuple[str, ...]) -> None:
    rng = np.random.default_rng(7)
    pose = level()
    for _ in range(20):
        points = {n: p + rng.uniform(-0.4, 0.4, 3) for n, p in touch(pose, 50.0, names).items()}
        found = calibrate(points, date=WHEN, square=50.0)
        assert np.linalg.norm(found.robot_from_board.translation - pose.translation) < 1.5
        assert abs(degrees(found.robot_from_board.yaw - pose.yaw)) < 0.2
        off = [found.residuals[n] for n in names]
        assert found.rms == pytest.approx(np.sqrt(np.mean(np.square(off))))
        assert 0 < found.rms <= max(off) < 0.8


def test_four_corners_are_nearer_the_truth_than_two() -> None:
    rng = np.random.default_rng(1)
    pose = level()

    def error(names: tuple[str, ...]) -> float:
        points = {n: p + rng.normal(0, 0.3, 3) for n, p in touch(pose, 50.0, names).items()}
        found = calibrate(points, date=WHEN, square=50.0, tolerances=Tolerances(residual=9))
        middle = np.array([200.0, 350.0, 0.0])
        return float(np.linalg.norm(found.robot_from_board @ middle - pose @ middle))

    assert np.mean([error(CORNERS) for _ in range(200)]) < 0.8 * np.mean(
        [error(("a1", "h1")) for _ in range(200)]
    )


def test_a_heavier_corner_pulls_the_board_to_itself() -> None:
    points = touch(level(), 50.0)
    points["h8"] = points["h8"] + [1.0, 1.0, 0.0]
    even = calibrate(points, date=WHEN, square=50.0)
    trusting = calibrate(points, date=WHEN, square=50.0, weights={"h8": 10.0})
    assert trusting.residuals["h8"] < even.residuals["h8"] / 2
    assert trusting.weights == {"a1": 1.0, "h1": 1.0, "h8": 10.0, "a8": 1.0}


def test_the_least_squares_fit_is_a_minimum() -> None:
    rng = np.random.default_rng(3)
    points = {n: p + np.append(rng.uniform(-0.5, 0.5, 2), 0) for n, p in touch(level(), 50.0).items()}
    best = calibrate(points, date=WHEN, square=50.0)

    def cost(pose: Transform) -> float:
        ideal = touch(pose, 50.0)
        return sum(float(np.sum((ideal[n] - points[n]) ** 2)) for n in CORNERS)

    least = cost(best.robot_from_board)
    for shift in np.vstack([np.eye(3), -np.eye(3)]) * 1e-3:
        assert (
            cost(Transform(best.robot_from_board.rotation, best.robot_from_board.translation + shift)) > least
        )
    for turn in (-1e-5, 1e-5):
        assert cost(best.robot_from_board @ Transform.about_z(turn, (200 * turn, -200 * turn, 0))) > least


@pytest.mark.parametrize("pair", list(combinations(CORNERS, 2)))
@pytest.mark.parametrize("square", [50.0, None])
def test_swapped_corners_are_named(pair: tuple[str, str], square: float | None) -> None:
    points = touch(level(1.0), 50.0)
    one, other = pair
    points[one], points[other] = points[other], points[one]
    with pytest.raises(CalibrationError, match=rf"{one} and {other}.*look swapped.*mm.*anticlockwise"):
        calibrate(points, date=WHEN, square=square)


def test_swapped_corners_are_named_among_three() -> None:
    points = touch(level(1.0), 50.0, ("a1", "h1", "h8"))
    points["a1"], points["h1"] = points["h1"], points["a1"]
    with pytest.raises(CalibrationError, match="a1 and h1.*look swapped"):
        calibrate(points, date=WHEN)


def test_a_misnamed_corner_is_named() -> None:
    points = touch(level(), 50.0, ("a1", "h1"))
    far = touch(level(), 50.0)["h8"]
    with pytest.raises(CalibrationError, match="misnamed: a1 is where a8.*or h1 is where h8"):
        calibrate({**points, "h1": far}, date=WHEN, square=50.0)


def test_the_same_corner_touched_twice_is_told() -> None:
    points = touch(level(), 50.0)
    points["h8"] = points["h1"] + [0.2, 0.1, 30.0]
    with pytest.raises(CalibrationError, match="h1 and h8 are only 0.2 mm apart.*twice"):
        calibrate(points, date=WHEN)


def test_skew_is_refused_with_sides_and_angles() -> None:
    points = {"a1": (0, 0, 0), "h1": (400, 0, 0), "h8": (430, 400, 0), "a8": (30, 400, 0)}
    with pytest.raises(CalibrationError) as caught:
        calibrate(points, date=WHEN, square=50.0)
    assert "no square" in caught.value.message
    assert "a1-h1 400.0 mm" in caught.value.message
    assert "angle at a1 85.7°" in caught.value.message
    assert "at most 1.5 mm" in caught.value.message


def test_one_bad_corner_among_four_is_the_one_named() -> None:
    points = touch(level(), 50.0)
    points["a8"] = points["a8"] + [0.0, 12.0, 0.0]
    with pytest.raises(CalibrationError, match="no square: a8 is 6.* mm off"):
        calibrate(points, date=WHEN)


def test_scale_beyond_the_tolerance_is_refused_with_both_squares() -> None:
    with pytest.raises(CalibrationError, match=r"squares of 52\.00 mm.*says 50\.00 mm: \+4\.0 %.*±0\.5 %"):
        calibrate(touch(level(), 52.0), date=WHEN, square=50.0)


def test_a_tilted_board_is_refused_with_its_angle() -> None:
    points = {"a1": (0, 0, 0), "h1": (400, 0, 0), "a8": (0, 400, 40)}
    with pytest.raises(CalibrationError, match=r"tilted by 5\.7.°, at most 2\.00°.*a8 at 40\.0 mm"):
        calibrate(points, date=WHEN)


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ({}, "0 corner"),
        ({"a1": (0, 0, 0)}, "1 corner"),
        ({"a1": (0, 0, 0), "b1": (50, 0, 0)}, "'b1' is no corner"),
        ({"a1": (0, 0, 0), "h1": (400, float("nan"), 0)}, "h1 is not three finite numbers"),
        ({"a1": (0, 0, 0), "h1": (400, 0)}, "h1 is not three finite numbers"),
        ({"a1": (0, 0, 0), "h1": (2000, 0, 0)}, r"Squares of 250\.00 mm"),
        ({"a1": (0, 0, 0), "h1": (64, 0, 0)}, r"Squares of 8\.00 mm"),
    ],
)
def test_impossible_corners_are_refused(points: dict[str, tuple[float, ...]], said: str) -> None:
    with pytest.raises(CalibrationError, match=said):
        calibrate(points, date=WHEN)


@pytest.mark.parametrize("square", [0.0, -50.0, 500.0, float("nan")])
def test_an_impossible_known_square_is_refused(square: float) -> None:
    with pytest.raises(CalibrationError, match="a board has 15 to 120 mm"):
        calibrate(touch(level(), 50.0), date=WHEN, square=square)


@pytest.mark.parametrize("weight", [0.0, -1.0, float("nan"), float("inf")])
def test_a_weight_that_is_none_is_refused(weight: float) -> None:
    with pytest.raises(CalibrationError, match="weight of corner h1"):
        calibrate(touch(level(), 50.0), date=WHEN, weights={"h1": weight})


@given(
    points=st.fixed_dictionaries({}, optional={n: st.tuples(*[st.floats(-1e4, 1e4)] * 3) for n in CORNERS}),
    square=st.none() | st.floats(1, 200),
)
def test_any_points_give_a_believable_board_or_a_calibration_error(
    points: dict[str, tuple[float, float, float]], square: float | None
) -> None:
    try:
        found = calibrate(points, date=WHEN, square=square)
    except CalibrationError:
        return
    assert 15 <= found.square <= 120
    assert found.rms <= 1.5
    assert degrees(found.robot_from_board.tilt) <= 2.0 + 1e-9


def test_whether_the_residual_says_anything() -> None:
    two = touch(level(), 50.0, ("a1", "h8"))
    assert not calibrate(two, date=WHEN).checked
    assert calibrate(two, date=WHEN, square=50.0).checked
    assert calibrate(touch(level(), 50.0), date=WHEN).checked


def test_a_calibration_tells_itself() -> None:
    found: Calibration = calibrate(touch(level(radians(10)), 50.0), date=WHEN)
    assert str(replace(found, rms=0.25)) == (
        "a1 at (120.0, 40.0, 3.0) mm, turned 10.00°, tilted 0.00°, squares 50.00 mm, residual 0.25 mm over 4 "
        "corners, 2026-05-01 12:30"
    )
