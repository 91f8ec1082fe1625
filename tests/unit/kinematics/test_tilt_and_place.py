"""Least tilt is the least there is; a board is put where the gripper leans least."""

import numpy as np
import pytest
from tests.unit.kinematics.arms_for_tests import TWISTED

from kempelen.core.errors import ReachError
from kempelen.core.geometry import Array
from kempelen.kinematics import (
    Arm,
    forward,
    inverse_batch,
    least_tilt,
    least_tilts,
    load_arm,
    tilt_of,
    tilt_range,
    tilts,
)
from kempelen.kinematics.workspace import base_radius, best_placement, largest_square, place_board, workspace

LABVOLT = load_arm("labvolt-5150")
_STEP = np.radians(0.5)


def _points(count: int) -> Array:
    rng = np.random.default_rng(11)
    return np.stack(
        [rng.uniform(40, 430, count), rng.uniform(-250, 250, count), rng.uniform(-50, 350, count)], 1
    )


@pytest.mark.parametrize("arm", [LABVOLT, load_arm("so-101"), TWISTED], ids=lambda arm: arm.name)
def test_least_tilt_is_what_looking_everywhere_finds(arm: Arm) -> None:
    grid = np.arange(-np.pi / 3, np.pi / 3 + 1e-9, _STEP)
    points = _points(60)
    for point, least in zip(points, least_tilts(arm, points), strict=True):
        fits = inverse_batch(arm, np.tile(point, (len(grid), 1)), np.pi - grid).within.any(axis=1)
        if not fits.any():
            if np.isfinite(least):  # between two places of the grid
                assert inverse_batch(arm, point, np.pi - least).within.any()
            continue
        seen = np.abs(grid[fits]).min()
        assert seen - _STEP - 1e-9 <= abs(least) <= seen + 1e-6


def test_the_posture_stands_there_and_leans_as_said() -> None:
    for point in _points(40):
        try:
            found = least_tilt(LABVOLT, point)
        except ReachError:
            assert not np.isfinite(least_tilts(LABVOLT, point))
            continue
        assert forward(LABVOLT, found.joints)[:3, 3] == pytest.approx(point, abs=1e-6)
        assert float(tilt_of(LABVOLT, found.joints)) == pytest.approx(found.tilt, abs=1e-9)
        assert LABVOLT.within(found.joints)
        assert found.tilt == pytest.approx(float(least_tilts(LABVOLT, point)), abs=1e-9)


def test_every_tilt_of_a_range_is_possible_and_none_beyond_its_ends() -> None:
    for point in ((150.0, 40.0, 86.0), (372.0, 60.0, 90.0), (90.0, 0.0, 100.0)):
        for one in tilts(LABVOLT, point):
            inside = np.linspace(one.low, one.high, 40)
            assert inverse_batch(LABVOLT, np.tile(point, (40, 1)), np.pi - inside).within.any(axis=1).all()
            assert one.low <= one.least <= one.high
        low, high = tilt_range(LABVOLT, point)
        beyond = np.array([low - 1e-3, high + 1e-3])
        fits = inverse_batch(LABVOLT, np.tile(point, (2, 1)), np.pi - beyond).within
        inner = np.abs(beyond) < np.pi / 3
        assert not fits[inner].any()


def test_no_tilt_at_all_is_a_question_too() -> None:
    assert float(least_tilts(LABVOLT, (250.0, 0, 80), most=0.0)) == pytest.approx(0, abs=1e-6)
    assert np.isnan(least_tilts(LABVOLT, (420.0, 0, 80), most=0.0))


def test_what_needs_too_much_tilt_says_how_much() -> None:
    with pytest.raises(ReachError, match=r"with a tilt up to 10°: it needs [123]\d\.\d°"):
        least_tilt(LABVOLT, (410, 0, 90), most=np.radians(10))
    with pytest.raises(ReachError, match=r"with any tilt. Straight down: .*beyond the 380 mm"):
        least_tilt(LABVOLT, (900, 0, 90))


def test_larger_boards_need_more_tilt() -> None:
    sizes = [largest_square(LABVOLT, [66], [20], np.radians(tilt), distance=120) for tilt in (0, 15, 30)]
    assert sizes == sorted(sizes)
    for size, tilt in zip(sizes, (0, 15, 30), strict=True):
        most = np.radians(tilt)
        assert place_board(LABVOLT, size, 120, 66, [20], most).reached
        assert not place_board(LABVOLT, size + 0.2, 120, 66, [20], most).reached


def test_the_best_place_beats_the_others() -> None:
    best = best_placement(LABVOLT, 40, [66], [20, 90])
    assert best.reached
    assert best.tilted > 0
    assert best.distance - 20 >= base_radius(LABVOLT)
    for distance in np.arange(95, 300, 20.0):
        assert place_board(LABVOLT, 40, float(distance), 66, [20, 90]).worst >= best.worst - 1e-3


def test_a_board_too_large_is_told_the_largest() -> None:
    with pytest.raises(ReachError, match=r"squares of 90\.0 mm .*; squares of \d\d\.\d mm are the largest"):
        best_placement(LABVOLT, 90, [66], [20])


def test_the_workspace_ends_where_the_paper_says() -> None:
    space = workspace(LABVOLT, 20, np.pi / 2)
    far = np.hypot(space.radial, space.up[:, None] - 255)[np.isfinite(space.tilt)].max()
    assert 420 < far < 496  # 432 mm around the shoulder in the paper, 495 at full stretch
    rings = space.rings(np.pi / 2)
    assert (rings[:, 1] <= rings[:, 2]).all()
