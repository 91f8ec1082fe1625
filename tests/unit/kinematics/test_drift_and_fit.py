"""The account of the drift is true of simulated arms; a fit finds an arm's true measures again."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from kempelen.core.errors import CalibrationError, MotionError
from kempelen.core.geometry import Array, Transform
from kempelen.kinematics import (
    Arm,
    Drift,
    JointErrors,
    Link,
    Slack,
    drift_budget,
    forward,
    inverse,
    least_tilt,
    load_arm,
    stop_loss,
)
from kempelen.kinematics.drift import SIDE_LEFT
from kempelen.kinematics.fit import fit_arm

FROM_FILE = load_arm("labvolt-5150")
_DRIFT = Drift(  # of its own, so that these tests do not hang on how the file is tuned
    stop_bias=np.radians([0.03, -0.015, -0.006, 0, 0]),
    stop_spread=np.radians([0.05, 0.03, 0.015, 0.01, 0.01]),
    play=np.radians([0.1, 0.1, 0.1, 0.4, 0.6]),
    temperature=np.radians([0.01, 0.006, 0.004, 0.002, 0.002]),
)
ARM = replace(FROM_FILE, drift=_DRIFT)
GRASP = inverse(ARM, (300, 100, 90)).joints
MOTION = np.array([ARM.home, GRASP, GRASP + 0.2, GRASP, ARM.home])


def _simulated(runs: int) -> Array:
    """(runs, 5) errors after one motion."""
    rng = np.random.default_rng(0)
    moved = np.abs(np.diff(MOTION, axis=0)) > 1e-6
    return np.array(
        [sum(stop_loss(ARM.drift, row, rng.normal(size=5)) for row in moved) for _ in range(runs)]
    )


def test_the_account_is_what_happens() -> None:
    errors = JointErrors.homed(ARM).after(ARM, MOTION)
    seen = _simulated(4000)
    homed = np.diag(JointErrors.homed(ARM).covariance)
    assert seen.mean(axis=0) == pytest.approx(errors.mean, abs=2e-4)
    assert seen.var(axis=0) == pytest.approx(np.diag(errors.covariance) - homed, rel=0.1, abs=1e-9)
    assert errors.stops.tolist() == [
        (np.abs(np.diff(MOTION, axis=0)) > 1e-6).sum(axis=0)[k] for k in range(5)
    ]


def test_a_joint_that_stands_still_loses_nothing() -> None:
    turned = np.array([ARM.home, ARM.home + np.array([0.3, 0, 0, 0, 0])])
    errors = JointErrors.homed(ARM).after(ARM, turned)
    assert errors.stops.tolist() == [1, 0, 0, 0, 0]
    assert errors.mean[1:] == pytest.approx(0)


def test_the_base_drifts_most_then_the_shoulder() -> None:
    for lost in (FROM_FILE.drift.stop_spread, np.abs(FROM_FILE.drift.stop_bias)):
        assert lost[0] > lost[1] > lost[2]
    assert FROM_FILE.drift.play.argmax() >= 3


def test_without_correction_a_grasp_is_missed_after_about_four_moves() -> None:
    plain = drift_budget(ARM, JointErrors.homed(ARM), GRASP, 6.0, motion=MOTION, compensated=False)
    known = drift_budget(ARM, JointErrors.homed(ARM), GRASP, 6.0, motion=MOTION)
    assert 2 <= plain.moves_left <= 8
    assert known.moves_left > 2 * plain.moves_left
    assert 0 < plain.spent < 1


def test_a_spent_budget_says_so() -> None:
    errors = JointErrors.homed(ARM)
    for _ in range(30):
        errors = errors.after(ARM, MOTION)
    budget = drift_budget(ARM, errors, GRASP, 3.0, compensated=False)
    assert budget.moves_left == 0
    assert budget.spent > 1
    assert drift_budget(ARM, errors, GRASP, 0.0).spent == np.inf


def test_a_look_brings_the_error_back() -> None:
    errors = JointErrors.homed(ARM)
    for _ in range(5):
        errors = errors.after(ARM, MOTION)
    true = errors.mean + np.array([0.02, -0.005, 0, 0, 0])
    off = (forward(ARM, GRASP + true) - forward(ARM, GRASP))[:3, 3]
    off[2] = np.nan  # a camera from above
    after = errors.seen(ARM, GRASP, off, spread=0.3)
    missed = (forward(ARM, after.compensated(GRASP) + true) - forward(ARM, GRASP))[:2, 3]
    assert np.linalg.norm(missed) < 0.6
    assert after.tool(ARM, GRASP).aside_known < errors.tool(ARM, GRASP).aside_known
    assert np.linalg.eigvalsh(after.covariance).min() > -1e-15


def test_where_joints_rest_in_their_play_is_known_once_they_have_turned() -> None:
    rng = np.random.default_rng(4)
    ways = np.cumsum(rng.normal(0.0, 0.002, size=(40, ARM.n)), axis=0)
    half = ARM.drift.play / 2
    carried = ways[0] + rng.uniform(-half, half)  # a joint that its gear takes along
    slack = Slack.unknown(ARM)
    for before, here in pairwise(ways):
        carried = np.clip(carried, here - half, here + half)
        slack = slack.after(ARM, [before, here])
        assert (slack.low - 1e-12 <= carried - here).all()
        assert (carried - here <= slack.high + 1e-12).all()
    assert (slack.width(ARM)[:3] < ARM.drift.play[:3]).all()
    turned = slack.after(ARM, [ways[-1], ways[-1] + 0.1])
    assert turned.mean == pytest.approx(-half)
    assert turned.after(ARM, [ways[-1] + 0.1, ways[-1] - 0.1]).mean == pytest.approx(half)


def test_a_known_side_of_the_play_makes_surer() -> None:
    errors = JointErrors.homed(ARM)
    anywhere, known = errors.tool(ARM, GRASP), errors.tool(ARM, GRASP, play=SIDE_LEFT * ARM.drift.play)
    assert known.aside_known < 0.6 * anywhere.aside_known


def test_what_two_states_of_the_account_have_in_common_cancels() -> None:
    before = JointErrors.homed(ARM).after(ARM, MOTION)
    since = before.after(ARM, MOTION[:2]).since(before)
    assert since.stops.tolist() == (np.abs(MOTION[1] - MOTION[0]) > 1e-6).astype(int).tolist()
    assert since.mean == pytest.approx(since.stops * ARM.drift.stop_bias)
    assert np.diag(since.covariance) == pytest.approx(since.stops * ARM.drift.stop_spread**2)


def test_warmth_shifts_and_spreads() -> None:
    warm = JointErrors.homed(ARM).warmed(ARM, 10.0, spread=2.0)
    assert warm.mean == pytest.approx(10 * ARM.drift.temperature)
    assert np.diag(warm.covariance)[0] > np.diag(JointErrors.homed(ARM).covariance)[0]


def test_a_look_without_spread_is_refused() -> None:
    with pytest.raises(MotionError, match="above 0"):
        JointErrors.homed(ARM).seen(ARM, GRASP, (0, 0, 0), 0.0)


TABLE = Transform.about_z(0.3, (20, -300, -66))
POINTS = [
    (x, y, 90.0 + up) for x in (150.0, 220.0, 290.0) for y in (-120.0, 0.0, 120.0) for up in (0.0, 60.0)
]


def _true_arm() -> Arm:
    rng = np.random.default_rng(1)
    return ARM.with_links(
        tuple(
            Link(
                one.a + rng.normal(0, 0.7),
                one.alpha,
                one.d + rng.normal(0, 0.5),
                one.offset + rng.normal(0, 0.02),
            )
            for one in ARM.links
        )
    )


def _touched(noise: float = 0.2) -> tuple[Array, Array]:
    rng = np.random.default_rng(2)
    joints = np.array(
        [
            inverse(ARM, point, np.pi - least_tilt(ARM, point).tilt, rng.uniform(-1, 1)).joints
            for point in POINTS
        ]
    )
    truth = TABLE @ forward(_true_arm(), joints)[:, :3, 3]
    return joints, truth + rng.normal(0, noise, truth.shape)


def test_a_fit_makes_the_arm_true_where_it_was_not_measured() -> None:
    joints, points = _touched()
    fit = fit_arm(ARM, joints, points)
    there = np.array([least_tilt(ARM, (x, y, 95)).joints for x in (130, 200, 310) for y in (-100, 50, 130)])
    truth = TABLE @ forward(_true_arm(), there)[:, :3, 3]
    before = np.linalg.norm(TABLE @ forward(ARM, there)[:, :3, 3] - truth, axis=1).max()
    after = np.linalg.norm(fit.table_from_robot @ forward(fit.arm, there)[:, :3, 3] - truth, axis=1).max()
    assert before > 4
    assert after < 0.6
    assert fit.rms < 0.5
    assert fit.residuals[fit.worst] == fit.residuals.max()


def test_what_points_cannot_tell_is_named_and_left() -> None:
    fit = fit_arm(ARM, *_touched())
    assert {"offset base", "offset roll", "d base"} <= set(fit.left)
    assert "base yaw" in fit.values
    assert fit.arm.links[0].offset == ARM.links[0].offset
    assert set(fit.left).isdisjoint(fit.values)


def test_seen_points_need_no_height() -> None:
    joints, points = _touched()
    points[:, 2] = np.nan
    fit = fit_arm(ARM, joints, points)
    assert "base z" in fit.left
    assert fit.rms < 0.5


@pytest.mark.parametrize(
    ("count", "told"), [(9, "9 points were measured; at least 10"), (0, "0 points were measured")]
)
def test_too_few_points(count: int, told: str) -> None:
    joints, points = _touched()
    with pytest.raises(CalibrationError, match=told):
        fit_arm(ARM, joints[:count], points[:count])


def test_points_on_a_line() -> None:
    joints, points = _touched()
    points[:, 1] = 2 * points[:, 0]
    with pytest.raises(CalibrationError, match="of one line"):
        fit_arm(ARM, joints, points)
    points[:9, 0] = np.nan
    with pytest.raises(CalibrationError, match="Only 9 points have both x and y"):
        fit_arm(ARM, joints, points)
    with pytest.raises(CalibrationError, match="do not go together"):
        fit_arm(ARM, joints[:12], points)
