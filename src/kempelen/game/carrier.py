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
from kempelen.game.records import HandEmpty, Interrupted, Step
from kempelen.game.state import Pending
from kempelen.game.tasks import Gate

T = TypeVar("T")


async def _nothing_new(checkpoint: Checkpoint) -> None:
    """The journal has it that the piece stands there."""
    del checkpoint


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

    async def ready(self) -> None:
        """Returns when the game is not paused."""
        await self._gate.passed()

    async def carry(self, transfer: Transfer) -> None:
        """Make the transfer at hand, once the game is not paused."""
        await self.ready()
        pending = self.pending
        self._bus.emit(events.TransferStarted(transfer, pending.index + 1, len(pending.transfers)))
        standing = self._log.state.layout
        report = await self._guarded(lambda: self.hand.carry(transfer, standing, self._reached))
        self._arrived(transfer, report)

    async def finish_held(self, transfer: Transfer) -> None:
        """Put the piece of the transfer at hand, which is in the gripper after an exit, on its target."""
        if not self.pending.carrying:
            await self._reached(Checkpoint.CARRYING)
        standing = self._log.state.layout.without(transfer.source)
        await self._guarded(lambda: self.hand.finish_held(transfer, standing, self._reached))
        self._arrived(transfer, None)

    async def released(self, transfer: Transfer) -> None:
        """The piece of the transfer at hand was found on its target after an exit."""
        await self._reached(Checkpoint.RELEASED)
        self._arrived(transfer, None)

    async def put_back(self, done: Transfer) -> None:
        """The gripper fell shut around the piece of a finished transfer: put it where it had stood."""
        standing = self._log.state.layout.without(done.target)
        again = Transfer(done.piece, done.target, done.target)
        await self._free(lambda: self.hand.finish_held(again, standing, _nothing_new))

    async def prepare(self) -> None:
        """Homed, empty, open and parked."""
        await self._free(self.hand.prepare)
        self.is_empty()

    async def park(self) -> None:
        """High, clear of the camera."""
        await self._free(lambda: self.hand.park(self._log.state.layout))
        self.is_empty()

    def is_empty(self) -> None:
        """The hand holds nothing and is around nothing; the journal may know it already."""
        state = self._log.state
        busy = state.pending is not None and state.pending.checkpoint is not None
        if busy or state.around is not None:
            self._log.write(HandEmpty())

    def _arrived(self, transfer: Transfer, report: TransferReport | None) -> None:
        self._bus.emit(events.TransferDone(transfer, self._log.state.layout, report))

    async def _reached(self, checkpoint: Checkpoint) -> None:
        """The hand has come to a checkpoint: on disk first; then, unless the game is paused, on."""
        index = self.pending.index
        self._log.write(Step(index=index, checkpoint=checkpoint))
        self._bus.emit(events.CheckpointReached(self.pending.transfers[index], checkpoint))
        self._bus.emit(events.RobotChanged(self.robot))
        await self._gate.passed()

    async def _free(self, motion: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Run a motion that changes nothing in the game."""
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
        except Exception as error:
            self._log.write(Interrupted(why=str(error)))
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
