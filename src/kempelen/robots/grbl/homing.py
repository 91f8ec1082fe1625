"""Homing that believes no bare ``ok``.

A failed homing is answered by an alarm, then ``ok``, then a banner. Success is: no alarm and no banner before
the ``ok``, then a report that says Idle with every axis at the pull-off from an end of its travel.
"""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress

from kempelen.core.errors import AlarmError, LinkError, RobotError, SettingsError, StoppedError
from kempelen.core.protocols import GripperState
from kempelen.robots.grbl.codec import Axes, Event
from kempelen.robots.grbl.connect import at_rest, read_offsets
from kempelen.robots.grbl.gate import Gate
from kempelen.robots.grbl.gcode import words
from kempelen.robots.grbl.link import RefusedError, SilenceError
from kempelen.robots.grbl.running import carry_out
from kempelen.robots.grbl.session import Session, apart, finish

_PULL_OFF_TOLERANCE = 0.5
_OFFSET_TOLERANCE = 0.0015  # offsets are reported with three decimals


class PausedError(RobotError):
    """A pause broke the homing off; it begins anew afterwards."""


Search = Callable[[Session], Awaitable[None]]


async def all_axes(session: Session) -> None:
    """``$H``."""
    await request(session, "$H")


async def home(session: Session, gate: Gate, search: Search = all_axes) -> None:
    """Home until it is proved, then go into the work space, where paths begin.

    Args:
        session: Connected.
        gate: Stands before every motion.
        search: Has the controller find its switches.

    Raises:
        AlarmError: a switch was not found, or the proof failed.
        StoppedError: ended by `Gate.end`; the machine is at rest.
        LinkError: the line was lost.
    """
    while True:
        await gate.wait()
        if session.condition.wanted is GripperState.OPEN is not session.condition.gripper:
            await session.unlock()  # a reset closed it, perhaps on a piece: open before lifting
        try:
            await seek(session, search)
        except PausedError:
            continue
        except StoppedError:
            await gate.calmed()
            raise
        return await _enter_space(session, gate)


async def _enter_space(session: Session, gate: Gate) -> None:
    here = session.condition.position
    if here is None:
        raise LinkError("The controller reports no position.", hint="Send $10=1.")
    if (entry := session.mechanics.entry(here)) is not None:
        await carry_out(session, entry, gate)


async def seek(session: Session, search: Search) -> None:
    """Home once and prove it; afterwards the work offset is right and the condition says homed.

    Cancelled: broken off by a reset, at rest, not homed.

    Raises:
        AlarmError: a switch was not found, or the proof failed.
        LinkError: the line was lost.
        KempelenError: whatever the stream was failed with (a pause, a cancel, a stop).
    """
    link, condition = session.link, session.condition
    condition.homed = False
    mark = link.banners
    try:
        await search(session)
    except asyncio.CancelledError:
        await finish(_break_off(session))
        raise
    except AlarmError:
        with suppress(SilenceError):
            await link.until(lambda: link.banners > mark, session.timing.banner, "banner after an alarm")
        raise
    except RefusedError as error:
        raise AlarmError(error.message, hint=error.hint) from error
    await _prove(session)


async def request(session: Session, line: str) -> list[Event]:
    """A homing command, to its end; what the controller said before its acknowledgement.

    Raises:
        SilenceError: it lasted too long and was broken off.
        RobotError: as `Link.request`.
    """
    try:
        async with asyncio.timeout(session.timing.homing):
            return await session.link.request(line)
    except TimeoutError:
        await _break_off(session)
        raise SilenceError(
            f"Homing did not end within {session.timing.homing:g} s.", hint="Check that the axes move."
        ) from None


async def _break_off(session: Session) -> None:
    with suppress(LinkError):
        await session.reset(keeps_position=False)


async def _prove(session: Session) -> None:
    link, condition = session.link, session.condition
    status = await at_rest(link, session.timing)
    if status.state != "Idle":
        raise AlarmError(f"Homing ended in the state {status.state}.", hint="Recover, then home again.")
    if condition.machine is None:
        raise LinkError("The controller reports no position.", hint="Send $10=1.")
    check_pull_off(condition.machine, session)
    await _set_work_offset(session, session.mechanics.offset(condition.machine, session.greeting.settings))
    await session.restore()
    await link.ask(session.timing.answer)
    condition.homed = True
    condition.clear()


def check_pull_off(machine: Axes, session: Session) -> None:
    """Every axis must stand ``$27`` away from an end of its travel [-$130.., 0].

    Where the controller does not list its travels (FluidNC) there is nothing to check.

    Args:
        machine: Machine coordinates.
        session: With the settings.

    Raises:
        AlarmError: an axis stands elsewhere.
    """
    settings, mechanics = session.greeting.settings, session.mechanics
    allowed = settings.get(27, 1.0) + _PULL_OFF_TOLERANCE
    for axis, value in enumerate(machine):
        travel = settings.get(130 + axis)
        distance = 0.0 if travel is None else min(abs(value), abs(value + travel))
        if distance > allowed:
            raise AlarmError(
                f"After homing, {mechanics.axis_names[axis]} is {distance:.3f} {mechanics.unit} from the end "
                f"of its travel, allowed {allowed:g} {mechanics.unit}.",
                hint=f"Check $27 and $130..${129 + len(machine)}, then home again.",
            )


async def _set_work_offset(session: Session, wanted: Axes) -> None:
    """G54 so that work positions are the driver's; written only when it differs (EEPROM)."""
    link, offsets, mechanics = session.link, session.greeting.offsets, session.mechanics
    if apart(offsets.get("G92"), (0.0,) * len(wanted)) > _OFFSET_TOLERANCE:
        await link.request("G92.1")
    if apart(offsets.get("G54"), wanted) > _OFFSET_TOLERANCE:
        await link.request(f"G10L2P1{words(wanted, mechanics.axes)}")
        offsets.update(await read_offsets(link))
    if apart(offsets.get("G54"), wanted) > _OFFSET_TOLERANCE:
        raise SettingsError(
            f"The work offset G54 stays at {offsets.get('G54')} {mechanics.unit}, wanted {wanted} "
            f"{mechanics.unit}.",
            hint="Home again; if it stays so, the controller's memory is worn out.",
        )
    session.condition.know_offset(wanted)
