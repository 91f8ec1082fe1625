"""The gantry's driver against the virtual controller, joined in memory: the contract of every robot."""

from collections.abc import AsyncIterator

import pytest_asyncio

from kempelen.testing.contracts.robot import RobotContract
from kempelen.testing.rigs import MemoryRig


class TestGantryInMemory(RobotContract):
    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[MemoryRig]:
        async with MemoryRig() as rig:
            yield rig
