"""The reed board of a game: at which port it is, and what the game does with it."""

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress

from kempelen.app.config import NODE_PORT, Config
from kempelen.app.network import link_of, table_name
from kempelen.app.table_session import TableSession
from kempelen.core import events
from kempelen.core.errors import ConfigError, KempelenError, SensorError
from kempelen.core.places import Layout
from kempelen.core.reed import Hello
from kempelen.game.verify import SensorVerifier
from kempelen.nodes.remote_line import RemoteLine
from kempelen.robots.transport import Transport, list_ports, open_port
from kempelen.sensing.reed.board import ReedBoard
from kempelen.sensing.reed.faults import SwitchFault
from kempelen.sensing.reed.sensor import ReedSensor

_START_LOOK_S = 2.0
"""A look before the game lasts no longer; in between it is asked whether the game was given up."""
_OR_BLIND = "The game begins then. (To play without looking, type: eyes off.)"
Open = Callable[[str], Awaitable[Transport]]


async def reed_port(config: Config, session: TableSession | None, opened: Open = open_port) -> str:
    """Where the reed board is: as configured, the twin's own, or the only port at which one answers.

    Raises:
        ConfigError: two boards answer.
        SensorError: none does.
    """
    if config.sensor.port:
        return config.sensor.port
    if session is not None and session.twin is not None and session.twin.reed:
        return session.twin.reed
    ports = [port.device for port in list_ports() if port.usable and port.device != config.robot.port]
    return await only_board(ports, opened)


async def only_board(ports: Iterable[str], opened: Open = open_port) -> str:
    """The one port of these at which a reed board answers; raises as `reed_port`."""
    names = list(ports)
    found = await asyncio.gather(*(greet(name, opened) for name in names), return_exceptions=True)
    boards = {name: hello for name, hello in zip(names, found, strict=True) if isinstance(hello, Hello)}
    if len(boards) > 1:
        told = " and ".join(f"{hello.identity} at {name}" for name, hello in boards.items())
        raise ConfigError(
            f"{len(boards)} reed boards answer: {told}.", hint="Name one: --sensor reed:/dev/ttyUSB0"
        )
    for problem in found:
        if isinstance(problem, BaseException) and not isinstance(problem, KempelenError):
            raise problem
    if not boards:
        asked = f"asked: {', '.join(names)}" if names else "there is no serial port to ask"
        raise SensorError(
            f"No reed board answers; {asked}.",
            hint="Plug it in, or name its port: --sensor reed:/dev/ttyUSB0",
        )
    return next(iter(boards))


async def greet(port: str, opened: Open = open_port) -> Hello:
    """What the reed board at a port says of itself.

    Raises:
        LinkError: the port cannot be opened.
        SensorError: no reed board, or none of this protocol version, answers there.
    """
    async with ReedBoard(port, lambda: opened(port), lambda _: None) as board:
        return board.hello


async def open_reed(config: Config, session: TableSession, tell: Callable[[SwitchFault], None]) -> ReedSensor:
    """The board's sensor, not yet entered; raises as `reed_port`."""
    port = await reed_port(config, session)
    if not port.startswith(NODE_PORT):
        return ReedSensor(port, lambda: open_port(port), tell=tell)
    table = table_name(port.removeprefix(NODE_PORT))
    return ReedSensor(port, lambda: RemoteLine(link_of(config), table, "board").open(), tell=tell)


async def until_right(
    verifier: SensorVerifier,
    layout: Layout,
    tell: Callable[[events.Event], None],
    given_up: Callable[[], bool],
) -> None:
    """Returns when the pieces stand as they should; until then it is told what stands wrong.

    A camera asks for that when a move is read; but a robot that begins would set out over a wrong board.

    Args:
        verifier: Looks.
        layout: What should stand where.
        tell: Takes advice.
        given_up: Whether nobody wants the game any more.
    """
    told, right = "", False
    while not right and not given_up():
        with suppress(TimeoutError):
            async with asyncio.timeout(_START_LOOK_S):
                fault = await verifier.confirm((), layout)
            right = fault is None
            if fault is not None and fault.text != told:
                told = fault.text
                tell(events.BoardDiffers(f"{told} {_OR_BLIND}", fault.piece, fault.place))
    if told:
        tell(events.BoardDiffers(""))
