from dataclasses import replace

import numpy as np
import pytest

from kempelen.core.errors import BoardNotFoundError, CalibrationError
from kempelen.core.geometry import Transform
from kempelen.sensing.depth.geometry import MARGIN, depth_of, view_board
from kempelen.sensing.depth.heights import board_cells, by_square, map_heights, supported
from kempelen.sensing.depth.shadow import shadow_heights
from kempelen.testing.depth_scene import BASELINE, SQUARE, DepthScene, men


@pytest.mark.parametrize("tilt", [0.0, 25.0, 45.0])
@pytest.mark.parametrize("offset", [-18.0, 18.0])
def test_a_tall_piece_is_counted_on_its_own_square(tilt: float, offset: float) -> None:
    scene = DepthScene(tilt=tilt, posts=men({27: 95.0}))
    frame = scene.frame(noise=1.0, offset=offset)
    view = view_board(frame, scene.sighting)
    seen = map_heights(view, depth_of(frame))
    board = board_cells(view.cells)
    highest = np.nanmax(by_square(seen.heights[board, board], view.cells), axis=(1, 2))
    assert highest[27] == pytest.approx(95, abs=4)
    assert np.delete(highest, 27).max() < 8
    assert view.square == pytest.approx(SQUARE * (1 + offset / 900), rel=0.01)


def test_measures_depend_on_nothing_but_geometry() -> None:
    scene = DepthScene(tilt=30.0, turn=25.0, shift=(30.0, -20.0))
    view = view_board(scene.frame(noise=0.5), scene.sighting)
    # a point 40 mm over c5, as the depth camera sees it
    point = (BASELINE.inverse() @ scene.camera_from_board) @ np.array([2.5 * SQUARE, 4.5 * SQUARE, 40.0])
    frame = scene.frame()
    assert frame.depth_camera is not None
    column, row = np.rint(frame.depth_camera.project(point[None])[0]).astype(int)
    depth = np.zeros_like(depth_of(frame))
    depth[row, column] = point[2]
    index, height = view.cell_of(view.crop(depth))
    hit = np.flatnonzero(index.ravel() >= 0)
    y, x = divmod(int(index.ravel()[hit[0]]), view.size)
    assert len(hit) == 1
    assert (x + 0.5) / view.cells - MARGIN == pytest.approx(2.5, abs=0.2)
    assert (y + 0.5) / view.cells - MARGIN == pytest.approx(4.5, abs=0.2)
    assert height.ravel()[hit[0]] == pytest.approx(40, abs=1.5)
    assert view.elevation == pytest.approx(np.radians(60), abs=0.1)


def test_depth_without_intrinsics_is_refused() -> None:
    scene = DepthScene()
    frame = scene.frame()
    with pytest.raises(CalibrationError, match="intrinsics"):
        view_board(replace(frame, depth_camera=None), scene.sighting)
    with pytest.raises(CalibrationError, match="no depth picture"):
        view_board(replace(frame, depth=None), scene.sighting)
    with pytest.raises(CalibrationError, match="rows and columns"):
        view_board(replace(frame, depth=depth_of(frame)[:100]), scene.sighting)


def test_cameras_that_see_different_things_are_noticed() -> None:
    scene = DepthScene()
    elsewhere = Transform(np.eye(3), np.array([-5000.0, 0.0, 0.0]))
    with pytest.raises(BoardNotFoundError):
        view_board(replace(scene.frame(), colour_from_depth=elsewhere), scene.sighting)


def test_pixels_between_two_surfaces_are_left_out() -> None:
    depth = np.full((20, 20), 900.0, np.float32)
    depth[5:10, 5:10] = 820.0
    depth[12, 12] = 860.0  # a flying pixel
    depth[0, 0] = 0.0
    kept = supported(depth)
    assert kept[7, 7]
    assert kept[5, 5]  # the corner of a surface
    assert kept[19, 19]
    assert not kept[12, 12]
    assert not kept[0, 0]
    assert kept[11, 12]


def test_not_a_number_is_nothing_measured() -> None:
    scene = DepthScene()
    frame = scene.frame(noise=1.0)
    view = view_board(frame, scene.sighting)
    depth = depth_of(frame).copy()
    rows, columns = (slice(part.start + 60, part.start + 90) for part in (view.rows, view.columns))
    depth[rows, columns] = np.nan
    seen = map_heights(view, depth)
    assert seen.missing.sum() > 0
    assert np.nanmax(np.abs(seen.heights[board_cells(view.cells), board_cells(view.cells)])) < 10


@pytest.mark.parametrize("tilt", [20.0, 45.0])
def test_a_shadow_reaches_as_far_as_the_line_of_sight(tilt: float) -> None:
    scene = DepthScene(tilt=tilt, posts=men({27: 90.0}))  # d4; the camera is on White's side
    frame = scene.frame(noise=0.5)
    view = view_board(frame, scene.sighting)
    hidden = shadow_heights(map_heights(view, depth_of(frame)).heights, view)
    x = round((3.5 + MARGIN) * view.cells)
    behind, before = (round((y + MARGIN) * view.cells) for y in (4.2, 2.8))
    depth_camera = (scene.camera_from_board.inverse() @ BASELINE).translation
    distance = 0.7 * SQUARE - 14  # from its far edge
    slope = (depth_camera[2] - 90) / np.hypot(*(depth_camera[:2] - [3.5 * SQUARE, 3.5 * SQUARE]))
    assert hidden[behind, x] == pytest.approx(max(90 - distance * slope, 0), abs=18)
    assert hidden[before, x] == 0
