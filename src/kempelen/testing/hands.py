"""A table with pieces, a hand and a person, without physics: where the pieces truly are.

`FakeTable` is the world, `FakeHand` a machine that reaches into it, `FakePerson` somebody who sits there. The
world outlives hands, as a table outlives programs: kill the program at any `FakeTable.before_step`, let the
controller coast on what it had been sent, or reset it, and connect a new `FakeHand`. Whatever would be an
accident on a real table, a piece dropped or hit, is an `AssertionError`.
"""

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Sequence

import chess

from kempelen.core.errors import StoppedError
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.protocols import (
    Checkpoint,
    GripperState,
    OnCheckpoint,
    RobotPhase,
    RobotState,
    TransferReport,
)

Step = tuple[str, Place | None]
BeforeStep = Callable[[Step], Awaitable[None]]


async def _yield(step: Step) -> None:
    """Let other tasks run."""
    del step
    await asyncio.sleep(0)


class FakeTable:
    """Pieces, a gripper and a controller.

    Attributes:
        standing: What truly stands where.
        held: The piece between the fingers.
        down_at: The place above which the hand is down; None: high.
        closed: Whether the gripper is closed.
        was_reset: Whether the controller lost its memory since it was last homed.
        sent: Motions that the controller has, and the program has not seen done.
        before_step: Awaited before each of them.
        cancel_closes: Whether a cancelled motion ends in a soft reset, which lets the gripper fall shut while
            the controller keeps its memory, as GRBL does.
        slips: Places from which the next grip misses its piece.
        disturbed: Whether the table may differ from what the hand is told: something slipped or was upset.
    """

    def __init__(self, layout: Layout, before_step: BeforeStep = _yield) -> None:
        self.standing: dict[Place, chess.Piece] = dict(layout)
        self.held: chess.Piece | None = None
        self.down_at: Place | None = None
        self.closed = True
        self.was_reset = True
        self.sent: deque[Step] = deque()
        self.before_step = before_step
        self.cancel_closes = False
        self.slips: set[Place] = set()
        self.disturbed = False

    @property
    def layout(self) -> Layout:
        """What truly stands where."""
        return Layout(self.standing)

    def execute(self, step: Step) -> None:
        """One motion of the machine."""
        name, place = step
        match name:
            case "down":
                self._go_down(place)
            case "up":
                self.down_at = None
            case "close":
                self._close()
            case _:
                self._open()

    def _go_down(self, place: Place | None) -> None:
        taken = place in self.standing
        assert not (taken and self.closed), (
            f"the closed gripper, holding {self.held}, hits what is on {place}"
        )
        self.down_at = place

    def _close(self) -> None:
        self.closed = True
        if self.down_at in self.slips:
            self.slips.discard(self.down_at)
            self.disturbed = True
        elif self.held is None and self.down_at in self.standing:
            self.held = self.standing.pop(self.down_at)

    def _open(self) -> None:
        if self.held is not None:
            assert self.down_at is not None, f"the {self.held} was dropped"
            self.standing[self.down_at] = self.held
        self.held, self.closed = None, False

    def coast(self, steps: int) -> None:
        """The program is gone; the controller finishes up to ``steps`` motions that it had been sent."""
        for _ in range(min(steps, len(self.sent))):
            self.execute(self.sent.popleft())
        self.sent.clear()

    def cancel(self) -> None:
        """The program wants no more of what it sent."""
        self.sent.clear()
        if self.cancel_closes:
            self._close()

    def reset(self) -> None:
        """The controller restarts: its gripper falls shut, around whatever is there."""
        self.sent.clear()
        self.was_reset = True
        self._close()


