"""Closing the loop: does the table show what the journal says?

Without a board sensor the hand is trusted (`Trust`). With one, a verifier looks after each transfer.
"""

from typing import Protocol

from kempelen.core.places import Layout, Transfer


class Verifier(Protocol):
    """Compares the table with what should stand there."""

    async def confirm(self, transfer: Transfer | None, standing: Layout) -> str:
        """Look at the table.

        Args:
            transfer: The one just made; None after a person's own hand or the operator changed something.
            standing: What should stand where now.

        Returns:
            Empty when the table agrees; else one plain sentence that tells a person what to put right: "put
            the white knight back on f3".
        """
        ...


class Trust:
    """No sensor: what the hand reports is believed."""

    async def confirm(self, transfer: Transfer | None, standing: Layout) -> str:  # noqa: ARG002 - nothing to look at
        """Always agrees."""
        return ""
