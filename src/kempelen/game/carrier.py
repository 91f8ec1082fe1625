"""One transfer at a time: each phase is in the journal before the hand goes on."""

import asyncio
import contextlib
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from kempelen.core import events
from kempelen.core.errors import GameError, KempelenError
from kempelen.core.places import Transfer
from kempelen.core.protocols import Checkpoint, Hand, RobotState, TransferReport
from kempelen.game.journal import GameLog
from kempelen.game.observers import EventBus
from kempelen.game.records import Interrupted, Phase, Step
from kempelen.game.state import Pending
from kempelen.game.tasks import Gate

T = TypeVar("T")


class Carrier:
    """The hand, driven so that the journal always knows where the piece is.

    Args:
        gate: Closed while the game is paused.

    Attributes:
        moving: Whether the robot is in motion, or held in mid-motion.
    """

    def __init__(self, log: GameLog, hand: Hand, bus: EventBus, gate: Gate) -> None:
        self.hand = hand
        self.moving = False
        self._log = log
        self._bus = bus
        self._gate = gate

    @property
    def robot(self) -> RobotState:
        """The robot's latest snapshot."""
        return self.hand.state

    @property
    def pending(self) -> Pending:
        """The move in hand.

        Raises:
            GameError: There is none.
        """
        if self._log.state.pending is None:
            raise GameError("No move is in hand.")
        return self._log.state.pending

    async def carry(self, transfer: Transfer) -> None:
        """Make the transfer at hand, once the game is not paused."""
        await self._gate.passed()
        pending = self.pending
        self._bus.emit(events.TransferStarted(transfer, pending.index + 1, len(pending.transfers)))
        standing = self._log.state.layout
        self.cleared(
            transfer, await self._guarded(lambda: self.hand.carry(transfer, standing, self._reached))
        )

    async def finish_held(self, transfer: Transfer) -> None:
        """Put the piece that is in the gripper after an exit on its target."""
        self.note(Phase.CARRYING)
        standing = self._log.state.layout.without(transfer.source)
        await self._guarded(lambda: self.hand.finish_held(transfer, standing, self._reached))
        self.cleared(transfer, None)

    async def prepare(self) -> None:
        """Homed, empty, open and parked."""
        await self._free(self.hand.prepare)

    async def park(self) -> None:
        """High, clear of the camera."""
        await self._free(lambda: self.hand.park(self._log.state.layout))

    def note(self, phase: Phase) -> None:
        """Write a phase of the transfer at hand, unless the journal has it already."""
        if self.pending.phase is not phase:
            self._log.write(Step(index=self.pending.index, phase=phase))

    def cleared(self, transfer: Transfer, report: TransferReport | None) -> None:
        """The piece stands on its target and the hand is clear of it."""
        self.note(Phase.CLEAR)
        self._bus.emit(events.TransferDone(transfer, self._log.state.layout, report))

    async def _reached(self, checkpoint: Checkpoint) -> None:
        """The hand has come to a checkpoint: on disk first; then, unless the game is paused, on."""
        transfer = self.pending.transfers[self.pending.index]
        self._log.write(Step(index=self.pending.index, phase=Phase(checkpoint.value)))
        self._bus.emit(events.CheckpointReached(transfer, checkpoint))
        self._bus.emit(events.RobotChanged(self.robot))
        await self._gate.passed()

    async def _free(self, motion: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Run a motion of the empty hand."""
        self.moving = True
        try:
            await motion()
        finally:
            self.moving = False
            self._bus.emit(events.RobotChanged(self.robot))

    async def _guarded(self, motion: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """Run a motion with a piece at stake; when it is cut off, the journal says so before it happens."""
        self.moving = True
        task = asyncio.ensure_future(motion())
        try:
            return await asyncio.shield(task)
        except asyncio.CancelledError:
            await self._cut_off(task)
            raise
        except KempelenError as error:
            self._log.write(Interrupted(why=error.message))
            raise
        finally:
            self.moving = False
            self._bus.emit(events.RobotChanged(self.robot))

    async def _cut_off(self, task: "asyncio.Future[Any]") -> None:
        try:
            self._log.write(Interrupted(why="cancelled"))
        finally:
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError, KempelenError):
                await task
