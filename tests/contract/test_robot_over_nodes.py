"""A robot at a node, led over links in one process: the contract of every robot."""

import random
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack
from typing import Self

import pytest_asyncio

from kempelen.nodes.local_link import LocalNet, Weather
from kempelen.nodes.remote_robot import RemoteRobot
from kempelen.nodes.robot_node import RobotNode
from kempelen.testing.contracts.robot import RobotContract
from kempelen.testing.rigs import MemoryRig


class Led(RemoteRobot):
    """A remote robot that brings its node along."""

    def __init__(self, rig: "NodeRig") -> None:
        self._rig = rig
        self._stack = AsyncExitStack()
        self._net = LocalNet(rig.weather)
        super().__init__(self._net.join(), "here")

    async def __aenter__(self) -> Self:
        link = await self._stack.enter_async_context(self._net.join())
        robot = await self._stack.enter_async_context(self._rig.machine.robot())
        await self._stack.enter_async_context(RobotNode(robot, link, "here"))
        await self._stack.enter_async_context(self._link)
        return await super().__aenter__()

    async def __aexit__(self, *exc: object) -> None:
        await super().__aexit__(*exc)
        await self._stack.aclose()


class NodeRig:
    """A machine beside a node."""

    def __init__(self, machine: MemoryRig, weather: Weather) -> None:
        self.machine = machine
        self.weather = weather

    def robot(self) -> Led:
        return Led(self)

    def position(self) -> tuple[float, float, float]:
        return self.machine.position()

    def gripper_closed(self) -> bool:
        return self.machine.gripper_closed()

    def unplug(self) -> None:
        self.machine.unplug()


class TestRobotOverANode(RobotContract):
    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[NodeRig]:
        async with MemoryRig() as machine:
            yield NodeRig(machine, Weather())


class TestRobotWhereEverythingArrivesTwice(RobotContract):
    """Nothing is done a second time for that."""

    @pytest_asyncio.fixture
    async def rig(self) -> AsyncIterator[NodeRig]:
        async with MemoryRig() as machine:
            yield NodeRig(machine, Weather(random.Random(5), twice=1.0))
