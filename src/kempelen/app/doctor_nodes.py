"""Are the nodes there that a game is to be played with, on other machines of the network?"""

from collections.abc import AsyncIterator

from kempelen.app.config import NODE_PORT, Config
from kempelen.app.doctor_rows import Check, failed, ok
from kempelen.app.network import link_of, table_name
from kempelen.core.errors import KempelenError
from kempelen.nodes.link import Link
from kempelen.nodes.presence import found_within

_FOUND_S = 4.0
"""Machines find each other well within that."""


def at_node(port: str) -> bool:
    """Whether that is elsewhere on the network: it is not looked for on this machine."""
    return port.startswith(NODE_PORT)


async def examine_nodes(config: Config, seconds: float = _FOUND_S) -> AsyncIterator[Check]:
    """A row for each node that the configuration names; nothing is asked of them, so that games go on.

    Args:
        config: Names them as ``node:NAME``.
        seconds: Each is looked for so long.
    """
    wanted = [(what, name) for what, name in _named(config).items() if at_node(name)]
    if not wanted:
        return
    try:
        async with link_of(config) as link:
            for what, name in wanted:
                yield await _looked_for(link, what, name, seconds)
    except KempelenError as error:
        yield failed("network", error)


def _named(config: Config) -> dict[str, str]:
    return {
        "robot": config.robot.port,
        "camera": config.camera_source if config.has_camera else "",
        "board": config.sensor.port if config.sensor.reed else "",
        "engine": config.engine.path,
    }


async def _looked_for(link: Link, what: str, named: str, seconds: float) -> Check:
    try:
        name = table_name(named.removeprefix(NODE_PORT))
    except KempelenError as error:
        return failed(f"{what} node", error)
    seen = await found_within(link, what, name, seconds)
    if not seen.found:
        return failed(f"{what} node", seen.absence(seconds))
    return ok(f"{what} node", f"{name} is there, and speaks this protocol")
