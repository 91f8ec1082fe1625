"""Runs nodes in the foreground, until Ctrl-C."""

import asyncio
import contextlib
import signal
import tempfile
from collections.abc import Callable, Coroutine
from contextlib import AsyncExitStack
from pathlib import Path

import typer

from kempelen.app.config import Config
from kempelen.app.light_tables import LightTableRun
from kempelen.app.network import link_of, table_name
from kempelen.app.node_devices import DeviceStand
from kempelen.app.node_stand import EngineStand, RobotStand
from kempelen.cli import serve_run
from kempelen.cli.knocks import told_of_knocks

_LOOK_S = 0.5


def run_robot(config: Config, table: str) -> None:
    """Offer the robot; what happens is told in lines.

    Raises:
        KempelenError: the robot or the network cannot be used.
    """
    run_node(config, _robot(config, table))


def run_device(config: Config, table: str, what: str) -> None:
    """Offer a reed board (``board``) or a ``camera``; what happens is told in lines.

    Raises:
        KempelenError: the device or the network cannot be used.
    """
    run_node(config, _device(config, table, what))


async def _device(config: Config, table: str, what: str) -> None:
    over = until_signal()
    async with DeviceStand(config, table, what) as stand:
        typer.echo(f"The {what} ({stand.port}) is at table {table}. Ctrl-C ends it.")
        sensor = "reed" if what == "board" else what
        typer.echo(f"Play there: kempelen node arbiter --table {table} --sensor {sensor}")
        await _tell_arbiters(lambda: stand.node.arbiter, "Used", over)
    typer.echo(f"The {what} is free.")


def run_engine(config: Config, name: str) -> None:
    """Offer an engine; what happens is told in lines.

    Raises:
        KempelenError: the engine or the network cannot be used.
    """
    run_node(config, _engine(config, name))


async def _engine(config: Config, name: str) -> None:
    over = until_signal()
    async with EngineStand(config, name) as stand:
        typer.echo(f"{stand.node.engine.name} is at {name}. Ctrl-C ends it.")
        typer.echo(f"Play against it: kempelen play --engine node:{name}")
        await over.wait()
    typer.echo("The engine has ended.")


def run_arbiter(config: Config, host: str, port: int | None, *, tls: bool) -> None:
    """Serve the page of a table whose devices are at nodes.

    Raises:
        KempelenError: it cannot be served, or the network cannot be used.
    """
    table_name(config.network.table)
    serve_run.run(config, host=host, port=port, tls=tls, passwords={}, names=(), browser=False)


def run_hall(config: Config, tables: int) -> None:
    """Light tables, until Ctrl-C.

    Raises:
        KempelenError: the network cannot be used.
    """
    run_node(config, _hall(config, tables))


def run_node(config: Config, work: Coroutine[None, None, None]) -> None:
    """In a loop of its own; whoever is refused meanwhile is told of."""
    with told_of_knocks(typer.echo, keys=bool(config.network.keys)):
        asyncio.run(work)


def until_signal() -> asyncio.Event:
    """Set when the program is asked to end."""
    over = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        loop.add_signal_handler(number, over.set)
    return over


async def _hall(config: Config, tables: int) -> None:
    over = until_signal()
    async with AsyncExitStack() as stack:
        link = await stack.enter_async_context(link_of(config))
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="kempelen-hall-")))
        for number in range(tables):
            run = LightTableRun(link, f"light-{number + 1:03}", folder, seed=number)
            await stack.enter_async_context(run)
        typer.echo(f"{tables} light tables play. See them: kempelen node view. Ctrl-C ends them.")
        await over.wait()
    typer.echo("The hall is closed.")


async def _robot(config: Config, table: str) -> None:
    over = until_signal()
    async with RobotStand(config, table) as stand:
        what = "twin" if config.on_twin else config.robot.port
        typer.echo(f"The {stand.node.robot.name} ({what}) is at table {table}. Ctrl-C ends it.")
        typer.echo(f"Play there: kempelen play --robot {config.robot.kind} --port node:{table}")
        await _tell_arbiters(lambda: stand.node.arbiter, "Led", over)
    typer.echo("The robot is at rest.")


async def _tell_arbiters(who: Callable[[], str], done: str, over: asyncio.Event) -> None:
    shown = ""
    while not over.is_set():
        if (arbiter := who()) != shown:
            typer.echo(f"{done} by {arbiter or 'nobody'}.")
            shown = arbiter
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_LOOK_S):
                await over.wait()
