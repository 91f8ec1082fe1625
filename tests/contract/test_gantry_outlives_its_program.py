"""SIGKILL while the robot moves: the board runs on and keeps its outputs and its memory."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from kempelen.core.errors import LinkError
from kempelen.core.protocols import GripperState
from kempelen.robots.transport import open_port
from kempelen.testing.contracts.robot import apart
from kempelen.testing.twin_rig import TwinRig

PROGRAM = """
import asyncio, sys
import numpy as np
from kempelen.core.protocols import Follow, SetGripper
from kempelen.core.table import Table
from kempelen.robots.grbl.gantry import driver

async def main(port, closed):
    async with driver(port, Table(), {}) as robot:
        await robot.home()
        await robot.run([SetGripper(closed=closed, seconds=0.1)])
        here = np.array(robot.state.reported_position)
        print("moving", flush=True)
        stops = [here + step for step in ([0, 0, 0], [40, 0, 0], [0, 20, 0], [40, 0, -20], [0, 0, 0])]
        await robot.run([Follow(np.array(stops), 0.0)] * 1000)

asyncio.run(main(sys.argv[1], sys.argv[2] == "closed"))
"""


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TwinRig]:
    rig = TwinRig(tmp_path_factory.mktemp("twin"), speed=5.0)
    yield rig
    rig.close()


@pytest.mark.physics
@pytest.mark.parametrize("state", [GripperState.OPEN, GripperState.CLOSED])
async def test_killed_while_moving(twin: TwinRig, tmp_path: Path, state: GripperState) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    with subprocess.Popen(  # noqa: ASYNC220 - it is there at once, and dies by our hand
        [sys.executable, str(tmp_path / "program.py"), twin.address, state.value], stdout=subprocess.PIPE
    ) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == b"moving\n"
        with pytest.raises(LinkError, match="already in use"):
            await open_port(twin.address)
        program.send_signal(signal.SIGKILL)
    async with twin.robot() as robot:
        assert robot.state.memory_kept
        assert robot.state.gripper is state
        assert not robot.state.homed
        assert twin.gripper_closed() == (state is GripperState.CLOSED)
        await robot.home()
        assert robot.state.reported_position is not None
        assert apart(twin.position(), robot.state.reported_position) <= 0.3
