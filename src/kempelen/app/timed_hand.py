"""The hand, timed on the clock of the world that it works in."""

from dataclasses import replace

from kempelen.app.other_hand import OtherHand, TableHand
from kempelen.core.places import Layout, Transfer
from kempelen.core.protocols import Checkpoint, OnCheckpoint, TransferReport
from kempelen.twin.client import Door


class TimedHand(OtherHand):
    """A hand that measures on the twin's clock, which runs at another pace than the wall's.

    Args:
        hand: Does the work.
        control: The twin's side door; only the times in the reports come from there. None on a machine: the
            reports are the hand's own.
    """

    def __init__(self, hand: TableHand, control: Door | None = None) -> None:
        super().__init__(hand)
        self.control = control

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
