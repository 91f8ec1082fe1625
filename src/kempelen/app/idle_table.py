"""A table that is up while nobody plays: to home, jog, calibrate and look; on the twin one of its own."""

import tempfile
from collections.abc import Callable
from contextlib import AsyncExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Self

import chess

from kempelen.app.cameras import twin_camera
from kempelen.app.config import Config
from kempelen.app.table_session import TableSession, calibrated_table
from kempelen.core import events
from kempelen.core.errors import CalibrationError, FitError, KempelenError
from kempelen.core.protocols import RobotPhase
from kempelen.core.table import start_layout

if TYPE_CHECKING:
    from kempelen.app.eyes import GameEyes


def _nobody(event: events.Event) -> None:
    """Nobody wants to know."""
    del event


AT_WORK = frozenset({RobotPhase.MOVING, RobotPhase.HOMING, RobotPhase.JOGGING, RobotPhase.HOLDING})


class IdleTable:
    """Async context manager.

    Args:
        config: What to connect to.
        look: Whether the camera looks at it.
        tell: Takes what the eyes tell.

    Attributes:
        session: Wire, robot and hand.
        eyes: None without.
        trouble: Why the calibration cannot be used; the board is then taken to be where it is configured.
    """

    def __init__(
        self, config: Config, *, look: bool = False, tell: Callable[[events.Event], None] = _nobody
    ) -> None:
        self._config = config
        self._look = look
        self._tell = tell
        self._stack = AsyncExitStack()
        self.session: TableSession
        self.eyes: GameEyes | None = None
        self.trouble: KempelenError | None = None

    async def __aenter__(self) -> Self:
        """Connect.

        Raises:
            KempelenError: as `TableSession`; also when the table as configured has no room for all pieces.
        """
        try:
            await self._open()
        except BaseException:
            await self._stack.aclose()
            raise
        return self

    async def _open(self) -> None:
        try:
            table = calibrated_table(self._config)
        except (CalibrationError, FitError) as error:
            self.trouble, table = error, self._config.build_table()
        layout = start_layout(table, chess.Board())
        folder = self._stack.enter_context(tempfile.TemporaryDirectory(prefix="kempelen-"))
        camera = twin_camera(self._config) if self._look else None
        session = TableSession(
            self._config, table, layout, state=Path(folder) / "table.json", resume=False, camera=camera
        )
        self.session = await self._stack.enter_async_context(session)
        if self._look:
            from kempelen.app.eyes import GameEyes  # noqa: PLC0415 - most tables have none

            eyes = GameEyes(self._config, self._tell)
            self.eyes = await self._stack.enter_async_context(await eyes.open(session))
            self.eyes.expect(layout)
            self.eyes.busy = lambda: session.robot.state.phase in AT_WORK

    async def __aexit__(self, *exc: object) -> None:
        """Robot at rest, port free, twin ended."""
        await self._stack.aclose()
