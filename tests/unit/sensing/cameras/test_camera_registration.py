import numpy as np
import pytest

from kempelen.core.camera import Frame, Intrinsics
from kempelen.core.errors import CameraError
from kempelen.core.geometry import Transform
from kempelen.sensing.cameras.registration import Registration, registered, rotation_between

DEPTH = Intrinsics(128, 106, 91.4, 91.4, 63.7, 51.3)
COLOUR = Intrinsics(240, 135, 132.0, 132.0, 119.5, 67.0)
BESIDE = Transform(np.eye(3), np.array([-52.0, 0.0, 0.0]))


def test_a_camera_seen_from_itself_is_itself() -> None:
    rng = np.random.default_rng(1)
    depth = rng.uniform(500, 1500, (106, 128)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.1] = 0
    registration = Registration(DEPTH, DEPTH, Transform.identity())
    assert np.allclose(registration.apply(depth), depth, rtol=1e-6)


@pytest.mark.parametrize("bent", [False, True])
def test_a_wall_stays_a_wall_without_holes(bent: bool) -> None:
    colour = (
        Intrinsics(240, 135, 132.0, 132.0, 119.5, 67.0, (0.05, -0.02, 0.001, 0.0, 0.0)) if bent else COLOUR
    )
    turned = Transform.about_z(0.05, (-52.0, 1.0, 4.0))
    out = Registration(DEPTH, colour, turned).apply(np.full((106, 128), 1000, np.float32))
    middle = out[20:115, 60:180]
    assert (middle == 1004).all()


def test_what_is_near_hides_what_is_behind_it() -> None:
    depth = np.full((106, 128), 1500, np.float32)
    depth[40:60, 50:80] = 700
    out = Registration(DEPTH, COLOUR, BESIDE).apply(depth)
    near = out == 700
    row = near[67]
    columns = np.flatnonzero(row)
    left = COLOUR.project((50 - DEPTH.cx) / DEPTH.fx * np.array([700.0, 0, 0]) + (-52, 0, 700))[0]
    assert columns[0] == pytest.approx(left, abs=2)
    assert row[columns[0] : columns[-1] + 1].all()


def test_projection_is_the_exact_one() -> None:
    rng = np.random.default_rng(2)
    depth = rng.uniform(500, 1500, (106, 128)).astype(np.float32)
    depth[3, 4] = 0
    pose = Transform.about_z(-0.1, (30.0, -5.0, 2.0))
    pixels = Registration(DEPTH, COLOUR, pose).project(depth)
    assert np.isnan(pixels[3, 4]).all()
    for row, column in ((0, 0), (50, 60), (105, 127)):
        point = DEPTH.rays([[column, row]]) * depth[row, column]
        assert pixels[row, column] == pytest.approx(COLOUR.project(pose @ point)[0], abs=1e-3)


def test_a_frame_and_what_is_kept_for_the_next_one() -> None:
    frame = Frame(
        0, 0.0, np.zeros((135, 240, 3), np.uint8), np.full((106, 128), 900, np.float32), COLOUR, DEPTH, BESIDE
    )  # fmt: skip
    moved, known = registered(frame)
    assert moved.depth is not None
    assert moved.depth.shape == (135, 240)
    assert moved.depth_camera == COLOUR
    assert np.array_equal(moved.colour_from_depth.matrix, np.eye(4))
    assert registered(frame, known)[1] is known


def test_what_cannot_be_registered() -> None:
    with pytest.raises(CameraError, match="lacks depth or the intrinsics"):
        registered(Frame(0, 0.0, np.zeros((4, 4, 3), np.uint8)))
    with pytest.raises(CameraError, match="64 x 64 px came from a camera of 128 x 106"):
        Registration(DEPTH, COLOUR, BESIDE).apply(np.zeros((64, 64), np.float32))


def test_the_turn_between_directions() -> None:
    rng = np.random.default_rng(3)
    turn = Transform.about_z(0.7).rotation
    ours = rng.normal(size=(20, 3))
    assert np.allclose(rotation_between(ours, ours @ turn.T), turn)
