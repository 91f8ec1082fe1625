"""The older arm behind the latch bridge: the driver."""

from collections.abc import Awaitable, Callable

from kempelen.core.errors import AlarmError, LinkError
from kempelen.core.protocols import GripperState
from kempelen.core.table import WorkSpace
from kempelen.kinematics import Arm
from kempelen.motion.arm.motors import Motors
from kempelen.robots.arm.latch.codec import VERSION, Numbered
from kempelen.robots.arm.latch.mechanics import WIRING, LatchAxes
from kempelen.robots.arm.lost import Lost
from kempelen.robots.grbl import homing
from kempelen.robots.grbl.codec import BuildInfo
from kempelen.robots.grbl.connect import Greeting, calm, restarted, synchronise
from kempelen.robots.grbl.family import Family
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.robots.grbl.link import Link
from kempelen.robots.grbl.mechanics import Mechanics
from kempelen.robots.grbl.robot import GrblRobot
from kempelen.robots.grbl.running import carry_out
from kempelen.robots.grbl.session import Session
from kempelen.robots.grbl.stream import WINDOW
from kempelen.robots.grbl.timing import Timing
from kempelen.robots.transport import Transport


class LatchArm(GrblRobot):
    """Implements `kempelen.core.protocols.Robot`; takes paths of joint angles as well as of the tool point.

    Args:
        connect: Opens the port; called on entering and on recovering from a lost line.
        arm: By its parameter file.
        space: The box that the tool point keeps to, robot frame.
        timing: Patience.
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
        timing: Timing | None = None,
        most_lost: int = 40,
    ) -> None:
        self.arm = arm
        self.lost: Lost | None = None
        self._axes = LatchAxes(Motors.of(arm), space)
        self._most_lost = most_lost
        self._closed_at: dict[int, int] = {}
        super().__init__(connect, self._axes, wiring=WIRING, timing=timing, family=LATCH)

    async def _home(self, session: Session) -> None:
        """Joint by joint; the bridge tells at which count each switch closed.

        An arm that knows where it is drives home first: turned alone, a joint drags others into their stops.

        Raises:
            AlarmError: a switch was not found (which joint's), or more steps were lost than are allowed; the
                arm is at rest, in the latter case at home.
        """
        counted, position = self._condition.homed, self._condition.position
        if counted and position is not None:
            way = self._axes.paths.home(self._axes.joints(position))
            await self._gate.wait()
            await carry_out(session, self._axes.program(way, position), self._gate)
        await homing.home(session, self._gate, self._seek)
        if counted:
            self.lost = self._found()
            self.lost.require(self._most_lost)

    async def _seek(self, session: Session) -> None:
        self._closed_at.clear()
        for joint in self._axes.motors.order:
            await self._gate.wait()
            try:
                replies = await homing.request(session, self._axes.homing(joint))
            except AlarmError as error:
                name = self.arm.joint_names[joint]
                raise AlarmError(f"While homing the {name}: {error.message}", hint=error.hint) from error
            told = [reply.text for reply in replies if isinstance(reply, BuildInfo) and reply.key == "HOM"]
            self._closed_at[joint] = int(told[-1]) if told else self._axes.switch_count(joint)

    def _found(self) -> Lost:
        joints = range(self.arm.n)
        steps = tuple(self._axes.switch_count(joint) - self._closed_at[joint] for joint in joints)
        degrees = self._axes.motors.steps_per_degree
        return Lost(
            self.arm.joint_names, steps, tuple(steps[joint] / float(degrees[joint]) for joint in joints)
        )


async def greet(
    link: Link, mechanics: Mechanics, wiring: GripperWiring, timing: Timing, *, apply_settings: bool
) -> Greeting:
    """Find out everything about the bridge at the other end.

    Args:
        link: Started.
        mechanics: How many motors there must be.
        wiring: Of the gripper.
        timing: Patience.
        apply_settings: There are none.

    Raises:
        LinkError: nobody answers, somebody else, or a bridge of another version or for another arm.
    """
    del apply_settings
    at_work = reopen = False
    if not await restarted(link, timing):
        at_work, reopen = await calm(link, wiring, timing)
    await synchronise(link, timing)
    info = {event.key: event.text for event in await link.request("I") if isinstance(event, BuildInfo)}
    _check(info, mechanics, link.transport.name)
    link.framing.expect_axes(len(mechanics.axes))
    status = await link.ask(timing.answer)
    opened = wiring.open_letter in (status.accessories or "")
    zero = (0.0,) * len(mechanics.axes)
    return Greeting(
        memory_kept=at_work or (_remembers(link) and not link.banners),
        gripper=GripperState.OPEN if opened else GripperState.CLOSED,
        reopen=reopen,
        settings={},
        offsets={"G54": zero, "G92": zero},
        work_offset=zero,
        window=WINDOW,
    )


def _remembers(link: Link) -> bool:
    return isinstance(link.framing, Numbered) and link.framing.memory_kept


def _check(info: dict[str, str], mechanics: Mechanics, where: str) -> None:
    version, motors = info.get("VER", ""), info.get("AXS", "")
    if version != str(VERSION):
        raise LinkError(
            f"{where}: the bridge speaks version {version or 'unknown'} of its protocol, not {VERSION}.",
            hint="Flash firmware/latch-bridge to it.",
        )
    if motors != str(len(mechanics.axes)):
        raise LinkError(
            f"{where}: the bridge drives {motors or 'unknown'} motors, the arm has {len(mechanics.axes)}.",
            hint="Build it for this arm: MOTORS in firmware/latch-bridge.",
        )


LATCH = Family(Numbered, greet)
