"""A light robot's node as a process of its own, until its input ends; in keys, over any endpoint.

``python -m kempelen.testing.node_process '{"listen": [...], "keys": "...", "table": "one", "pace": 10}'``
prints a line when it is there; for each line of input one of what became of the table, as JSON. A number in
the line is the robot's pace from now on.
"""

import asyncio
import json
import sys
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import chess

from kempelen.core.table import Table, start_layout
from kempelen.nodes.robot_node import Patience, RobotNode
from kempelen.nodes.zenoh_link import Network, ZenohLink
from kempelen.twin.light import LightRobot, LightTable


def _line() -> bytes:
    return sys.stdin.buffer.readline()


async def _main(wanted: dict[str, Any]) -> None:
    table = Table()
    world = LightTable(table, start_layout(table, chess.Board(wanted.get("fen", chess.STARTING_FEN))))
    keys = Path(wanted["keys"]) if wanted.get("keys") else None
    network = Network(
        listen=tuple(wanted.get("listen", ())), connect=tuple(wanted.get("connect", ())), discover=False,
        keys=keys,
    )  # fmt: skip
    async with AsyncExitStack() as stack:
        link = await stack.enter_async_context(ZenohLink(network))
        robot = await stack.enter_async_context(LightRobot(table, world, pace=wanted.get("pace", 10.0)))
        patience = Patience(**wanted.get("patience", {}))
        await stack.enter_async_context(RobotNode(robot, link, wanted.get("table", "one"), patience=patience))
        print("here", flush=True)  # noqa: T201 - this is what the other process waits for
        loop = asyncio.get_running_loop()
        while line := await loop.run_in_executor(None, _line):
            if pace := line.strip():
                robot.pace = float(pace)
            print(json.dumps(told_of(world, robot)), flush=True)  # noqa: T201 - as above


def told_of(world: LightTable, robot: LightRobot) -> dict[str, Any]:
    """What became of its table, as JSON can say it."""
    pieces = {str(place): piece.symbol() for place, piece in world.layout.items()}
    return {
        "pieces": pieces,
        "carried": world.carried,
        "faults": world.faults,
        "held": world.held.symbol() if world.held else "",
        "phase": robot.state.phase.value,
    }


if __name__ == "__main__":
    asyncio.run(_main(json.loads(sys.argv[1])))
