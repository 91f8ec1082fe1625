"""The hand, timed on the clock of the world that it works in."""

from dataclasses import replace
from typing import Protocol

from kempelen.core.places import Layout, Transfer
from kempelen.core.protocols import (
    Checkpoint,
    Hand,
    OnCheckpoint,
    RobotState,
    TransferReport,
)
from kempelen.core.table import Table
from kempelen.twin.client import Door


class TableHand(Hand, Protocol):
    """A hand at a table, as the drivers' packages have it.

    Attributes:
        table: Where everything is; may be replaced between transfers.
    """

    table: Table

    def seconds_left(self, pace: float = 1.0) -> float | None:
        """Until the group of motions at hand should end, s; None when nothing is being driven."""
        ...


class TimedHand:
    """A hand that measures on the twin's clock, which runs at another pace than the wall's.

    Args:
        hand: Does the work.
        control: The twin's side door; only the times in the reports come from there. None on a machine: the
            reports are the hand's own.
    """

    def __init__(self, hand: TableHand, control: Door | None = None) -> None:
        self._hand = hand
        self.control = control

    @property
    def state(self) -> RobotState:
        """The robot's latest snapshot."""
        return self._hand.state

    @property
    def table(self) -> Table:
        """Where everything is."""
        return self._hand.table

    @table.setter
    def table(self, table: Table) -> None:
        self._hand.table = table

    def seconds_left(self, pace: float = 1.0) -> float | None:
        """As the hand has it."""
        return self._hand.seconds_left(pace)

    async def prepare(self) -> None:
        """As `Hand.prepare`."""
        await self._hand.prepare()

    async def carry(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> TransferReport:
        """As `Hand.carry`; the report's times are the robot's own."""
        if self.control is None:
            return await self._hand.carry(transfer, standing, checkpoint)
        control, times = self.control, dict[Checkpoint, float]()

        async def marked(reached: Checkpoint) -> None:
            times[reached] = float((await control.ask("stats"))["busy_s"])
            await checkpoint(reached)

        report = await self._hand.carry(transfer, standing, marked)
        released = times[Checkpoint.RELEASED]
        return replace(
            report,
            seconds=released - times[Checkpoint.GRIPPING],
            carry=released - times[Checkpoint.CARRYING],
        )

    async def finish_held(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> None:
        """As `Hand.finish_held`."""
        await self._hand.finish_held(transfer, standing, checkpoint)

    async def park(self, standing: Layout) -> None:
        """As `Hand.park`."""
        await self._hand.park(standing)

    async def hold(self) -> None:
        """As `Hand.hold`."""
        await self._hand.hold()

    async def resume(self) -> None:
        """As `Hand.resume`."""
        await self._hand.resume()

    async def stop(self) -> None:
        """As `Hand.stop`."""
        await self._hand.stop()
