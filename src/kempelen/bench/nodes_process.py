"""The other process of `kempelen bench nodes`: a robot node, or a hall of tables, until its input ends."""

import asyncio
import socket
import sys
import tempfile
from contextlib import AsyncExitStack
from pathlib import Path

import chess

from kempelen.app.light_tables import LightTableRun
from kempelen.core.table import Table, start_layout
from kempelen.nodes.robot_node import RobotNode
from kempelen.nodes.zenoh_link import Network, ZenohLink
from kempelen.twin.light import LightRobot, LightTable


def _endpoint() -> str:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return f"tcp/127.0.0.1:{server.getsockname()[1]}"


async def _main(what: str, tables: int) -> None:
    endpoint = _endpoint()
    async with AsyncExitStack() as stack:
        link = await stack.enter_async_context(ZenohLink(Network(listen=(endpoint,), discover=False)))
        if what == "robot":
            table = Table()
            world = LightTable(table, start_layout(table, chess.Board()))
            robot = await stack.enter_async_context(LightRobot(table, world))
            await stack.enter_async_context(RobotNode(robot, link, "bench"))
        else:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="kempelen-hall-")))
            for number in range(tables):
                run = LightTableRun(link, f"table-{number + 1:03}", folder, seed=number)
                await stack.enter_async_context(run)
        print(endpoint, flush=True)  # noqa: T201 - this is what the other process waits for
        await asyncio.get_running_loop().run_in_executor(None, sys.stdin.buffer.read)


if __name__ == "__main__":
    asyncio.run(_main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 0))  # noqa: PLR2004 - own arguments
