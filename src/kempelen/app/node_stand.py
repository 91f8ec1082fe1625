"""Devices at this machine, offered to the network."""

from contextlib import AsyncExitStack
from typing import Self

import chess

from kempelen.app.cameras import twin_camera
from kempelen.app.config import NODE_PORT, Config
from kempelen.app.minds import engine_of
from kempelen.app.network import link_of, table_name
from kempelen.app.node_devices import EyeBeside, offer, open_line, require_alone
from kempelen.app.table_session import TableSession, calibrated_table
from kempelen.core.errors import ConfigError
from kempelen.core.table import start_layout
from kempelen.nodes.door import open_door
from kempelen.nodes.engine_node import EngineNode
from kempelen.nodes.link import Link
from kempelen.nodes.robot_node import RobotNode
from kempelen.twin.client import TwinProcess


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
        layout, camera = start_layout(table, chess.Board()), None
        if self._config.on_twin and self._config.has_camera:
            camera = twin_camera(self._config)
        session = TableSession(self._config, table, layout, state=state, resume=resume, camera=camera)
        await self._stack.enter_async_context(session)
        link = self._given
        if link is None:
            link = await self._stack.enter_async_context(link_of(self._config))
        await require_alone(link, self._table, "robot")
        if session.control is not None:
            await open_door(link, self._table, session.control.ask)
        if session.twin is not None:
            await self._offer_twin(link, session.twin, with_camera=camera is not None)
        self.node = await self._stack.enter_async_context(RobotNode(session.driver, link, self._table))

    async def _offer_twin(self, link: Link, twin: TwinProcess, *, with_camera: bool) -> None:
        """A twin's board and camera are in its process, and offered with it."""
        if reed := twin.reed:
            board = await offer(link, self._table, "board", lambda: open_line(reed))
            await self._stack.enter_async_context(board)
        if with_camera:
            from kempelen.app.eyes import TwinFrames  # noqa: PLC0415 - only where a camera is offered

            frames = TwinFrames(twin.ring)
            camera = await offer(link, self._table, "camera", lambda: EyeBeside(frames).open())
            await self._stack.enter_async_context(camera)

    async def __aexit__(self, *exc: object) -> None:
        """Robot at rest, port free; a twin is put away."""
        await self._stack.aclose()


class EngineStand:
    """An engine of this machine, offered to the network. Async context manager.

    Args:
        config: Which engine, how strong, and how others find it.
        name: By which they do.

    Attributes:
        node: Offers the engine.
    """

    def __init__(self, config: Config, name: str) -> None:
        if config.engine.path.startswith(NODE_PORT):
            raise ConfigError(
                f"--engine {config.engine.path} is itself at another node.",
                hint="Name an engine of this machine, or leave it out for the best at hand.",
            )
        self._config = config
        self._name = table_name(name)
        self._stack = AsyncExitStack()
        self.node: EngineNode

    async def __aenter__(self) -> Self:
        """Start the engine, join the network, be found.

        Raises:
            EngineError: no such engine, or it does not start.
            LinkError: the network cannot be joined, or another engine has that name.
        """
        wanted = self._config.engine
        try:
            engine = engine_of(self._config, wanted.path, wanted.level, wanted.move_time)
            await self._stack.enter_async_context(engine)
            link = await self._stack.enter_async_context(link_of(self._config))
            await require_alone(link, self._name, "engine")
            self.node = await self._stack.enter_async_context(EngineNode(engine, link, self._name))
        except BaseException:
            await self._stack.aclose()
            raise
        return self

    async def __aexit__(self, *exc: object) -> None:
        """Engine ended."""
        await self._stack.aclose()
