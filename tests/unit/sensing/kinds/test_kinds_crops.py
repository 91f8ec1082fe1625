"""Crops show each square in the same place, size and light, wherever the camera stands."""

import math
from collections.abc import Sequence

import cv2
import numpy as np
import pytest

from kempelen.core.geometry import Array, Transform
from kempelen.sensing.kinds.crops import CENTRES, FOOT, HEIGHT, SQUARE_PIXELS, WIDTH, Stand, crops, levels
from kempelen.sensing.sighting import BoardSighting

SIZE = (960, 720)
FOCAL = 900.0
CAMERA = np.array([[FOCAL, 0, (SIZE[0] - 1) / 2], [0, FOCAL, (SIZE[1] - 1) / 2], [0, 0, 1]])
SQUARE = 50.0
POSTS = (0, 6, 27, 48, 62)


def posed(elevation: float, azimuth: float, distance: float = 800.0) -> Transform:
    """Camera from board, mm: looking at the board's middle, degrees."""
    up, turn = math.radians(elevation), math.radians(azimuth)
    back = np.array([math.cos(up) * math.cos(turn), math.cos(up) * math.sin(turn), math.sin(up)])
    right = np.array([-math.sin(turn), math.cos(turn), 0.0])
    rotation = np.stack([right, -np.cross(back, right), -back])
    eye = np.array([4 * SQUARE, 4 * SQUARE, 0.0]) + distance * back
    return Transform(rotation, -rotation @ eye)


def sighted(pose: Transform, *, with_pose: bool = True) -> BoardSighting:
    columns = np.column_stack([pose.rotation[:, :2] * SQUARE, pose.translation])
    return BoardSighting(
        CAMERA @ columns, 0.0, 1.0, "test", oriented=True, square=SQUARE if with_pose else None,
        camera_from_board=pose if with_pose else None,
    )  # fmt: skip


def projected(pose: Transform, points: Array) -> Array:
    seen = (pose @ (points * SQUARE)) @ CAMERA.T
    return np.asarray(seen[:, :2] / seen[:, 2:])


