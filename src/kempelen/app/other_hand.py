"""Hands at a table, and one that leaves the work to another."""

from typing import Protocol

from kempelen.core.places import Layout, Transfer
from kempelen.core.protocols import Hand, OnCheckpoint, RobotState, TransferReport
from kempelen.core.table import Table


class TableHand(Hand, Protocol):
    """A hand at a table, as the drivers' packages have it.

    Attributes:
        table: Where everything is; may be replaced between transfers.
    """

    table: Table

    def seconds_left(self, pace: float = 1.0) -> float | None:
        """Until the group of motions at hand should end, s; None when nothing is being driven."""
        ...


class OtherHand:
    """Implements `TableHand` by another one: what a subclass does not see to itself is done as that does it.

    Args:
        hand: Does the work.
    """

    def __init__(self, hand: TableHand) -> None:
        self._hand = hand

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
        """As `Hand.carry`."""
        return await self._hand.carry(transfer, standing, checkpoint)

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
