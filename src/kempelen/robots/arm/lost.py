"""Steps lost since the last homing, found with the reference switches; and switches pressed at the start.

A controller takes whatever place its switch closes at for the reference: homing hides what was lost. So an
arm that has been homed drives to where its switches must just not close, and just close, before it homes
again; the difference, by bisection to the step, is what was lost.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.errors import AlarmError, RobotError
from kempelen.core.geometry import Array
from kempelen.motion.arm.synchrony import TimedPath
from kempelen.robots.arm.mechanics import ArmAxes
from kempelen.robots.grbl.codec import Axes
from kempelen.robots.grbl.connect import at_rest
from kempelen.robots.grbl.gate import Gate
from kempelen.robots.grbl.gcode import number
from kempelen.robots.grbl.running import carry_out
from kempelen.robots.grbl.session import Session

_WINDOW = 30.0  # degrees: more is not looked for
_STRIDE = 2.0  # degrees at a time while the edge is being looked for
_LEAVING = 5.0  # degrees at a time while a switch is being left
_LEAVING_SPEED = 600.0  # degrees/min


@dataclass(frozen=True)
class Lost:
    """What was found.

    Attributes:
        names: Of the joints.
        steps: Of each joint's motor; None for more than can be looked for.
        degrees: Of each joint.
    """

    names: tuple[str, ...]
    steps: tuple[int | None, ...]
    degrees: tuple[float, ...]

    @property
    def worst(self) -> int:
        """The joint whose motor has lost most."""
        sizes = [float("inf") if steps is None else abs(steps) for steps in self.steps]
        return int(np.argmax(sizes))

    def require(self, most: int) -> None:
        """Refuse more than ``most`` steps.

        Raises:
            AlarmError: which joint has lost how many.
        """
        worst = self.steps[self.worst]
        if worst is not None and abs(worst) <= most:
            return
        name, degrees = self.names[self.worst], abs(self.degrees[self.worst])
        told = f"more than {_WINDOW:g}°" if worst is None else f"{abs(worst)} steps ({degrees:.2f}°)"
        raise AlarmError(
            f"The {name} had lost {told} since the last homing, allowed {most} steps. The arm is homed and "
            "at rest.",
            hint="Free the joint, look after its belt and load; then check the pieces and go on.",
        )


async def measure(session: Session, mechanics: ArmAxes, gate: Gate) -> Lost:
    """Drive home and find where each switch closes.

    Raises:
        RobotError: as of any motion.
    """
    degrees = await _Finder(session, mechanics, gate).errors()
    motors = mechanics.motors
    known = np.nan_to_num(degrees, nan=_WINDOW)
    steps = np.rint(motors.gearing.motors(known) * motors.steps_per_degree).astype(int)
    told = tuple(None if np.isnan(a) else int(n) for a, n in zip(degrees, steps, strict=True))
    return Lost(motors.arm.joint_names, told, tuple(known.tolist()))


class _Finder:
    """Drives joints to and fro across their switches; all places are degrees beyond home, (n,)."""

    def __init__(self, session: Session, mechanics: ArmAxes, gate: Gate) -> None:
        self._session = session
        self._mechanics = mechanics
        self._motors = mechanics.motors
        self._gate = gate
        self._finest = 1.0 / mechanics.motors.steps_per_degree

    async def errors(self) -> Array:
        """(n,) degrees by which joints truly stand beyond where they are believed to; NaN for too many."""
        nominal = self._motors.backs_off
        await self._drive(self._mechanics.paths.home(self._joints()))
        inner, outer = nominal - _NEAR * self._finest, nominal + _NEAR * self._finest
        early, late = await self._pressed(inner), await self._pressed(outer)
        for joint in self._motors.order:
            if early[joint] or not late[joint]:
                stride = -_STRIDE if early[joint] else _STRIDE
                inner[joint], outer[joint] = await self._search(joint, inner, stride)
        while (np.nan_to_num(outer - inner) > _ENOUGH * self._finest).any():
            middle = 0.5 * (inner + outer)
            pressed = await self._pressed(np.nan_to_num(middle))
            inner, outer = np.where(pressed, inner, middle), np.where(pressed, middle, outer)
        await self._pressed(np.zeros_like(inner))
        found: Array = self._motors.towards * (nominal - outer)
        return found

    async def _search(self, joint: int, others: Array, stride: float) -> tuple[float, float]:
        """(open, pressed) places of one joint, a stride apart; NaN where there is no edge."""
        places = np.nan_to_num(others)
        start = float(places[joint])
        while abs(places[joint] - start) < _WINDOW:
            before = float(places[joint])
            places[joint] += stride
            pressed = (await self._pressed(places))[joint]
            if pressed == (stride > 0):
                return (before, float(places[joint])) if stride > 0 else (float(places[joint]), before)
        return float("nan"), float("nan")

    async def _pressed(self, places: Array) -> npt.NDArray[np.bool_]:
        """(n,) which switches are closed when all joints are there."""
        target = self._motors.arm.home + np.radians(places) * self._motors.towards
        await self._drive([self._mechanics.paths.turn_freely(self._joints(), target)])
        status = self._session.condition.status
        pins = status.pins if status is not None else ""
        return np.array([letter in pins for letter in self._motors.axes])

    def _position(self) -> Axes:
        position = self._session.condition.position
        if position is None:
            raise RobotError("The controller reports no position.", hint="Send $10=1.")
        return position

    def _joints(self) -> Array:
        return self._motors.joints(self._position())

    async def _drive(self, paths: Sequence[TimedPath]) -> None:
        program = self._mechanics.program(paths, self._position())
        await self._gate.wait()
        await carry_out(self._session, program, self._gate)


_NEAR = 4  # steps to both sides of where the edge must be: it is looked at there first
_ENOUGH = 1.01


async def leave_switch(session: Session, mechanics: ArmAxes, gate: Gate, joint: int) -> None:
    """Turn a joint whose switch is pressed away from it: homing finds a switch only from its open side.

    Raises:
        AlarmError: the switch stays pressed over the joint's whole range.
        RobotError: as of any motion.
    """
    motors, letter = mechanics.motors, mechanics.axes[joint]
    status = await session.link.ask(session.timing.answer)
    if letter not in status.pins:
        return
    if status.state == "Alarm":
        await session.link.request("$X")
    away = -float(motors.motor_towards[joint]) * _LEAVING
    for _ in range(int(float(motors.travel[joint]) / _LEAVING) + 1):
        await gate.wait()
        await session.link.request(f"$J=G21G91{letter}{number(away)}F{number(_LEAVING_SPEED)}")
        if letter not in (await at_rest(session.link, session.timing)).pins:
            return
    raise AlarmError(
        f"The switch of the {mechanics.axis_names[joint]} stays closed wherever the joint turns.",
        hint="Check the switch and its cable, then home again.",
    )
