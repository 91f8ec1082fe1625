"""The arm on the virtual multi-axis controller, joined in memory: the contract of every robot."""

from collections.abc import AsyncIterator

import pytest_asyncio

from kempelen.testing.arm_rigs import ArmRig
from kempelen.testing.contracts.robot import RobotContract


class TestArmInMemory(RobotContract):
    tolerance = 0.6

    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[ArmRig]:
        async with ArmRig() as rig:
            yield rig
