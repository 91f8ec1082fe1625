"""The hand, timed on the clock of the world that it works in."""

from dataclasses import replace

from kempelen.core.places import Layout, Transfer
from kempelen.core.protocols import Checkpoint, OnCheckpoint, TransferReport
from kempelen.robots.hand import CartesianHand
from kempelen.twin.client import TwinControl


class TimedHand(CartesianHand):
    """Measures on the twin's clock, which runs at another pace than the wall's; on a machine as it is.

    Attributes:
        control: The twin's side door; only the times in the reports come from there.
    """

    control: TwinControl | None = None

    async def carry(self, transfer: Transfer, standing: Layout, checkpoint: OnCheckpoint) -> TransferReport:
        """As `CartesianHand.carry`; the report's times are the robot's own."""
        if self.control is None:
            return await super().carry(transfer, standing, checkpoint)
        control, times = self.control, dict[Checkpoint, float]()

        async def marked(reached: Checkpoint) -> None:
            times[reached] = float((await control.ask("stats"))["busy_s"])
            await checkpoint(reached)

        report = await super().carry(transfer, standing, marked)
        released = times[Checkpoint.RELEASED]
        return replace(
            report,
            seconds=released - times[Checkpoint.GRIPPING],
            carry=released - times[Checkpoint.CARRYING],
        )
