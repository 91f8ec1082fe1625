"""A whole arm in this process: a virtual controller with its motors and joints, and drivers for it."""

import asyncio
from collections.abc import Sequence
from typing import Self

from kempelen.core.table import WorkSpace
from kempelen.kinematics import Arm, forward, load_arm
from kempelen.robots.arm.driver import StepperArm
from kempelen.robots.arm.latch.driver import LatchArm
from kempelen.robots.grbl.timing import Timing
from kempelen.robots.transport import Transport, open_port
from kempelen.testing.rigs import FAST
from kempelen.testing.transports import Coupling
from kempelen.twin.grbl import GRBLHAL, Dialect, VirtualArm
from kempelen.twin.latch import VirtualLatch
from kempelen.twin.wire import make_wire

ARM = load_arm("labvolt-5150")
# A box in front of the arm all of which it reaches, home in it.
SPACE = WorkSpace(
    lower=(170.0, -150.0, 90.0),
    upper=(340.0, 150.0, 345.0),
    velocity=(200.0, 200.0, 200.0),
    acceleration=(800.0, 800.0, 800.0),
)
STEP = 0.02
"""s of the controller's time for each turn of the loop."""


class ArmRig:
    """An arm that has just been switched on; use as an async context manager.

    Args:
        wire: ``"memory"``, ``"pty"`` or ``"tcp:0"``.
        bridge: ``"grblhal"`` or ``"latch"``.
        dialect: Of a virtual G-code controller.
        most_lost: Of the drivers.
        joints: True joint angles at power-up, rad.
    """

    arm: Arm = ARM

    def __init__(
        self,
        wire: str = "memory",
        *,
        bridge: str = "grblhal",
        dialect: Dialect = GRBLHAL,
        most_lost: int = 40,
        joints: Sequence[float] | None = None,
    ) -> None:
        self.latch = bridge == "latch"
        self.controller: VirtualArm | VirtualLatch = (
            VirtualLatch(ARM, joints) if self.latch else VirtualArm(ARM, joints, dialect=dialect)
        )
        self.coupling = Coupling(self.controller, step=STEP)
        self._most_lost = most_lost
        self._wire = None if wire == "memory" else make_wire(wire, "")
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        """Let its time run."""
        if self._wire is None:
            await self.coupling.__aenter__()
        else:
            self._task = asyncio.create_task(self._run(), name="controller's clock")
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Stop its time and give the port back."""
        if self._wire is None:
            await self.coupling.__aexit__(*exc)
            return
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])
        self._wire.close()

    async def connect(self) -> Transport:
        """Open the near end."""
        if self._wire is None:
            return await self.coupling.connect()
        return await open_port(self._wire.address)

    def robot(self, *, timing: Timing = FAST) -> StepperArm | LatchArm:
        """A new driver, not entered yet."""
        make = LatchArm if self.latch else StepperArm
        return make(self.connect, ARM, SPACE, timing=timing, most_lost=self._most_lost)

    def position(self) -> tuple[float, float, float]:
        """Where the tool point truly is, robot frame, mm."""
        x, y, z = forward(ARM, self.controller.joints)[:3, 3].tolist()
        return x, y, z

    def gripper_closed(self) -> bool:
        """What the outputs say: without current it is closed."""
        return self.controller.gripper_closed

    def unplug(self) -> None:
        """Pull the cable."""
        if self._wire is None:
            self.coupling.unplug()
        else:
            self._wire.drop()

    async def _run(self) -> None:
        controller, wire = self.controller, self._wire
        while wire is not None:
            if data := wire.read():
                controller.receive(data)
            if wire.opened():
                controller.reset_by_dtr()
            resting = controller.idle()
            controller.advance(STEP)
            if output := controller.take_output():
                wire.write(output)
            await asyncio.sleep(0.001 if resting else 0)