def painted(pose: Transform, dark: int = 60, light: int = 190, posts: Sequence[int] = POSTS) -> np.ndarray:
    """A board with posts of one square's height."""
    picture = np.full((SIZE[1], SIZE[0], 3), 110, np.uint8)
    for square, (x, y) in enumerate(CENTRES):
        quad = np.array([[x + a, y + b, 0] for a, b in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))])
        shade = light if (square % 8 + square // 8) % 2 else dark
        cv2.fillConvexPoly(picture, projected(pose, quad).round().astype(np.int32), (shade, shade, shade))
    for x, y in CENTRES[list(posts)]:
        foot, top = projected(pose, np.array([[x, y, 0], [x, y, 1.0]])).round().astype(int).tolist()
        cv2.line(picture, foot, top, (0, 0, 255), 3)
    return picture


@pytest.mark.parametrize("elevation", [25, 50, 75, 88])
@pytest.mark.parametrize("azimuth", [-90, 30, 160])
def test_the_space_over_the_board_is_projected_from_the_pose(elevation: float, azimuth: float) -> None:
    pose = posed(elevation, azimuth)
    points = np.array([[0.5, 0.5, 0.0], [7.5, 3.2, 1.7], [4, 4, 1.0], [2, 6, 0.5]])
    stand = Stand.of(sighted(pose), *SIZE)
    assert stand.pixels(points) == pytest.approx(projected(pose, points), abs=1e-6)
    depth = (pose @ (points * SQUARE))[:, 2]
    assert stand.scale(points) == pytest.approx(FOCAL * SQUARE / depth, rel=1e-9)


@pytest.mark.parametrize("elevation", [25, 45, 65])
def test_without_a_pose_a_slanting_view_tells_the_focal_length(elevation: float) -> None:
    pose = posed(elevation, 20)
    stand = Stand.of(sighted(pose, with_pose=False), *SIZE)
    tops = np.column_stack([CENTRES, np.ones(64)])
    assert stand.focal == pytest.approx(FOCAL, rel=0.02)
    assert np.abs(stand.pixels(tops) - projected(pose, tops)).max() < 2.0


def test_from_straight_above_the_usual_lens_is_assumed() -> None:
    stand = Stand.of(sighted(posed(89.9, 0), with_pose=False), *SIZE)
    assert stand.focal == pytest.approx(0.95 * SIZE[0], rel=0.02)


@pytest.mark.parametrize("elevation", [30, 55, 80])
def test_feet_lie_in_one_place_and_posts_point_up(elevation: float) -> None:
    pose = posed(elevation, 35)
    feet = np.column_stack([CENTRES, np.zeros(64)])
    rise = projected(pose, feet + np.array([0, 0, 1.0])) - projected(pose, feet)
    tall = np.linalg.norm(rise, axis=1) * SQUARE_PIXELS * (pose @ (feet * SQUARE))[:, 2] / FOCAL / SQUARE
    for square in POSTS:
        seen = crops(painted(pose, posts=[square]), sighted(pose))
        assert seen.shape == (64, HEIGHT, WIDTH, 4)
        blue, green, red = (seen[square, ..., c].astype(int) for c in range(3))
        rows, columns = np.nonzero(red - np.maximum(blue, green) > 50)
        assert rows.max() == pytest.approx(FOOT[1], abs=3)
        assert columns.mean() == pytest.approx(FOOT[0], abs=1.5)
        assert rows.max() - rows.min() == pytest.approx(tall[square], abs=5)


def test_squares_are_of_one_size_whatever_the_distance() -> None:
    marks = []
    for distance in (700.0, 1100.0):
        pose = posed(50, 10, distance)
        marks.append(crops(painted(pose), sighted(pose))[..., 3] > 0)
    areas = [mark.sum(axis=(1, 2)) for mark in marks]
    expected = SQUARE_PIXELS**2 * math.sin(math.radians(50))
    assert np.median(areas[0]) / expected == pytest.approx(1.0, abs=0.1)
    assert areas[0] / areas[1] == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(("dark", "light"), [(30, 90), (60, 190), (120, 250)])
def test_light_is_taken_out_by_the_board(dark: int, light: int) -> None:
    pose = posed(60, 70)
    seen = crops(painted(pose, dark, light), sighted(pose))
    assert levels(painted(pose, dark, light), sighted(pose)) == pytest.approx((dark, light), abs=1)
    for square in range(64):
        if square not in POSTS:
            shade = 170 if (square % 8 + square // 8) % 2 else 85
            assert np.median(seen[square, 68:79, 26:37, 0]) == pytest.approx(shade, abs=4)


def test_a_turned_picture_gives_the_same_crops() -> None:
    pose = posed(45, 10)
    picture, sighting = painted(pose), sighted(pose, with_pose=False)
    turned = np.ascontiguousarray(picture[::-1, ::-1])
    spin = np.array([[-1, 0, SIZE[0] - 1], [0, -1, SIZE[1] - 1], [0, 0, 1.0]])
    other = BoardSighting(spin @ sighting.image_from_board, 0.0, 1.0, "test", oriented=True)
    same = crops(picture, sighting).astype(int) - crops(turned, other).astype(int)
    assert np.abs(same).mean() < 2.0


def test_a_shrunk_picture_gives_nearly_the_same_crops() -> None:
    pose = posed(45, 10, 600)
    picture, sighting = painted(pose), sighted(pose, with_pose=False)
    half = np.asarray(cv2.resize(picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    shrink = np.array([[0.5, 0, -0.25], [0, 0.5, -0.25], [0, 0, 1.0]])
    other = BoardSighting(shrink @ sighting.image_from_board, 0.0, 1.0, "test", oriented=True)
    difference = np.abs(crops(picture, sighting).astype(int) - crops(half, other).astype(int))
    assert difference[..., :3].mean() < 6


def test_a_board_that_leaves_the_picture_is_cropped_all_the_same() -> None:
    pose = posed(50, 10, 400)
    seen = crops(painted(pose), sighted(pose))
    assert (seen[..., :3] == 128).all(axis=-1).any()  # beyond the edge


def test_a_picture_without_contrast_gives_no_extremes() -> None:
    pose = posed(50, 10)
    grey = np.full((SIZE[1], SIZE[0], 3), 70, np.uint8)
    assert np.ptp(crops(grey, sighted(pose))[..., :3].astype(int)) <= 128
