import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.errors import CalibrationError

KINECT = Intrinsics(512, 424, 365.5, 365.5, 254.9, 205.4, (0.0905, -0.268, 0.0, 0.0, 0.0951))


@given(x=st.floats(-0.6, 0.6), y=st.floats(-0.5, 0.5), z=st.floats(400, 3000))
def test_a_pixels_ray_goes_through_the_point_it_shows(x: float, y: float, z: float) -> None:
    point = np.array([[x * z, y * z, z]])
    assert KINECT.rays(KINECT.project(point))[0] == pytest.approx([x, y, 1.0], abs=1e-6)


def test_a_resized_picture_shows_the_same_rays() -> None:
    half = KINECT.scaled(0.5)
    assert (half.width, half.height) == (256, 212)
    corner = KINECT.rays([[-0.5, -0.5]])  # the picture's very corner stays its corner
    assert half.rays([[-0.5, -0.5]]) == pytest.approx(corner)


def test_a_field_of_view_reaches_from_edge_to_edge() -> None:
    camera = Intrinsics.of_view(640, 480, np.pi / 2)
    assert not camera.distorted
    assert camera.rays([[-0.5, 239.5]])[0] == pytest.approx([-1.0, 0.0, 1.0])
    assert camera.matrix @ [0.0, 0.0, 1.0] == pytest.approx([319.5, 239.5, 1.0])


@pytest.mark.parametrize("change", [{"width": 0}, {"fx": -1.0}, {"cx": float("nan")}])
def test_what_no_camera_has_is_refused(change: dict[str, float]) -> None:
    values = {"width": 640, "height": 480, "fx": 500.0, "fy": 500.0, "cx": 320.0, "cy": 240.0} | change
    with pytest.raises(CalibrationError, match="no camera"):
        Intrinsics(**values)  # type: ignore[arg-type]


def test_depth_taken_later_than_colour_shows_as_skew() -> None:
    assert Frame(0, 1.0).skew == 0.0
    assert Frame(0, 1.0, depth_time=1.25).skew == pytest.approx(0.25)
