"""The gantry's driver against the virtual controller, joined in memory: the contract, and GRBL's own."""

from collections.abc import AsyncIterator

import pytest_asyncio

from kempelen.core.protocols import Robot
from kempelen.core.table import WorkSpace
from kempelen.robots.grbl.gantry import GrblGantry
from kempelen.robots.grbl.timing import Timing
from kempelen.testing.contracts.robot import RobotContract
from kempelen.testing.transports import Coupling
from kempelen.twin.grbl import Machine, VirtualGrbl

SPACE = WorkSpace()
TIMING = Timing(quiet=0.05, poll=0.002, watch=0.01, idle_watch=0.05)


class MemoryRig:
    """A virtual controller with its machine, joined to drivers in memory."""

    def __init__(self) -> None:
        dx, dy, dz = SPACE.robot_from_machine
        self.controller = VirtualGrbl(Machine(SPACE.travel, (250.0 - dx, 200.0 - dy, 150.0 - dz)))
        self.coupling = Coupling(self.controller)

    def robot(self) -> Robot:
        return GrblGantry(self.coupling.connect, SPACE, timing=TIMING)

    def position(self) -> tuple[float, float, float]:
        (x, y, z), (dx, dy, dz) = self.controller.position_mm, SPACE.robot_from_machine
        return (x + dx, y + dy, z + dz)

    def gripper_closed(self) -> bool:
        return not self.controller.flood_on

    def unplug(self) -> None:
        self.coupling.unplug()


class TestGantryInMemory(RobotContract):
    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[MemoryRig]:
        rig = MemoryRig()
        async with rig.coupling:
            yield rig
