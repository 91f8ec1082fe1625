"""Which protocol a program speaks: UCI is tried first, then the older one of xboard."""

from enum import StrEnum

from kempelen.core.errors import EngineError
from kempelen.engines.uci_wire import UciProcess
from kempelen.engines.wire import EngineProcess, NotSpokenError, Patience
from kempelen.engines.xboard_wire import XBoardProcess


class Tongue(StrEnum):
    """A protocol."""

    UCI = "uci"
    XBOARD = "xboard"


async def start_process(
    command: tuple[str, ...], patience: Patience, tongue: Tongue | None = None
) -> EngineProcess:
    """Start a program in the protocol that it speaks.

    Args:
        command: Program and arguments.
        patience: How long it may take.
        tongue: The protocol if it is known; None to find out, which starts the program up to twice. A program
            known to speak xboard may speak its version 1, which tells no features.

    Raises:
        EngineError: It cannot be executed, or speaks neither.
    """
    if tongue is Tongue.UCI:
        return await UciProcess.start(command, patience)
    if tongue is Tongue.XBOARD:
        return await XBoardProcess.start(command, patience, old=True)
    try:
        return await UciProcess.start(command, patience)
    except NotSpokenError as fault:
        uci = fault
    try:
        return await XBoardProcess.start(command, patience)
    except NotSpokenError as fault:
        raise EngineError(
            f"it speaks neither UCI nor xboard. As UCI: {uci.message}. As xboard: {fault.message}",
            hint="Name another engine with --engine, or leave it out. "
            "A program of xboard's first version is named as xboard:PROGRAM.",
        ) from fault
