"""The older arm's driver against the virtual latch bridge, joined in memory: the contract of every robot."""

from collections.abc import AsyncIterator

import pytest_asyncio

from kempelen.testing.arm_rigs import ArmRig
from kempelen.testing.contracts.robot import RobotContract


class TestLatchArmInMemory(RobotContract):
    tolerance = 0.6

    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[ArmRig]:
        async with ArmRig(bridge="latch") as rig:
            yield rig
