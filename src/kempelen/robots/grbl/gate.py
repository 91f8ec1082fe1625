"""Pausing and ending: who may go on, and when a job that was ended may return."""

import asyncio

from kempelen.core.errors import StoppedError


class Gate:
    """Stands before every motion; `hold` shuts it, `cancel` and `stop` end whoever is behind it.

    Attributes:
        ending: Why the job at work must end; None while it may go on.
    """

    def __init__(self) -> None:
        self._open = asyncio.Event()
        self._calm = asyncio.Event()  # cleared while a cancel or a stop is bringing the machine to rest
        self.reset()

    def reset(self) -> None:
        """Open, calm, nothing ending."""
        self.ending: StoppedError | None = None
        self._open.set()
        self._calm.set()

    @property
    def calm(self) -> bool:
        """Whether no cancel or stop is under way."""
        return self._calm.is_set()

    async def wait(self) -> None:
        """Until open.

        Raises:
            StoppedError: the job was ended meanwhile.
        """
        await self._open.wait()
        if self.ending is not None:
            raise self.ending

    async def calmed(self) -> None:
        """Until the cancel or the stop under way has brought the machine to rest."""
        await self._calm.wait()

    def begin(self) -> None:
        """A new job: whatever ended the one before is past."""
        self.ending = None

    def shut(self) -> None:
        """Pause."""
        self._open.clear()

    def open(self) -> None:
        """Go on."""
        self._open.set()

    def end(self, error: StoppedError) -> None:
        """The job at work must end with ``error``, once `rested` has been called."""
        self._calm.clear()
        self.ending = error

    def rested(self) -> None:
        """The machine is at rest."""
        self._calm.set()
        self._open.set()
