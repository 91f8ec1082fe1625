"""Work in the background that a fault must not end for good."""

import asyncio
import logging
from collections.abc import Awaitable, Callable

AGAIN_S = 1.0
"""Between a fault and the next try."""
_log = logging.getLogger(__name__)


async def persistent(work: Callable[[], Awaitable[None]], stumbled: Callable[[Exception], None]) -> None:
    """Do ``work`` until it returns; when a fault ends it, tell, wait a little and begin anew.

    Args:
        work: From its beginning.
        stumbled: Told of each fault, before the wait.
    """
    while True:
        try:
            await work()
        except Exception as error:  # noqa: BLE001 - nobody else would notice that the work has ended
            _log.exception("A fault ended what goes on in the background; it begins anew")
            stumbled(error)
            await asyncio.sleep(AGAIN_S)
        else:
            return
