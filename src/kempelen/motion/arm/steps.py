"""From joint angles to whole motor steps and back.

An arm's motors do not turn its joints one to one: on the Lab-Volt 5150 the shoulder carries the elbow with
it, and the elbow the pitch. The coupling matrix says how: ``motor = coupling @ joints``.
Steps are whole; each target is rounded once, from its exact value, so that what is rounded off one segment is
made up for in the next and never adds up.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import MotionError
from kempelen.core.geometry import Array

Counts = npt.NDArray[np.int64]

_WORST_CONDITION = 1e6
"""Of the coupling: beyond it a joint could not be told from its motors' steps."""


@dataclass(frozen=True, eq=False)
class Gearing:
    """How n motors turn n joints.

    Attributes:
        coupling: (n, n) motor angles from joint angles.
        steps_per_rad: (n,) of each motor; negative when it is mounted the other way round.

    Raises:
        MotionError: the coupling has no inverse, the sizes do not fit, or a motor has no steps.
    """

    coupling: Array
    steps_per_rad: Array

    def __post_init__(self) -> None:
        count = len(self.steps_per_rad)
        wanted = (count, count)
        if self.coupling.shape != wanted:
            raise MotionError(
                f"The coupling matrix is {self.coupling.shape}, for {count} motors it must be {wanted}.",
                hint="Mend the arm's parameter file.",
            )
        condition = float(np.linalg.cond(self.coupling)) if np.isfinite(self.coupling).all() else np.nan
        if not condition < _WORST_CONDITION:
            raise MotionError(
                f"The coupling matrix cannot be inverted: its condition number is {condition:.3g}, at most "
                f"{_WORST_CONDITION:.0e} is allowed.",
                hint="Mend 'motor_from_joint' in the arm's parameter file.",
            )
        if not (np.isfinite(self.steps_per_rad).all() and self.steps_per_rad.all()):
            raise MotionError(
                f"Steps per rad must be finite and other than 0: {self.steps_per_rad.tolist()}.",
                hint="Mend the arm's parameter file.",
            )

    def motors(self, joints: npt.ArrayLike) -> Array:
        """Motor angles (..., n) rad of joint angles (..., n) rad; also for speeds."""
        return np.asarray(joints, dtype=np.float64) @ self.coupling.T

    def joints(self, motors: npt.ArrayLike) -> Array:
        """Joint angles (..., n) rad of motor angles (..., n) rad; also for speeds."""
        angles = np.asarray(motors, dtype=np.float64)
        flat = angles.reshape(-1, angles.shape[-1])
        solved: Array = np.linalg.solve(self.coupling, flat.T).T.reshape(angles.shape).astype(np.float64)
        return solved

    def steps(self, joints: npt.ArrayLike) -> Counts:
        """Whole motor positions (..., n), in steps from joint zero, nearest to joint angles (..., n) rad."""
        return np.rint(self.motors(joints) * self.steps_per_rad).astype(np.int64)

    def angles(self, steps: npt.ArrayLike) -> Array:
        """Joint angles (..., n) rad at motor positions (..., n), in steps: where the arm then is."""
        return self.joints(np.asarray(steps, dtype=np.float64) / self.steps_per_rad)

    def increments(self, at: npt.ArrayLike, joints: npt.ArrayLike) -> Counts:
        """Whole steps (k, n) of each segment of a path, the remainders carried on.

        Args:
            at: (n,) motor positions now, in steps.
            joints: (k, n) rad, the ends of the segments.

        Returns:
            Whose sums up to any segment are never more than half a step off the exact position.
        """
        targets = self.steps(joints)
        now = np.asarray(at, dtype=np.int64)[None, :]
        return targets - np.concatenate((now, targets[:-1]))

    def resolution(self) -> Array:
        """(n,) how far whole steps may leave a joint off, rad: half a step of every motor it hangs on."""
        off: Array = np.abs(np.linalg.inv(self.coupling)) @ (0.5 / np.abs(self.steps_per_rad))
        return off
