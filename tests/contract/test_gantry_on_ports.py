"""The contract of every robot once more, through the operating system's own ports."""

from collections.abc import AsyncIterator

import pytest_asyncio

from kempelen.testing.contracts.robot import RobotContract
from kempelen.testing.rigs import PortRig


class TestGantryOnAPseudoTerminal(RobotContract):
    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[PortRig]:
        async with PortRig("pty") as rig:
            yield rig


class TestGantryOnASocket(RobotContract):
    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[PortRig]:
        async with PortRig("tcp:0") as rig:
            yield rig
