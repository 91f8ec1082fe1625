"""The table while no process runs it: like a real one, it stays as it was.

The controller counts as powered throughout, so what it knew it still knows. The file exists only while the
table is put away: it is removed before the table changes for the first time, and written when its process
ends. If that process is killed itself, its table is gone, and no older state can be mistaken for it.
"""

import asyncio
import fcntl
import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TextIO

from kempelen.core.errors import TwinError

if TYPE_CHECKING:  # the program at this end keeps the file's lock, and needs no physics for it
    from kempelen.twin.physics.world import World

VERSION = 2
_WAIT_S = 45.0
_POLL_S = 0.02


class Keepable(Protocol):
    """A controller and what it drives."""

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """The inverse of `snapshot`."""
        ...


class StateLock:
    """Only one process runs a table; the next waits until the last has put it away.

    Args:
        path: Of the state file; the lock lies beside it.
        wanted: Whether this process's table is still wanted. Who waited and is not wanted any more must not
            touch what belongs to a later one by now.

    Raises:
        TwinError: another process goes on using the table, or nobody wants this one's.
    """

    def __init__(self, path: Path, wanted: Callable[[], bool] = lambda: True) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file: TextIO = path.with_suffix(".lock").open("a+")
        try:
            self._take(path, wanted)
        except BaseException:
            self._file.close()
            raise

    def _take(self, path: Path, wanted: Callable[[], bool]) -> None:
        end = time.monotonic() + _WAIT_S
        taken = False
        while not taken:
            taken = _locked(self._file)
            if not wanted():
                raise TwinError("The program that started this twin has ended.", hint="Nothing was touched.")
            if not taken:
                self._wait_a_little(path, end)

    @staticmethod
    def _wait_a_little(path: Path, end: float) -> None:
        if time.monotonic() > end:
            raise _in_use(path)
        time.sleep(_POLL_S)

    @classmethod
    async def released(cls, path: Path) -> None:
        """Wait until no process runs the table.

        Raises:
            TwinError: another process goes on using it.
        """
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.with_suffix(".lock").open("a+") as file:
            end = time.monotonic() + _WAIT_S
            while not _locked(file):
                if time.monotonic() > end:
                    raise _in_use(path)
                await asyncio.sleep(_POLL_S)

    def release(self) -> None:
        """Let the next one have it."""
        self._file.close()


def _locked(file: TextIO) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _in_use(path: Path) -> TwinError:
    return TwinError(
        f"Another twin is running the table kept in {path}.",
        hint="End the program that uses it, or choose another --data-dir.",
    )


def save_state(path: Path, machine: Keepable, world: "World") -> None:
    """Write atomically.

    Raises:
        TwinError: it cannot be written; nothing is kept then.
    """
    state = {"version": VERSION, "controller": machine.snapshot(), "world": world.snapshot().decode()}
    temporary = path.with_suffix(".new")
    try:
        with temporary.open("w") as file:
            json.dump(state, file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        _sync(path.parent)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise TwinError(
            f"The twin's table cannot be kept in {path}: {error.strerror}.",
            hint="Make room or allow writing; the virtual person sets it up again when the game goes on.",
        ) from None


def forget_state(path: Path) -> None:
    """The table is about to change: what is kept will no longer be true."""
    path.unlink(missing_ok=True)
    _sync(path.parent)


def _sync(folder: Path) -> None:
    """The folder's names, too, are on disk when this returns."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def load_state(path: Path, machine: Keepable, world: "World") -> None:
    """Continue from a saved table.

    Raises:
        TwinError: there is none, or it is damaged or of another version or set of pieces.
    """
    hint = f"Delete {path}: the virtual person then sets the pieces up again as the journal has them."
    try:
        state: dict[str, Any] = json.loads(path.read_text())
        if state["version"] != VERSION:
            raise TwinError(
                f"{path} is of version {state['version']}, this program reads {VERSION}.", hint=hint
            )
        machine.restore(state["controller"])
        world.restore(state["world"].encode())
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise TwinError(f"The table kept in {path} cannot be read: {error!r}.", hint=hint) from None
