"""Meeting a controller: is it GRBL, has it been reset, what does it remember, is it set up for this table.

A board whose DTR stayed up while nobody had the port open has kept position, modal state and outputs, and may
still be emptying its buffer. Whether it has is not guessed: see `gcode.MEMORY_MARK`.
"""

import asyncio
from dataclasses import dataclass

from kempelen.core.errors import LinkError
from kempelen.core.protocols import GripperState
from kempelen.robots.grbl import codec
from kempelen.robots.grbl.codec import Axes, BuildInfo, Event, Offset, ParserState, Setting, Status
from kempelen.robots.grbl.gcode import GripperWiring
from kempelen.robots.grbl.link import Link, SilenceError
from kempelen.robots.grbl.mechanics import Mechanics
from kempelen.robots.grbl.settings import Misfit, require
from kempelen.robots.grbl.stream import WINDOW
from kempelen.robots.grbl.timing import Timing

_ASKS = 3
_REPORTS_PER_ACCESSORIES = 32  # a report tells the outputs at least every 30th time
_RESERVE = 8  # bytes of the receive buffer left free
_BUFFER_FIELD = 2  # of [OPT:letters,blocks,bytes,...]
_FLUIDNC = "FluidNC"
_NOT_A_LINE = b"=\n"  # no G-code and no $ command, whatever a dead sender left in front of it


@dataclass(frozen=True, slots=True)
class Greeting:
    """What was found.

    Attributes:
        memory_kept: The controller has not been reset since this driver last drove it.
        gripper: What it does with the gripper now.
        reopen: The gripper was open until we had to reset the controller.
        settings: ``$$``.
        offsets: ``$#``.
        work_offset: WCO: what to take from a machine position to get the reported work position.
        window: Bytes that may be in flight.
    """

    memory_kept: bool
    gripper: GripperState
    reopen: bool
    settings: dict[int, float]
    offsets: dict[str, Axes]
    work_offset: Axes
    window: int


async def greet(
    link: Link, mechanics: Mechanics, wiring: GripperWiring, timing: Timing, *, apply_settings: bool
) -> Greeting:
    """Find out everything about the controller at the other end.

    Args:
        link: Started.
        mechanics: What the settings must fit.
        wiring: Of the gripper.
        timing: Patience.
        apply_settings: Send the settings that do not fit instead of refusing them.

    Raises:
        LinkError: nobody answers, or somebody else.
        SettingsError: the settings do not fit.
    """
    at_work = reopen = False
    if not await restarted(link, timing):
        at_work, reopen = await calm(link, wiring, timing)
    await synchronise(link, timing)
    build = await link.request("$I")
    window = _window(build, link.transport.name)
    _count_axes(link, build, mechanics)
    settings = await read_settings(link)
    if apply_settings:
        settings = await _apply(link, settings, mechanics)
    require(_misfits(settings, build, mechanics), link.transport.name)
    offsets = await read_offsets(link)
    modal = _modal(await link.request("$G"))
    return Greeting(
        memory_kept=at_work or (mechanics.remembers(modal) and not link.banners),
        gripper=wiring.read(modal),
        reopen=reopen,
        settings=settings,
        offsets=offsets,
        work_offset=_work_offset(offsets, modal, link.transport.name),
        window=window,
    )


async def restarted(link: Link, timing: Timing) -> bool:
    """Wait for the first word: True for a banner, False when the controller has been running on."""
    try:
        patience = timing.banner if link.transport.resets else timing.quiet
        await link.until(lambda: link.banners > 0, patience, "banner")
    except SilenceError:
        return await _woken(link, timing)
    return True


async def _woken(link: Link, timing: Timing) -> bool:
    for _ in range(_ASKS):
        link.realtime(codec.ASK)
        try:
            await link.until(lambda: link.banners + link.statuses > 0, timing.banner / _ASKS, "answer")
        except SilenceError:
            continue
        return link.banners > 0
    if link.raw_heard:
        raise _foreign(link)
    # Deaf: homing, or an alarm that only a reset ends. The reset is right for both.
    link.realtime(codec.RESET)
    try:
        await link.until(lambda: link.banners > 0, timing.banner, "banner")
    except SilenceError:
        raise _foreign(link) from None
    return True


def _foreign(link: Link) -> LinkError:
    name = link.transport.name
    if link.raw_heard:
        return LinkError(
            f"{name}: the device that answers is not {link.framing.device}; it said {link.raw_heard!r}.",
            hint="Choose another port (`kempelen doctor` lists them), or check the baud rate (115200).",
        )
    return LinkError(
        f"{name}: nothing answers.",
        hint="Is the machine switched on? Check the port (`kempelen doctor`) and the baud rate (115200).",
    )


async def at_rest(link: Link, timing: Timing) -> Status:
    """Poll until the axes stand still.

    Raises:
        LinkError: the line fell silent.
    """
    while True:
        status = await link.ask(timing.answer)
        if not status.moving:
            return status
        await asyncio.sleep(timing.poll)


