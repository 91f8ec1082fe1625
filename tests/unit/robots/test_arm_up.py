"""An arm's way straight up, from wherever its hand may be."""

import numpy as np
import pytest

from kempelen.app.config import load_config
from kempelen.core.errors import MotionError
from kempelen.kinematics import forward, load_arm
from kempelen.motion.arm.guidance import BOW, joints_at
from kempelen.motion.arm.motors import Motors
from kempelen.robots.arm.paths import ArmPaths

ARM = load_arm("labvolt-5150")
TABLE = load_config(None, {"robot.kind": "arm"}).build_table()
PATHS = ArmPaths(Motors.of(ARM), TABLE.space)


def postures(count: int) -> np.ndarray:
    """(m, n) rad: stretched, folded, leaning outwards and inwards, above the table."""
    low, high = [-1.5, 60.0, 66.0, -0.9, 0.0], [1.5, 480.0, 400.0, 0.9, 0.0]
    rows = np.random.default_rng(5).uniform(low, high, (count, 5))
    rows[::2, 3] = 0.0
    joints = joints_at(ARM, rows)
    return joints[np.isfinite(joints).all(axis=1)]


def test_it_goes_straight_up_from_anywhere_as_high_as_it_can() -> None:
    found = postures(240)
    assert len(found) > 100
    for joints in found:
        path = PATHS.retract(joints)
        between = path.joints[:-1] + np.linspace(0, 1, 5)[:, None, None] * np.diff(path.joints, axis=0)
        points = forward(ARM, between)[..., :3, 3].reshape(-1, 3)
        start = np.array(PATHS.tool(joints))
        if len(points):
            assert np.linalg.norm(points[:, :2] - start[:2], axis=1).max() <= 1.5 * BOW  # corners are rounded
        assert (path.joints >= ARM.ranges[:, 0] - 1e-9).all()
        assert (path.joints <= ARM.ranges[:, 1] + 1e-9).all()
        top = PATHS.tool(path.joints[-1])[2]
        assert top >= min(start[2], TABLE.park_height) - 1e-6
        assert top > start[2] + 1.0 or start[2] > TABLE.park_height


def test_a_folded_arm_reaches_the_parking_height() -> None:
    """Where the pitch comes to its limit the hand leans more, in time."""
    joints = joints_at(ARM, np.array([[0.7, 125.0, 80.0, 0.0, 0.0]]))[0]
    assert PATHS.tool(PATHS.retract(joints).joints[-1])[2] > TABLE.park_height


def test_at_the_top_there_is_nothing_to_drive() -> None:
    joints = joints_at(ARM, np.array([[0.0, 200.0, 360.0, 0.5, 0.0]]))[0]
    top = PATHS.retract(joints).joints[-1]
    assert PATHS.retract(top).seconds < 1.0


def test_an_elbow_that_hangs_down_is_homed_first() -> None:
    joints = np.radians([61.0, 0.0, 13.0, 54.0, 0.0])
    with pytest.raises(MotionError, match="elbow is down") as caught:
        PATHS.retract(joints)
    assert "Home it first" in caught.value.hint
