from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import CalibrationError
from kempelen.core.geometry import Transform

angles = st.floats(-pi, pi)
shifts = st.tuples(*[st.floats(-1000, 1000)] * 3)


@st.composite
def transforms(draw: st.DrawFn) -> Transform:
    tilt = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # y, z, x: a turn about the space diagonal
    turned = Transform(tilt, np.zeros(3)) if draw(st.booleans()) else Transform.identity()
    return turned @ Transform.about_z(draw(angles), draw(shifts))


@given(a=transforms(), b=transforms(), c=transforms())
def test_transforms_are_a_group(a: Transform, b: Transform, c: Transform) -> None:
    np.testing.assert_allclose(((a @ b) @ c).matrix, (a @ (b @ c)).matrix, atol=1e-8)
    np.testing.assert_allclose((a @ Transform.identity()).matrix, a.matrix)
    np.testing.assert_allclose((a @ a.inverse()).matrix, np.eye(4), atol=1e-9)


@given(a=transforms(), b=transforms(), point=shifts)
def test_composition_moves_points_one_after_the_other(
    a: Transform, b: Transform, point: tuple[float, float, float]
) -> None:
    np.testing.assert_allclose((a @ b) @ point, a @ (b @ point), atol=1e-8)
    np.testing.assert_allclose((a.matrix @ [*point, 1.0])[:3], a @ point, atol=1e-9)


@given(a=transforms(), one=shifts, other=shifts)
def test_distances_are_kept(
    a: Transform, one: tuple[float, float, float], other: tuple[float, float, float]
) -> None:
    apart = np.linalg.norm(np.subtract(one, other))
    assert np.linalg.norm(a @ one - a @ other) == pytest.approx(apart, abs=1e-8)


def test_a_quarter_turn() -> None:
    turn = Transform.about_z(pi / 2, (10.0, 0.0, 0.0))
    np.testing.assert_allclose(turn @ [1.0, 2.0, 3.0], [8.0, 1.0, 3.0], atol=1e-12)
    assert turn.yaw == pytest.approx(pi / 2)
    assert turn.tilt == 0.0


def test_many_points_at_once() -> None:
    turn = Transform.about_z(0.3, (1.0, 2.0, 3.0))
    points = np.arange(24.0).reshape(2, 4, 3)
    moved = turn @ points
    assert moved.shape == (2, 4, 3)
    np.testing.assert_allclose(moved[1, 2], turn @ points[1, 2])


def test_tilt_is_the_angle_between_the_z_axes() -> None:
    c, s = np.cos(0.1), np.sin(0.1)
    assert Transform(np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), np.zeros(3)).tilt == pytest.approx(0.1)


def test_parts_cannot_be_changed_from_outside() -> None:
    shift = np.zeros(3)
    transform = Transform(np.eye(3), shift)
    shift[0] = 5.0
    assert transform.translation[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        transform.rotation[0, 0] = 2.0


@pytest.mark.parametrize(
    ("rotation", "said"),
    [
        (np.diag([1.0, 1.0, 1.1]), "off by 0.21"),
        (np.diag([1.0, 1.0, -1.0]), "is no rotation"),
        (np.full((3, 3), np.nan), "not finite"),
    ],
)
def test_what_is_no_rotation_is_refused(rotation: np.ndarray[tuple[int, int]], said: str) -> None:
    with pytest.raises(CalibrationError, match=said):
        Transform(rotation, np.zeros(3))


def test_an_infinite_shift_is_refused() -> None:
    with pytest.raises(CalibrationError, match="not finite"):
        Transform(np.eye(3), np.array([0.0, np.inf, 0.0]))
