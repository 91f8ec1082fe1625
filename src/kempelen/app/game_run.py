"""A game in the background: being played until it is over, stopped, cut off by an error, or left."""

import asyncio
import logging
from collections.abc import Callable

from kempelen.app.live_game import LiveGame
from kempelen.app.report import GameReport
from kempelen.core.errors import GameError, KempelenError, StoppedError
from kempelen.core.words import say

_log = logging.getLogger(__name__)


class GameRun:
    """One game from its first turn on.

    Args:
        live: Entered.
        ended: Called when it is not being played any more, for whatever reason.

    Attributes:
        live: The game.
        report: Once it is over.
        error: What cut it off; None while it is being played, when it is over, and when it was left.
    """

    def __init__(self, live: LiveGame, ended: Callable[[], None]) -> None:
        self.live = live
        self.report: GameReport | None = None
        self.error: KempelenError | None = None
        self._ended = ended
        self._stopped = False
        self._task = asyncio.create_task(self._play(), name="game")

    @property
    def running(self) -> bool:
        """Whether it is being played."""
        return not self._task.done()

    async def _play(self) -> None:
        try:
            self.report = await self._played()
        except KempelenError as error:
            self.error = error
        except Exception as error:  # noqa: BLE001 - the game has ended; station and page go on
            _log.exception("The game was ended by a fault of the program")
            self.error = GameError(
                say("program_fault", f"A fault of the program ended the game: {error!r}."),
                hint=say("resume_it", "Resume it."),
            )
        finally:
            asyncio.get_running_loop().call_soon(self._ended)  # when the task is done

    async def _played(self) -> GameReport:
        if self._stopped:
            raise StoppedError(
                say("stopped_before", "The game was stopped before it began."),
                hint=say("resume_it", "Resume it."),
            )
        return await self.live.play()

    async def stop(self) -> None:
        """E-stop."""
        self._stopped = True
        try:
            await self.live.arbiter.stop()
        finally:
            await asyncio.wait({self._task})

    async def leave(self) -> None:
        """Robot at rest, everything put away; a game that is not over can be resumed from the journal."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)
        await self.live.__aexit__(None, None, None)
