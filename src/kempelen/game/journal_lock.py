"""One writer for a journal, ever: a lock that the kernel lets go of when its holder dies, however it dies."""

import fcntl
import os
import sys
from pathlib import Path

from kempelen.core.errors import JournalError


class WriterLock:
    """An exclusive lock on ``<journal>.lock``, in which its holder's process id and name stand.

    Raises:
        JournalError: Another process holds it.
    """

    def __init__(self, journal: Path) -> None:
        self._path = journal.with_name(f"{journal.name}.lock")
        self._handle = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            holder = os.pread(self._handle, 300, 0).decode(errors="replace").strip() or "of unknown id"
            os.close(self._handle)
            raise JournalError(
                f"The journal {journal} is in use by process {holder}.",
                hint="End that program first, or name another journal with --data-dir.",
            ) from error
        os.ftruncate(self._handle, 0)
        os.pwrite(self._handle, f"{os.getpid()} ({Path(sys.argv[0]).name or 'python'})\n".encode(), 0)

    def release(self) -> None:
        """Let the next writer in."""
        os.close(self._handle)
