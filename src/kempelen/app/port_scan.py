"""Which ports are there, and what answers at them. Opening a port may reset its board, so this is a command.

A port that is in use, or for which there is no permission, is named with the reason and not touched.
"""

import asyncio
import re
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from kempelen.app.config import TWIN_PORT
from kempelen.app.doctor_ports import examine_port, permission_advice
from kempelen.app.doctor_rows import Status
from kempelen.core.errors import KempelenError
from kempelen.robots.transport import PortInfo, Transport, list_ports, open_port

Answer = Literal["grbl", "foreign", "silent", "in use", "forbidden", "absent", "twin"]
Open = Callable[[str], Awaitable[Transport]]

BOOT_S = 2.5
"""A board that opening has reset says its name after its boot loader."""
QUIET_S = 1.0
"""One that runs on answers a status query at once."""
ALL_S = 12.0
_ENOUGH = 4096  # bytes of something else
_ASK = b"?"  # a real-time byte of GRBL: acted upon at once, and no command to anybody else
_BANNER = re.compile(rb"Grbl (\d\.\w+)")
_REPORT = re.compile(rb"<(\w+)[:|]")


@dataclass(frozen=True, slots=True)
class FoundPort:
    """A port and what answers there.

    Attributes:
        port: What to connect to.
        description: Of the device, as the system knows it.
        answer: ``grbl``; ``foreign``: another device; ``silent``: nothing within the time; ``in use`` by this
            program; ``forbidden``; ``absent``; ``twin``.
        said: In plain words, with what to do.
    """

    port: str
    description: str
    answer: Answer
    said: str


async def scan_ports(
    in_use: str = "", address: str = "", ports: Sequence[PortInfo] | None = None, opened: Open = open_port
) -> tuple[FoundPort, ...]:
    """Look at all of them at once; it takes a few seconds.

    Args:
        in_use: The port that this program has open, if any.
        address: Another one to look at: ``socket://host:port``, or a device that is not listed.
        ports: What to look at; the machine's serial ports by default.
        opened: Opens one.
    """
    listed = await asyncio.to_thread(list_ports) if ports is None else ports
    known = {info.device for info in listed}
    wanted = [*listed, *([PortInfo(address, "", usable=True)] if address and address not in known else [])]
    found = await asyncio.gather(*(_look(info, in_use, opened) for info in wanted))
    twin = FoundPort(TWIN_PORT, "", "twin", "The simulated robot: always there.")
    return (twin, *found)


async def _look(info: PortInfo, in_use: str, opened: Open) -> FoundPort:
    def found(answer: Answer, said: str) -> FoundPort:
        return FoundPort(info.device, info.description, answer, said)

    if info.device == in_use:
        return found("in use", "This is the robot that is connected.")
    if not info.usable:
        return found("forbidden", f"No permission. {permission_advice(Path(info.device))}")
    reachable = await examine_port(info.device)
    if reachable.status is Status.FAIL:
        return found("absent", f"{reachable.found}. {reachable.todo}")
    try:
        async with asyncio.timeout(ALL_S):
            return found(*await _ask(await opened(info.device)))
    except KempelenError as error:
        return found("absent", str(error))
    except TimeoutError:
        return found("silent", f"It cannot be opened within {ALL_S:.0f} s. Unplug it and plug it in again.")


async def _ask(transport: Transport) -> tuple[Answer, str]:
    try:
        heard = await _heard(transport)
    finally:
        await transport.close()
    if banner := _BANNER.search(heard):
        return "grbl", f"GRBL {banner[1].decode()}, just restarted."
    if report := _REPORT.search(heard):
        return "grbl", f"GRBL, {report[1].decode()}."
    if heard:
        return "foreign", "Something answers that is not GRBL. Check the baud rate, or choose another port."
    return "silent", "Nothing answers. Is the robot switched on?"


async def _heard(transport: Transport) -> bytes:
    """What it says by itself after a reset, or when asked."""
    heard = await _until_known(transport, b"", BOOT_S) if transport.resets else b""
    if not _known(heard):
        transport.write(_ASK)
        heard = await _until_known(transport, heard, QUIET_S)
    return heard


async def _until_known(transport: Transport, heard: bytes, seconds: float) -> bytes:
    with suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            while not _known(heard) and len(heard) < _ENOUGH:
                heard += await transport.read()
    return heard


def _known(heard: bytes) -> bool:
    return bool(_BANNER.search(heard) or _REPORT.search(heard))