class FakeHand:
    """Carries pieces on a `FakeTable`, with the checkpoints and the rules of a real hand.

    Attributes:
        carried: Transfers whose piece arrived, in order.
        parked: How often the hand was parked.
    """

    def __init__(self, table: FakeTable) -> None:
        self.table = table
        self.carried: list[Transfer] = []
        self.parked = 0
        self._running = asyncio.Event()
        self._running.set()
        self._stopped = False
        self._kept = not table.was_reset
        self._homed = False

    @property
    def state(self) -> RobotState:
        """As a driver would report it."""
        known = self._kept or self._homed
        closed = GripperState.CLOSED if self.table.closed else GripperState.OPEN
        return RobotState(
            phase=RobotPhase.IDLE if self._running.is_set() else RobotPhase.HELD,
            homed=self._homed,
            gripper=closed if known else GripperState.UNKNOWN,
            memory_kept=self._kept,
        )

    async def prepare(self) -> None:
        """Home and open; a held piece would fall."""
        await self._may_run()
        assert self.table.held is None, f"prepare() would drop the {self.table.held}"
        await self._home()
        await self._run(("open", None))

    async def carry(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> TransferReport:
        """Carry a piece; the caller must know exactly what stands where."""
        await self._may_run()
        self._agree(standing)
        assert not self.table.closed, "the gripper must be open before a transfer"
        await checkpoint(Checkpoint.GRIPPING)
        await self._run(("up", None), ("down", transfer.source), ("close", None))
        missed = self.table.held is None and self.table.disturbed
        assert missed or self.table.held == transfer.piece, (
            f"gripped {self.table.held}, wanted {transfer.piece}"
        )
        await checkpoint(Checkpoint.CARRYING)
        await self._put_down(transfer, checkpoint)
        return TransferReport(transfer, seconds=3.0, predicted=3.0, bound=2.0, carry=1.5)

    async def finish_held(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> None:
        """Home with the piece and put it on its target."""
        await self._may_run()
        self._agree(standing)
        assert self.table.held == transfer.piece, f"{self.table.held} is held, not {transfer.piece}"
        await self._home()
        await self._put_down(transfer, checkpoint)

    async def _home(self) -> None:
        """Up first; from now on the controller remembers again."""
        await self._run(("up", None))
        self._homed = True
        self.table.was_reset = False

    async def _put_down(self, transfer: Transfer, checkpoint: OnCheckpoint) -> None:
        await self._run(("up", None), ("down", transfer.target), ("open", None))
        await checkpoint(Checkpoint.RELEASED)
        self.carried.append(transfer)

    def _agree(self, standing: Layout) -> None:
        self.table.disturbed &= standing != self.table.layout
        assert self.table.disturbed or standing == self.table.layout, (
            f"believed {standing}, truly {self.table.layout}"
        )

    async def park(self, standing: Layout) -> None:
        """Out of the way."""
        await self._may_run()
        self._agree(standing)
        await self._run(("up", None))
        self.parked += 1

    async def hold(self) -> None:
        """Rest before the next motion."""
        self._running.clear()

    async def resume(self) -> None:
        """Go on."""
        self._running.set()

    async def stop(self) -> None:
        """Reset the controller; homing is needed."""
        self._stopped = True
        self.table.reset()
        self._running.set()

    async def _may_run(self) -> None:
        await self._running.wait()
        if self._stopped:
            raise StoppedError("The hand was stopped.", hint="Home it.")

    async def _run(self, *steps: Step) -> None:
        self.table.sent.extend(steps)
        try:
            while self.table.sent:
                await self.table.before_step(self.table.sent[0])
                await self._may_run()
                self.table.execute(self.table.sent.popleft())
        except (asyncio.CancelledError, StoppedError):
            self.table.cancel()
            raise


class FakePerson:
    """Somebody at a `FakeTable` who does what is asked, and nothing twice.

    Attributes:
        requests: What was asked, in words.
        tidied: How the table is once it was put right; None: nobody does that.
    """

    def __init__(self, table: FakeTable) -> None:
        self.table = table
        self.requests: list[str] = []
        self.tidied: Callable[[], Layout] | None = None

    async def carry(self, transfers: Sequence[Transfer]) -> None:
        """By hand, what is not yet done."""
        self.requests.append("carry " + ", ".join(map(str, transfers)))
        for transfer in transfers:
            await self.table.before_step(("hand", transfer.source))
            if self.table.standing.get(transfer.target) != transfer.piece:
                self.table.standing[transfer.target] = self.table.standing.pop(transfer.source)

    async def supply(self, piece: chess.Piece, place: Place, reason: str) -> None:
        """From the box."""
        self.requests.append(f"supply {piece.symbol()} {place}: {reason}")
        await self.table.before_step(("supply", place))
        self.table.standing[place] = piece

    async def remove(self, piece: chess.Piece, place: Place, reason: str) -> None:
        """Into the box."""
        self.requests.append(f"remove {piece.symbol()} {place}: {reason}")
        await self.table.before_step(("remove", place))
        self.table.standing.pop(place, None)

    async def put_right(self, request: str) -> None:
        """Nothing is wrong on this table but what a test does to it; without ``tidied`` it takes long."""
        self.requests.append(request)
        if self.tidied is None:
            await asyncio.Event().wait()
        else:
            self.table.standing = dict(self.tidied())

    async def is_holding(self, piece: chess.Piece) -> bool:
        """Look."""
        self.requests.append(f"is {piece.symbol()} held?")
        await self.table.before_step(("look", None))
        return self.table.held == piece