async def calm(link: Link, wiring: GripperWiring, timing: Timing) -> tuple[bool, bool]:
    """Wait for what still moves, end what was left held.

    Returns:
        Whether the controller was found at work, and whether the gripper was open until it was reset.
    """
    first = await link.ask(timing.answer)
    if first.state == "Jog":
        link.realtime(codec.JOG_CANCEL)
    status = await at_rest(link, timing)
    if status.state in {"Idle", "Alarm"}:
        return first.moving, False
    reopen = status.state == "Hold" and wiring.open_letter in await _accessories(link, timing)
    mark = link.banners
    link.realtime(codec.RESET)
    await link.until(lambda: link.banners > mark, timing.banner, "banner")
    return True, reopen


async def _accessories(link: Link, timing: Timing) -> str:
    """Letters of the outputs that are on; reports tell them only now and then."""
    for _ in range(_REPORTS_PER_ACCESSORIES):
        status = await link.ask(timing.answer)
        if status.accessories is not None:
            return status.accessories
        await asyncio.sleep(timing.poll)
    return ""


async def synchronise(link: Link, timing: Timing) -> None:
    """Void whatever a dead sender left in the controller's line buffer, and the answers it was owed."""
    mark = link.errors
    link.realtime(_NOT_A_LINE)
    await link.until(lambda: link.errors > mark, timing.answer, "answer to a line")
    await at_rest(link, timing)


def _window(build: list[Event], where: str) -> int:
    info = _info(build)
    version = info.get("VER", "")
    if not (version.startswith("1.1") or _FLUIDNC in version):
        raise LinkError(
            f"{where}: the firmware is GRBL {version or 'older than 1.1'}; 1.1 is needed.",
            hint="Flash GRBL 1.1h to the controller.",
        )
    fields = info.get("OPT", "").split(",")
    buffer = fields[_BUFFER_FIELD] if len(fields) > _BUFFER_FIELD else ""
    return min(WINDOW, int(buffer) - _RESERVE) if buffer.isdigit() else WINDOW


def _info(build: list[Event]) -> dict[str, str]:
    return {event.key: event.text for event in build if isinstance(event, BuildInfo)}


def _count_axes(link: Link, build: list[Event], mechanics: Mechanics) -> None:
    """Have the decoder take reports of any other number of axes for damaged from now on."""
    told = _info(build).get("AXS", "").partition(":")[2]
    place = link.status and (link.status.machine or link.status.work)
    found = len(place) if place else len(told)
    wanted = len(mechanics.axes)
    if found != wanted or (told and told[:wanted] != mechanics.axes):
        raise LinkError(
            f"{link.transport.name}: the controller has {found} axes{f' ({told})' if told else ''}, the "
            f"{mechanics.name} needs {wanted} ({mechanics.axes}).",
            hint="Choose another port, or firmware built for so many axes.",
        )
    link.framing.expect_axes(wanted)


def _misfits(settings: dict[int, float], build: list[Event], mechanics: Mechanics) -> list[Misfit]:
    """What does not fit; FluidNC lists but a few settings, the others are in its own configuration file."""
    misfits = mechanics.misfits(settings)
    if _FLUIDNC in _info(build).get("VER", ""):
        return [misfit for misfit in misfits if misfit.have is not None]
    return misfits


async def read_settings(link: Link) -> dict[int, float]:
    """``$$``."""
    return {event.number: event.value for event in await link.request("$$") if isinstance(event, Setting)}


async def read_offsets(link: Link) -> dict[str, Axes]:
    """``$#``."""
    return {event.name: event.value for event in await link.request("$#") if isinstance(event, Offset)}


def _work_offset(offsets: dict[str, Axes], modal: tuple[str, ...], where: str) -> Axes:
    """The active set (G54..G59) plus G92. Reports tell the sum only now and then."""
    active = next((word for word in modal if word in offsets and word != "G92"), "G54")
    if active not in offsets or "G92" not in offsets:
        raise LinkError(
            f"{where}: the answer to $# arrived damaged.", hint="Check the cable, then try again."
        )
    return tuple(round(a + b, 3) for a, b in zip(offsets[active], offsets["G92"], strict=True))


def _modal(events: list[Event]) -> tuple[str, ...]:
    return next((event.words for event in events if isinstance(event, ParserState)), ())


async def _apply(link: Link, settings: dict[int, float], mechanics: Mechanics) -> dict[int, float]:
    """Send each misfit's line, alone; homing ($22) first because soft limits ($20) need it."""
    misfits = [misfit for misfit in mechanics.misfits(settings) if misfit.line]
    for misfit in sorted(misfits, key=lambda misfit: misfit.number != 22):  # noqa: PLR2004 - $22
        await link.request(misfit.line)
    return await read_settings(link) if misfits else settings
