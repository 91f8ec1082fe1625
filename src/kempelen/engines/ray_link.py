"""Ray, where it is installed: one connection for the whole program, without telemetry, dashboard or talk."""

import asyncio
import importlib
import logging
import os
from typing import Any

from kempelen.core.errors import ConfigError, EngineError

_QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_USAGE_STATS_PROMPT_ENABLED": "0",
    "RAY_DEDUP_LOGS": "0",
    "RAY_worker_niceness": "0",  # else voters starve beside everything else, this program included
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
}
_STORE_BYTES = 80 * 1024 * 1024  # the least that Ray accepts; votes are a few hundred bytes
_users: dict[str, int] = {}


def library() -> Any:
    """The package ``ray``, imported late: it is large, and starts to talk unless it is told not to.

    Raises:
        ConfigError: It is not installed.
    """
    for name, value in _QUIET.items():
        os.environ.setdefault(name, value)
    try:
        return importlib.import_module("ray")
    except ImportError as error:
        raise ConfigError(
            "The engine 'cluster' needs Ray, which is not installed.",
            hint="Install it: pip install 'kempelen[cluster]', or leave out --engine cluster.",
        ) from error


async def join(address: str, workers: int) -> Any:
    """Connect, or share the connection that is there; give it back with `leave`.

    Args:
        address: ``ray://HOST:PORT`` of a cluster; empty for workers on this machine alone.
        workers: How many processes this machine shall offer.

    Returns:
        The library.

    Raises:
        ConfigError: Ray is not installed, or the program is connected to another cluster.
        EngineError: The cluster does not answer.
    """
    ray = library()
    if others := set(_users) - {address}:
        raise ConfigError(
            f"This program works with the cluster at {others.pop() or 'this machine'} already.",
            hint="Use one cluster for both engines.",
        )
    if not _users:
        try:
            await asyncio.to_thread(_connect, ray, address, workers)
        except (ConnectionError, RuntimeError, OSError, ValueError, TimeoutError) as error:
            why = str(error).strip().splitlines()[:1]
            raise EngineError(
                f"The cluster at {address or 'this machine'} could not be joined: {' '.join(why)[:200]}",
                hint="Is it running, and reachable on this port? `ray status` on its head tells.",
            ) from error
    _users[address] = _users.get(address, 0) + 1
    return ray


async def leave(address: str) -> None:
    """Give the connection back; the last one closes it, and ends workers of this machine."""
    _users[address] = _users.get(address, 1) - 1
    if _users[address] <= 0:
        del _users[address]
        await asyncio.to_thread(library().shutdown)


def _connect(ray: Any, address: str, workers: int) -> None:
    logging.getLogger("ray").setLevel(logging.ERROR)
    quiet = {"configure_logging": False, "log_to_driver": False}
    if address:
        ray.init(address, **quiet)
        return
    ray.init(
        "local",
        num_cpus=workers,
        include_dashboard=False,
        object_store_memory=_STORE_BYTES,
        _node_ip_address="127.0.0.1",
        **quiet,
    )
