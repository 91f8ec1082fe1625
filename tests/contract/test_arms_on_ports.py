"""The contract of every robot once more for arms, through the operating system's own ports."""

from collections.abc import AsyncIterator

import pytest
import pytest_asyncio

from kempelen.testing.arm_rigs import ArmRig
from kempelen.testing.contracts.robot import RobotContract


class TestArmOnAPseudoTerminal(RobotContract):
    tolerance = 0.6

    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[ArmRig]:
        async with ArmRig("pty") as rig:
            yield rig


class TestLatchArmOnASocket(RobotContract):
    tolerance = 0.6

    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[ArmRig]:
        async with ArmRig("tcp:0", bridge="latch") as rig:
            yield rig


@pytest.mark.soak
class TestArmOnASocket(RobotContract):
    tolerance = 0.6

    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[ArmRig]:
        async with ArmRig("tcp:0") as rig:
            yield rig


@pytest.mark.soak
class TestLatchArmOnAPseudoTerminal(RobotContract):
    tolerance = 0.6

    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[ArmRig]:
        async with ArmRig("pty", bridge="latch") as rig:
            yield rig
