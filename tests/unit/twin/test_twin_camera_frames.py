"""The twin's cameras: true optics, one kind of noise at a time, and no more drawn than has changed."""

import math
from collections.abc import Iterator
from dataclasses import replace

import chess
import numpy as np
import pytest

from kempelen.core.camera import Frame
from kempelen.core.geometry import Array
from kempelen.core.places import Layout
from kempelen.core.table import Table, start_layout
from kempelen.twin.cameras import D435, KINECT_V2, NOMINAL, OFF, Lighting, Noise, Placement, VirtualCamera
from kempelen.twin.cameras.still import Still
from kempelen.twin.physics import Scene

pytestmark = pytest.mark.physics

TABLE = Table()
KINECT = replace(KINECT_V2, colour=KINECT_V2.colour.scaled(0.25))
STEREO = replace(D435, colour=D435.colour.scaled(0.25))
STARTED = Scene.from_layout(TABLE, start_layout(TABLE, chess.Board()), seed=4)
CENTRES = np.array([[25.0 + 50 * (i % 8), 25.0 + 50 * (i // 8), 0.0] for i in range(64)])
EMPTY_ROWS = slice(16, 48)


@pytest.fixture(scope="module")
def still() -> Still:
    return Still(STARTED)


@pytest.fixture(scope="module")
def bare() -> Still:
    return Still(Scene.from_layout(TABLE, Layout({})))


@pytest.fixture(scope="module")
def camera() -> Iterator[VirtualCamera]:
    with VirtualCamera(KINECT, noise=OFF) as camera:
        yield camera


@pytest.fixture
def ideal(camera: VirtualCamera) -> VirtualCamera:
    camera.change(placement=Placement(), lighting=Lighting(), noise=OFF)
    return camera


def depth_of(frame: Frame) -> Array:
    assert frame.depth is not None
    return frame.depth.astype(np.float64)


def colour_of(frame: Frame) -> Array:
    assert frame.colour is not None
    return frame.colour.astype(np.float64)


def seen_by_depth(points: Array) -> tuple[Array, Array]:
    """Pixels of the depth picture and true depths of points of the board."""
    camera_from_board = Placement().board_from_camera.inverse()
    local = KINECT.colour_from_depth.inverse() @ (camera_from_board @ points)
    return KINECT.depth.project(local), local[:, 2]


def at(picture: Array, pixels: Array) -> Array:
    column, row = np.rint(pixels).astype(int).T
    return np.asarray(picture[row, column])


def board_depths(frame: Frame) -> Array:
    """Errors of the depths of the middles of the empty squares, mm."""
    pixels, truth = seen_by_depth(CENTRES)
    return at(depth_of(frame), pixels)[EMPTY_ROWS] - truth[EMPTY_ROWS]


def test_the_fields_of_view_are_the_real_ones() -> None:
    for lens, wide, high in ((KINECT_V2.colour, 84.1, 53.8), (D435.colour, 69.8, 42.8)):
        assert 2 * math.degrees(math.atan(lens.width / 2 / lens.fx)) == pytest.approx(wide, abs=0.2)
        assert 2 * math.degrees(math.atan(lens.height / 2 / lens.fy)) == pytest.approx(high, abs=0.2)
    assert np.linalg.norm(KINECT_V2.colour_from_depth.translation) == pytest.approx(52, abs=0.5)


def test_an_ideal_depth_picture_is_true_through_a_bending_lens(ideal: VirtualCamera, still: Still) -> None:
    assert np.abs(board_depths(ideal.shoot(still))).max() < 2.0  # a pixel is 2.8 mm, the view is inclined


def test_the_robot_parked_hides_no_square(ideal: VirtualCamera, bare: Still) -> None:
    pixels, truth = seen_by_depth(CENTRES)
    assert np.abs(at(depth_of(ideal.shoot(bare)), pixels) - truth).max() < 2.0
    corners = np.array([[x, y, 0.0] for x in (2.0, 398.0) for y in (2.0, 398.0)])
    pixels, truth = seen_by_depth(corners)
    assert np.abs(at(depth_of(ideal.shoot(bare)), pixels) - truth).max() < 3.0


def test_colours_stand_where_the_intrinsics_say(ideal: VirtualCamera, bare: Still) -> None:
    pixels = KINECT.colour.project(Placement().board_from_camera.inverse() @ CENTRES)
    grey = at(colour_of(ideal.shoot(bare)), pixels).mean(axis=1)
    dark = np.array([(i + i // 8) % 2 == 0 for i in range(64)])
    assert grey[dark].max() + 20 < grey[~dark].min()


def test_the_same_seed_gives_the_same_frames(still: Still) -> None:
    shots = []
    for seed in (5, 5, 6):
        with VirtualCamera(KINECT, seed=seed) as camera:
            shots.append([camera.shoot(still) for _ in range(2)])
    (first, second), (again, _), (other, _) = shots
    assert np.array_equal(colour_of(first), colour_of(again))
    assert np.array_equal(depth_of(first), depth_of(again))
    assert not np.array_equal(depth_of(first), depth_of(second))
    assert not np.array_equal(depth_of(first), depth_of(other))


def test_axial_noise_is_fankhauser_s(ideal: VirtualCamera, bare: Still) -> None:
    ideal.change(noise=OFF.model_copy(update={"axial": 1.0}))
    errors = np.array([board_depths(ideal.shoot(bare)) for _ in range(60)])
    z, theta = 1.05, math.radians(14)
    wanted = 1.5 - 0.5 * z + 0.3 * z**2 + 0.1 * z**1.5 * theta**2 / (math.pi / 2 - theta) ** 2
    assert errors.std(axis=0).mean() == pytest.approx(wanted, rel=0.1)
    assert abs(errors.mean()) < 1.0


def test_dark_squares_spread_more_and_read_low(ideal: VirtualCamera, bare: Still) -> None:
    dark = np.array([(i + i // 8) % 2 == 0 for i in range(64)])[EMPTY_ROWS]
    clean = board_depths(ideal.shoot(bare))
    ideal.change(noise=OFF.model_copy(update={"dark_offset": 10.0}))
    shift = board_depths(ideal.shoot(bare)) - clean
    assert 3.0 < shift[dark].mean() - shift[~dark].mean() < 8.0
    ideal.change(noise=OFF.model_copy(update={"axial": 1.0, "dark_spread": True}))
    spread = np.array([board_depths(ideal.shoot(bare)) for _ in range(60)]).std(axis=0)
    assert spread[dark].mean() > 1.2 * spread[~dark].mean()


def test_an_offset_moves_everything_and_wiggling_stays_in_its_range(
    ideal: VirtualCamera, bare: Still
) -> None:
    clean = depth_of(ideal.shoot(bare))
    ideal.change(noise=OFF.model_copy(update={"offset": -18.0}))
    both = (clean > 520) & (depth_of(ideal.shoot(bare)) > 0)
    assert np.allclose((depth_of(ideal.shoot(bare)) - clean)[both], -18.0, atol=1e-3)
    ideal.change(noise=OFF.model_copy(update={"wiggling": 1.0}))
    shift = (depth_of(ideal.shoot(bare)) - clean)[both]
    assert shift.min() >= -15.01
    assert shift.max() <= 7.01
    assert np.ptp(shift) > 3.0


def test_flying_pixels_lie_where_nothing_is(ideal: VirtualCamera, still: Still) -> None:
    clean = depth_of(ideal.shoot(still))
    ideal.change(noise=OFF.model_copy(update={"flying": True}))
    mixed = depth_of(ideal.shoot(still))
    padded = np.pad(clean, 1, mode="edge")
    near = np.min([padded[i : i + 424, j : j + 512] for i in range(3) for j in range(3)], axis=0)
    far = np.max([padded[i : i + 424, j : j + 512] for i in range(3) for j in range(3)], axis=0)
    solid = (near > 0) & (mixed > 0)
    flying = solid & (mixed > near + 5) & (mixed < far - 5) & (np.abs(mixed - clean) > 5)
    assert flying.sum() > 300
    flat = solid & (far - near < 2)
    assert np.quantile(np.abs(mixed - clean)[flat], 0.99) < 0.1, "a surface alone is not mixed"


def test_multipath_lengthens_the_way_beside_pieces_only(ideal: VirtualCamera, still: Still) -> None:
    clean = depth_of(ideal.shoot(still))
    ideal.change(noise=OFF.model_copy(update={"multipath": 10.0}))
    shift = depth_of(ideal.shoot(still)) - clean
    beside, _ = seen_by_depth(np.array([[25.0 + 50 * i + 20.0, 75.0, 0.0] for i in range(8)]))
    far, _ = seen_by_depth(CENTRES[24:40])
    assert at(shift, beside).mean() > 3.0
    assert at(shift, far).max() < 2.0
    assert shift.max() <= 10.0


def test_glossy_black_drops_out_in_the_share_asked_for(ideal: VirtualCamera, still: Still) -> None:
    whole = depth_of(ideal.shoot(still)) > 0
    ideal.change(noise=OFF.model_copy(update={"dropout": 0.3}))
    lost = np.mean([whole & (depth_of(ideal.shoot(still)) == 0) for _ in range(20)], axis=0)
    assert lost[lost > 0].mean() == pytest.approx(0.3, abs=0.04)
    white, _ = seen_by_depth(CENTRES[:16])
    assert at(lost, white).max() == 0
    matt = Still(replace(STARTED, look=STARTED.look.model_copy(update={"gloss": 0.0})))
    assert np.array_equal(depth_of(ideal.shoot(matt)) > 0, whole)


def test_lateral_noise_shakes_edges_and_leaves_the_plane(ideal: VirtualCamera, still: Still) -> None:
    ideal.change(noise=OFF.model_copy(update={"lateral": 1.6}))
    shots = np.array([depth_of(ideal.shoot(still)) for _ in range(20)])
    pixels, _ = seen_by_depth(CENTRES[EMPTY_ROWS])
    assert at(shots.std(axis=0), pixels).max() < 1.5  # the plane is inclined by 14 degrees
    assert (shots.std(axis=0) > 10).sum() > 500


def test_shot_noise_is_that_asked_for(ideal: VirtualCamera, bare: Still) -> None:
    ideal.change(noise=OFF.model_copy(update={"shot": 3.0}))
    shots = np.array([colour_of(ideal.shoot(bare))[:60] for _ in range(30)])
    level = shots.mean()
    assert shots.std(axis=0).mean() == pytest.approx(3.0 * math.sqrt(level / 128), rel=0.15)


def test_light_and_lens(ideal: VirtualCamera, still: Still) -> None:
    usual = colour_of(ideal.shoot(still))
    ideal.change(lighting=Lighting(exposure=0.5))
    assert colour_of(ideal.shoot(still)).mean() == pytest.approx(usual.mean() / 2, rel=0.03)
    ideal.change(lighting=Lighting(white_balance=(1.0, 1.0, 0.5)))
    assert colour_of(ideal.shoot(still))[..., 0].mean() == pytest.approx(usual[..., 0].mean() / 2, rel=0.03)
    ideal.change(lighting=Lighting(lamp=(-900.0, 200.0, 900.0)))
    assert (np.abs(colour_of(ideal.shoot(still)) - usual).max(axis=2) > 30).mean() > 0.01
    ideal.change(lighting=Lighting(glare=1.0, lamp=(200.0, 450.0, 1020.0)))
    assert colour_of(ideal.shoot(still))[150:].max() == 255
    ideal.change(lighting=Lighting(on=False))
    dark = ideal.shoot(still)
    assert colour_of(dark).max() < 4
    assert depth_of(dark).max() > 0, "the camera brings its own infrared light"
    ideal.change(lighting=Lighting(covered=True))
    covered = ideal.shoot(still)
    assert colour_of(covered).max() < 4
    assert depth_of(covered).max() == 0


def test_only_what_moved_is_drawn_anew_and_nothing_is_missed(still: Still) -> None:
    stage = Still(STARTED)
    with VirtualCamera(KINECT, noise=OFF) as patient, VirtualCamera(KINECT, noise=OFF) as fresh:
        patient.shoot(stage)
        stage.data.qpos[:2] += (0.12, -0.04)
        stage.data.qpos[-5] -= 0.15
        stage.data.mocap_pos[0] += (0.0, 0.3, 0.0)
        patient.shoot(stage)
        stage.data.qpos[7:9] += (0.02, 0.03)
        updated, whole, before = patient.shoot(stage), fresh.shoot(stage), fresh.shoot(still)
    assert np.abs(depth_of(updated) - depth_of(whole)).max() < 0.5
    assert (np.abs(colour_of(updated) - colour_of(whole)) > 8).mean() < 1e-3
    assert (np.abs(depth_of(before) - depth_of(whole)) > 20).sum() > 1000


def test_a_stereo_camera_is_blind_beside_things_and_round_at_edges(still: Still) -> None:
    with VirtualCamera(STEREO, noise=OFF) as camera:
        sharp = depth_of(camera.shoot(still))
        camera.change(noise=OFF.model_copy(update={"disparity": 0.08}))
        shots = np.array([depth_of(camera.shoot(still)) for _ in range(12)])
        camera.change(noise=OFF.model_copy(update={"holes": 0.05}))
        holed = depth_of(camera.shoot(still))
    assert 0.002 < (sharp == 0).mean() < 0.1, "what only one eye sees"
    middle = shots[:, 200:260, 300:500]
    seen = (middle > 0).all(axis=0)
    wanted = 1050.0**2 * 0.08 / (D435.depth.fx * D435.baseline)
    assert np.median(middle.std(axis=0)[seen]) == pytest.approx(wanted, rel=0.5)
    assert ((holed == 0) & (sharp > 0)).mean() == pytest.approx(0.05, abs=0.02)


def test_numbers_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match="greater than or equal to 0"):
        Noise(axial=-1)
    with pytest.raises(ValueError, match="50 mm or more"):
        Placement(position=(0, 0, 10), target=(0, 0, 0))
    with pytest.raises(ValueError, match="Extra inputs"):
        Lighting.model_validate({"lamps": 3})
    assert Noise() == NOMINAL
