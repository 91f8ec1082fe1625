"""Steps lost since the last homing, found with the reference switches; and switches pressed at the start.

A controller takes whatever place its switch closes at for the reference: homing hides what was lost. So an
arm that has been homed drives to where its switches must just not close, and just close, before it homes
again; the difference, by bisection to the step, is what was lost.
"""

from dataclasses import dataclass

import numpy as np

from kempelen.core.errors import AlarmError, RobotError
from kempelen.core.geometry import Array
from kempelen.robots.arm.mechanics import ArmAxes
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
    """Drive home joint by joint and find where each switch closes.

    Raises:
        RobotError: as of any motion.
    """
    finder = _Finder(session, mechanics, gate)
    degrees = [0.0] * mechanics.motors.arm.n
    for joint in mechanics.motors.order:
        degrees[joint] = await finder.error(joint)
    motors = mechanics.motors
    known = np.nan_to_num(np.array(degrees), nan=_WINDOW)
    steps = np.rint(motors.gearing.motors(known) * motors.steps_per_degree).astype(int)
    told = tuple(None if np.isnan(a) else int(n) for a, n in zip(degrees, steps, strict=True))
    return Lost(motors.arm.joint_names, told, tuple(known.tolist()))


class _Finder:
    """Drives joints to and fro across their switches."""

    def __init__(self, session: Session, mechanics: ArmAxes, gate: Gate) -> None:
        self._session = session
        self._mechanics = mechanics
        self._motors = mechanics.motors
        self._gate = gate

    async def error(self, joint: int) -> float:
        """Degrees by which a joint truly stands beyond where it is believed to; NaN for too many."""
        nominal = float(self._motors.backs_off[joint])
        finest = 1.0 / float(self._motors.steps_per_degree[joint])
        inner, outer = nominal - _NEAR * finest, nominal + _NEAR * finest
        if await self._pressed(joint, inner):
            inner, outer = await self._search(joint, inner, -_STRIDE)
        elif not await self._pressed(joint, outer):
            inner, outer = await self._search(joint, outer, _STRIDE)
        while outer - inner > finest * _ENOUGH:
            middle = 0.5 * (inner + outer)
            if await self._pressed(joint, middle):
                outer = middle
            else:
                inner = middle
        await self._go(joint, 0.0)
        return float(self._motors.towards[joint]) * (nominal - outer)

    async def _search(self, joint: int, start: float, stride: float) -> tuple[float, float]:
        """(open, pressed) degrees beyond home, a stride apart; NaN where there is no edge."""
        at = start
        while abs(at - start) < _WINDOW:
            at += stride
            if await self._pressed(joint, at) == (stride > 0):
                return (at - stride, at) if stride > 0 else (at, at - stride)
        return float("nan"), float("nan")

    async def _pressed(self, joint: int, beyond: float) -> bool:
        """Whether a joint's switch is closed when the joint is ``beyond`` degrees beyond home."""
        await self._go(joint, beyond)
        status = self._session.condition.status
        return status is not None and self._motors.axes[joint] in status.pins

    async def _go(self, joint: int, beyond: float) -> None:
        position = self._session.condition.position
        if position is None:
            raise RobotError("The controller reports no position.", hint="Send $10=1.")
        joints: Array = self._motors.joints(position)
        target = joints.copy()
        turn = np.radians(beyond) * self._motors.towards[joint]
        target[joint] = self._motors.arm.home[joint] + turn
        path = self._mechanics.paths.turn_freely(joints, target)
        await self._gate.wait()
        await carry_out(self._session, self._mechanics.program([path], position), self._gate)


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
