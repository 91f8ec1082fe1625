"""A whole gantry in this process: the virtual controller with its machine, and drivers for it."""

import asyncio
from typing import Self

from kempelen.core.table import WorkSpace
from kempelen.robots.grbl.gantry import GrblGantry
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.robots.grbl.timing import Timing
from kempelen.robots.transport import open_port
from kempelen.testing.transports import Coupling
from kempelen.twin.grbl import Machine, VirtualGrbl
from kempelen.twin.wire import make_wire

# The controller's time runs some hundred times faster than the wall here; silences are as short.
FAST = Timing(banner=1.0, quiet=0.05, answer=1.0, poll=0.002, watch=0.01, idle_watch=0.05, lost_ok=0.2)


class MemoryRig:
    """A gantry that has just been switched on, its carriage somewhere; use as an async context manager.

    Args:
        space: What it reaches.
        controller: The virtual controller; None for a fitting one.
    """

    def __init__(self, space: WorkSpace | None = None, controller: VirtualGrbl | None = None) -> None:
        self.space = space or WorkSpace()
        self.controller = controller or self._controller()
        self.coupling = Coupling(self.controller)

    def _controller(self) -> VirtualGrbl:
        dx, dy, dz = self.space.robot_from_machine
        return VirtualGrbl(Machine(self.space.travel, (250.0 - dx, 200.0 - dy, 150.0 - dz)))

    async def __aenter__(self) -> Self:
        """Let its time run."""
        await self.coupling.__aenter__()
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Stop its time."""
        await self.coupling.__aexit__(*exc)

    def robot(
        self,
        *,
        timing: Timing = FAST,
        wiring: GripperWiring | None = None,
        apply_settings: bool = False,
    ) -> GrblGantry:
        """A new driver, not entered yet."""
        return GrblGantry(
            self.coupling.connect, self.space, timing=timing, wiring=wiring, apply_settings=apply_settings
        )

    def position(self) -> tuple[float, float, float]:
        """Where the tool point truly is, robot frame, mm."""
        (x, y, z), (dx, dy, dz) = self.controller.position_mm, self.space.robot_from_machine
        return (x + dx, y + dy, z + dz)

    def gripper_closed(self) -> bool:
        """What the outputs say: without current it is closed."""
        return not self.controller.flood_on

    def unplug(self) -> None:
        """Pull the cable."""
        self.coupling.unplug()


class PortRig(MemoryRig):
    """The same gantry at the end of a real port: a pseudo-terminal or a TCP server.

    Args:
        wire: ``"pty"`` or ``"tcp:0"``.
        step: s of the controller's time for each turn of the loop.
    """

    def __init__(self, wire: str = "pty", *, step: float = 0.005) -> None:
        super().__init__()
        self.wire = make_wire(wire, "")
        self._step = step
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        """Let its time run."""
        self._task = asyncio.create_task(self._run(), name="controller's clock")
        return self

    async def __aexit__(self, *_exc: object) -> None:
        """Stop its time and give the port back."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])
        self.wire.close()

    def robot(
        self,
        *,
        timing: Timing = FAST,
        wiring: GripperWiring | None = None,
        apply_settings: bool = False,
    ) -> GrblGantry:
        """A new driver, not entered yet."""
        return GrblGantry(
            lambda: open_port(self.wire.address),
            self.space,
            timing=timing,
            wiring=wiring,
            apply_settings=apply_settings,
        )

    def unplug(self) -> None:
        """Pull the cable."""
        self.wire.drop()

    async def _run(self) -> None:
        controller = self.controller
        while True:
            if data := self.wire.read():
                controller.receive(data)
            if self.wire.opened():
                controller.reset_by_dtr()
            resting = controller.idle()
            controller.advance(self._step)
            if output := controller.take_output():
                self.wire.write(output)
            await asyncio.sleep(0.001 if resting else 0)
