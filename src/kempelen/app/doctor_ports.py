"""Is the robot's port there, and may this user use it? Without opening it: that resets many a controller."""

import asyncio
import grp
import os
import stat
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from urllib.parse import urlsplit

from kempelen.app.config import TWIN_PORT
from kempelen.app.doctor_rows import Check, fail, ok, warn
from kempelen.robots.transport import PortInfo

_REACH_SECONDS = 3.0


async def examine_port(port: str) -> Check:
    """The configured port: ``twin``, a device or ``socket://host:port``."""
    if port == TWIN_PORT:
        return ok("robot", "the twin: it brings its own port")
    if "://" in port:
        return await _examine_socket(port)
    return _examine_device(Path(port))


def examine_serial_ports(ports: Sequence[PortInfo]) -> Iterator[Check]:
    """Every serial port of the machine."""
    for port in ports:
        found = f"{port.device} {port.description}".strip()
        if port.usable:
            yield ok("serial port", found)
        else:
            yield warn("serial port", f"{found}: no permission", permission_advice(Path(port.device)))
    if not ports:
        yield ok("serial port", "none found; the twin needs none")


def permission_advice(device: Path) -> str:
    """What lets this user open a device, as a sentence."""
    try:
        status = device.stat()
    except OSError:
        return "Plug it in again."
    group = str(status.st_gid)
    with suppress(KeyError):
        group = grp.getgrgid(status.st_gid).gr_name
    if status.st_mode & stat.S_IRGRP and status.st_mode & stat.S_IWGRP:
        return f"Join its group, then log in again: sudo usermod -aG {group} $USER"
    return f"Allow it: sudo chmod a+rw {device}"


def _examine_device(device: Path) -> Check:
    if not device.exists():
        return fail("robot", f"there is no {device}", "Plug the robot in, or name another port with --port.")
    if not stat.S_ISCHR(device.stat().st_mode):
        return fail("robot", f"{device} is no serial port", "Name a port such as /dev/ttyUSB0 with --port.")
    if not os.access(device, os.R_OK | os.W_OK):
        return fail("robot", f"no permission to use {device}", permission_advice(device))
    return ok("robot", f"{device} is there and may be used")


async def _examine_socket(port: str) -> Check:
    try:
        parts = urlsplit(port)
        host, number = parts.hostname, parts.port
    except ValueError:
        host, number = None, None
    if parts_missing := [what for what, value in (("host", host), ("port number", number)) if not value]:
        return fail(
            "robot", f"'{port}' has no {' and no '.join(parts_missing)}", "Write it as socket://HOST:PORT."
        )
    try:
        async with asyncio.timeout(_REACH_SECONDS):
            _, writer = await asyncio.open_connection(host, number)
    except TimeoutError:
        why = f"no answer within {_REACH_SECONDS:.0f} s"
    except OSError as error:
        why = error.strerror or str(error)
    else:
        writer.close()
        with suppress(OSError):
            await writer.wait_closed()
        return ok("robot", f"{host}:{number} can be reached")
    return fail("robot", f"{port} cannot be reached: {why}", "Check address, network and the device's power.")
