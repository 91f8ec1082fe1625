"""Devices at this machine, offered to the network."""

from contextlib import AsyncExitStack
from typing import Self

import chess

from kempelen.app.config import NODE_PORT, Config
from kempelen.app.network import link_of, table_name
from kempelen.app.table_session import TableSession, calibrated_table
from kempelen.core.errors import ConfigError
from kempelen.core.table import start_layout
from kempelen.nodes.door import open_door
from kempelen.nodes.link import Link
from kempelen.nodes.robot_node import RobotNode


class RobotStand:
    """A robot, or its twin, offered to the network. Async context manager.

    Args:
        config: Which robot, and how others find it.
        table: Its name.
        link: Entered; None for one as configured.

    Attributes:
        node: Offers the robot.
    """

    def __init__(self, config: Config, table: str, link: Link | None = None) -> None:
        if config.robot.port.startswith(NODE_PORT):
            raise ConfigError(
                f"--port {config.robot.port} is itself at another node.",
                hint="Give the port at which the robot is on this machine, or twin.",
            )
        self._config = config
        self._table = table_name(table)
        self._given = link
        self._stack = AsyncExitStack()
        self.node: RobotNode

    async def __aenter__(self) -> Self:
        """Connect the robot, join the network, be found.

        Raises:
            KempelenError: as `TableSession` and `Link.__aenter__`.
        """
        try:
            await self._open()
        except BaseException:
            await self._stack.aclose()
            raise
        return self

    async def _open(self) -> None:
        table = calibrated_table(self._config)
        state = self._config.data_dir / "twin" / f"node-{self._table}.json"
        resume = self._config.on_twin and state.exists()
        layout = start_layout(table, chess.Board())
        session = TableSession(self._config, table, layout, state=state, resume=resume)
        await self._stack.enter_async_context(session)
        link = self._given
        if link is None:
            link = await self._stack.enter_async_context(link_of(self._config))
        if session.control is not None:
            await open_door(link, self._table, session.control.ask)
        self.node = await self._stack.enter_async_context(RobotNode(session.driver, link, self._table))

    async def __aexit__(self, *exc: object) -> None:
        """Robot at rest, port free; a twin is put away."""
        await self._stack.aclose()
