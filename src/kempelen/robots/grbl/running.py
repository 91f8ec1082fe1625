"""Carrying out a program: stream, barrier, arrival; and what follows when one of them fails."""

import asyncio
from contextlib import suppress

from kempelen.core.errors import AlarmError, LinkError, RobotError, StoppedError
from kempelen.robots.grbl.codec import Axes, Status
from kempelen.robots.grbl.connect import at_rest
from kempelen.robots.grbl.gate import Gate
from kempelen.robots.grbl.gcode import Program
from kempelen.robots.grbl.link import RefusedError
from kempelen.robots.grbl.session import Session, apart, finish
from kempelen.robots.grbl.stream import Stream

_ASKS = 5
_LOCKED = frozenset({8, 9})  # error codes that speak of the controller's state, not of the line
_HELD = frozenset({"Hold", "Door"})


async def carry_out(session: Session, program: Program, gate: Gate) -> None:
    """Send a program and return when the machine is physically at its end.

    Cancelled or failed: the machine has come to rest as far as the line still allows, and keeps its position.

    Raises:
        StoppedError: `Gate.end` was called; the machine is at rest.
        AlarmError: the controller raised an alarm.
        LinkError: the line was lost or damaged a line.
    """
    stream = Stream(program.lines, session.greeting.window)
    session.work, session.dwell = (program, stream), program.longest_dwell
    try:
        await session.link.stream(stream)
        session.note_gripper()
        await _arrive(session, program.end, gate)
    except asyncio.CancelledError:
        await finish(_abandon(session))
        raise
    except StoppedError:
        await gate.calmed()
        raise
    except AlarmError:
        raise
    except RobotError as error:
        await finish(_abandon(session))
        raise _as_line_fault(error) from error
    finally:
        session.work = None


async def _arrive(session: Session, target: Axes, gate: Gate) -> None:
    """The barrier's second half: Idle, and at the target. "ok, then Idle" alone can lie."""
    mechanics = session.mechanics
    for _ in range(_ASKS):
        status = await _settled(session, gate)
        if status.state == "Alarm":
            raise AlarmError(f"The {mechanics.name} locked itself.", hint="Recover, then home.")
        if apart(session.condition.position, target) <= mechanics.arrived:
            return
        await asyncio.sleep(session.timing.poll)
    raise LinkError(
        f"The {mechanics.name} came to rest {apart(session.condition.position, target):.3f} "
        f"{mechanics.unit} from its target, allowed {mechanics.arrived:g} {mechanics.unit}: a line was lost "
        "on the way.",
        hint="Check the cable, then home.",
    )


async def _settled(session: Session, gate: Gate) -> Status:
    """At rest and not held: a hold is silent for as long as people like."""
    status = await at_rest(session.link, session.timing)
    while status.state in _HELD:
        await gate.wait()
        await asyncio.sleep(session.timing.poll)
        status = await at_rest(session.link, session.timing)
    return status


async def _abandon(session: Session) -> None:
    if session.link.lost is None and session.condition.alarm is None:
        with suppress(RobotError):
            await session.halt()


def _as_line_fault(error: RobotError) -> RobotError:
    if not isinstance(error, RefusedError):
        return error
    if error.code in _LOCKED:
        return AlarmError(error.message, hint=error.hint)
    return LinkError(f"{error.message} A line was damaged on its way.", hint=error.hint)
