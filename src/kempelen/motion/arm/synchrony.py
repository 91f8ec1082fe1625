"""Point to point, all joints together: they start and arrive at the same time, each within its limits.

Every joint goes its own way in proportion to one common share from 0 to 1, so that the path is a straight
line in joint space, whatever the limits; the joint with most to do is at its limit. Source: the Lab-Volt
paper's joint synchronisation.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import ruckig

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array
from kempelen.kinematics.arm import Arm
from kempelen.motion.profile import Profile

TICK = 0.02
"""Of the times at which a path is passed on, s."""
_STILL = 1e-9  # rad


@dataclass(frozen=True, slots=True, eq=False)
class TimedPath:
    """A polyline in joint space with its times, from rest to rest.

    Attributes:
        joints: (n, k) rad.
        times: (n,) s, from 0.
    """

    joints: Array
    times: Array

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return float(self.times[-1])


def synchronise(
    arm: Arm, start: npt.ArrayLike, end: npt.ArrayLike, *, jerk_limited: bool = True, tick: float = TICK
) -> TimedPath:
    """From rest at ``start`` to rest at ``end``, both (k,) rad, all joints together.

    Args:
        arm: Whose limits.
        start: Joint angles.
        end: Joint angles.
        jerk_limited: By ruckig; else trapezoids of speed, closed form.
        tick: Distance of the path's times, s.

    Raises:
        MotionError: a joint would leave its range.
    """
    first, last = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    require_ranges(arm, np.stack((first, last)), "Turning the joints together")
    if np.abs(last - first).max() < _STILL:
        return TimedPath(np.stack((first, last)), np.array([0.0, tick]))
    return _jerk_limited(arm, first, last, tick) if jerk_limited else _trapezoid(arm, first, last, tick)


def least_seconds(arm: Arm, start: Array, end: Array) -> float:
    """No motion from rest at ``start`` (k,) to rest at ``end`` (k,) is faster, s.

    Each joint alone needs at least its trapezoid, whatever way the others go.
    """
    travels = np.abs(end - start).tolist()
    limits = zip(travels, arm.velocity.tolist(), arm.acceleration.tolist(), strict=True)
    return max(Profile.over(*one).seconds for one in limits)


def require_ranges(arm: Arm, joints: Array, title: str) -> None:
    """Refuse joint angles (n, k) outside of the ranges.

    Raises:
        MotionError: which joint, where on the way, by how much.
    """
    excess = np.maximum(arm.ranges[:, 0] - joints, joints - arm.ranges[:, 1])
    row, joint = np.unravel_index(int(excess.argmax()), excess.shape)
    by = float(np.degrees(excess[row, joint]))
    if by <= _TOLERANCE:
        return
    low, high = np.degrees(arm.ranges[joint])
    share = 100.0 * row / max(len(joints) - 1, 1)
    raise MotionError(
        f"{title}: {share:.0f} % of the way the {arm.joint_names[joint]} would have to turn to "
        f"{np.degrees(joints[row, joint]):.1f}°, {by:.1f}° beyond its range of {low:.0f}° to {high:.0f}°. "
        "Nothing was sent.",
        hint="Move the board or the tray within the arm's reach: kempelen doctor tells which places it has.",
    )


_TOLERANCE = 1e-6  # degrees


def _trapezoid(arm: Arm, start: Array, end: Array, tick: float) -> TimedPath:
    travel = end - start
    moving = np.abs(travel) > _STILL
    far = np.abs(travel[moving])
    profile = Profile.over(
        1.0, float((arm.velocity[moving] / far).min()), float((arm.acceleration[moving] / far).min())
    )
    times = _ticks(profile.seconds, tick)
    return TimedPath(start + np.outer(_shares(profile, times), travel), times)


def _shares(profile: Profile, times: Array) -> Array:
    """(n,) of the distance that a profile has covered at times (n,)."""
    left = profile.seconds - times
    ramp, rate = profile.ramp, profile.acceleration
    cruise = 0.5 * rate * ramp * ramp + profile.speed * (times - ramp)
    out: Array = np.where(times < ramp, 0.5 * rate * times * times, cruise)
    return np.where(left < ramp, profile.distance - 0.5 * rate * left * left, out)


def _jerk_limited(arm: Arm, start: Array, end: Array, tick: float) -> TimedPath:
    # Only ever two points: with points between them ruckig would ask a service on the internet.
    wanted = ruckig.InputParameter(arm.n)
    wanted.current_position, wanted.target_position = start.tolist(), end.tolist()
    wanted.max_velocity = arm.velocity.tolist()
    wanted.max_acceleration = arm.acceleration.tolist()
    wanted.max_jerk = arm.jerk.tolist()
    wanted.synchronization = ruckig.Synchronization.Phase
    trajectory = ruckig.Trajectory(arm.n)
    result = ruckig.Ruckig(arm.n).calculate(wanted, trajectory)
    if result not in {ruckig.Result.Working, ruckig.Result.Finished}:
        raise MotionError(
            f"Turning the joints together: ruckig found no motion ({result}).",
            hint="Check velocity, acceleration and jerk in the arm's parameter file.",
        )
    times = _ticks(trajectory.duration, tick)
    joints = np.array([trajectory.at_time(time)[0] for time in times.tolist()])
    joints[0], joints[-1] = start, end
    return TimedPath(joints, times)


def _ticks(seconds: float, tick: float) -> Array:
    return np.linspace(0.0, seconds, max(int(np.ceil(seconds / tick)), 1) + 1)
