"""An arm of stepper motors under grblHAL or FluidNC: the driver."""

from collections.abc import Awaitable, Callable

from kempelen.core.errors import AlarmError
from kempelen.core.protocols import Options, Robot
from kempelen.core.table import Table, WorkSpace
from kempelen.kinematics import Arm, load_arm
from kempelen.motion.arm.motors import Motors
from kempelen.robots.arm import lost
from kempelen.robots.arm.latch.driver import LatchArm
from kempelen.robots.arm.mechanics import ArmAxes
from kempelen.robots.arm.options import read_options
from kempelen.robots.grbl import homing
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.robots.grbl.robot import GrblRobot
from kempelen.robots.grbl.session import Session
from kempelen.robots.grbl.timing import Timing
from kempelen.robots.transport import Transport, open_port


def driver(port: str, table: Table, options: Options) -> Robot:
    """The driver registered as ``arm``; does no I/O.

    Args:
        port: ``/dev/tty...``, a pseudo-terminal's path, or ``socket://host:port``.
        table: Its work space is the box that the tool point keeps to.
        options: See `ArmOptions`.

    Raises:
        ConfigError: an unknown option, a value out of range, or a wrong parameter file.
    """
    chosen = read_options(options)
    arm = load_arm(chosen.arm)
    if chosen.bridge == "latch":
        return LatchArm(
            lambda: open_port(port, baud=chosen.baud), arm, table.space, most_lost=chosen.most_lost_steps
        )
    return StepperArm(
        lambda: open_port(port, baud=chosen.baud),
        arm,
        table.space,
        wiring=chosen.wiring,
        apply_settings=chosen.apply_settings,
        most_lost=chosen.most_lost_steps,
    )


class StepperArm(GrblRobot):
    """Implements `kempelen.core.protocols.Robot`; takes paths of joint angles as well as of the tool point.

    Args:
        connect: Opens the port; called on entering and on recovering from a lost line.
        arm: By its parameter file.
        space: The box that the tool point keeps to, robot frame.
        wiring: Of the gripper.
        timing: Patience.
        apply_settings: Send settings that do not fit instead of refusing them.
        most_lost: Steps that a motor may be found to have lost when it is homed again.

    Attributes:
        lost: Steps that each motor was found to have lost at the last homing of many; None before.
    """

    def __init__(
        self,
        connect: Callable[[], Awaitable[Transport]],
        arm: Arm,
        space: WorkSpace,
        *,
        wiring: GripperWiring | None = None,
        timing: Timing | None = None,
        apply_settings: bool = False,
        most_lost: int = 40,
    ) -> None:
        self.arm = arm
        self.lost: lost.Lost | None = None
        self._axes = ArmAxes(Motors.of(arm), space)
        self._most_lost = most_lost
        super().__init__(connect, self._axes, wiring=wiring, timing=timing, apply_settings=apply_settings)

    async def _home(self, session: Session) -> None:
        """First look what was lost since the last homing, then seek the switches in order.

        Raises:
            AlarmError: a switch was not found (which joint's), or more steps were lost than are allowed; the
                arm is at rest, in the latter case at home.
        """
        found = None
        if self._condition.homed:
            found = await lost.measure(session, self._axes, self._gate)
        await homing.home(session, self._gate, self._seek)
        if found is not None:
            self.lost = found
            found.require(self._most_lost)

    async def _seek(self, session: Session) -> None:
        """Joint by joint, off the switch first where it is pressed: other joints turn this one along."""
        for joint in self._axes.motors.order:
            await self._gate.wait()
            await lost.leave_switch(session, self._axes, self._gate, joint)
            try:
                await homing.request(session, f"$H{self._axes.axes[joint]}")
            except AlarmError as error:
                name = self.arm.joint_names[joint]
                raise AlarmError(f"While homing the {name}: {error.message}", hint=error.hint) from error
