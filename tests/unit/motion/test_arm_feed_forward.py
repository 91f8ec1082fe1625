"""Motors that run ahead of joints on belts that give, against the physics of MuJoCo."""

import numpy as np
import pytest
from tests.unit.motion.arm_cases import ARM

from kempelen.bench.tracking import DAMPED, HERTZ
from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.kinematics import Arm, Mass, forward
from kempelen.kinematics.dynamics import torques
from kempelen.motion.arm.feed_forward import Belts, run_ahead, smooth
from kempelen.motion.arm.synchrony import TimedPath, synchronise
from kempelen.twin.physics.compliant import STEP, FreeArm

PATH = synchronise(ARM, ARM.home, ARM.home + np.radians([40, -30, 15, 10, 30]))
BELTS = Belts.ringing_at(ARM, HERTZ, DAMPED)


def error(told: TimedPath, load: Mass | None = None) -> float:
    """Rms of the tool point's distance from the wanted path, mm."""
    motors, wanted = smooth(told), smooth(PATH)

    def belts(time: float, joints: Array, speeds: Array) -> Array:
        at = min(time, told.seconds)
        return np.asarray(
            BELTS.stiffness * (motors(at) - joints) + BELTS.damping * (motors(at, 1) - speeds),
            dtype=np.float64,
        )

    followed = FreeArm(ARM, load).follow(PATH.joints[0], belts, PATH.seconds)
    times = np.minimum(np.arange(len(followed)) * STEP, PATH.seconds)
    off = forward(ARM, followed)[:, :3, 3] - forward(ARM, wanted(times))[:, :3, 3]
    return float(np.sqrt((off * off).sum(axis=1).mean()))


def test_with_feed_forward_the_arm_is_where_it_should_be() -> None:
    plain, weight, ahead = (
        error(told) for told in (PATH, run_ahead(ARM, PATH, BELTS, moving=False), run_ahead(ARM, PATH, BELTS))
    )
    assert plain > 3
    assert ahead < 0.02 * plain
    assert ahead < 0.3 * weight


def test_a_load_that_is_known_is_carried_as_exactly() -> None:
    king = Mass(0.2, np.array([0.0, 0.0, 10.0]), np.eye(3) * 20)
    known, unknown = (error(run_ahead(ARM, PATH, BELTS, load=load), king) for load in (king, None))
    assert known < 0.2 * unknown


def test_at_rest_motors_are_ahead_by_what_weight_stretches() -> None:
    ahead = run_ahead(ARM, PATH, BELTS)
    stretch = torques(ARM, PATH.joints[-1]) / BELTS.stiffness
    assert ahead.joints[-1] - PATH.joints[-1] == pytest.approx(stretch, abs=3e-4)
    assert (ahead.times == PATH.times).all()


def test_torques_of_the_equations_hold_the_physics_arm_still() -> None:
    """MuJoCo as the oracle of the recursive Newton-Euler equations."""
    hold = torques(ARM, ARM.home)
    followed = FreeArm(ARM).follow(ARM.home, lambda *_: hold, 0.1)
    assert np.abs(followed - ARM.home).max() < 1e-6


def test_without_masses_nothing_is_known() -> None:
    light = Arm(**{name: getattr(ARM, name) for name in Arm.__slots__} | {"masses": ()})
    with pytest.raises(MotionError, match="no masses"):
        run_ahead(light, PATH, BELTS)
