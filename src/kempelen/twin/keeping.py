"""The table while no process runs it: like a real one, it stays as it was.

The controller counts as powered throughout, so what it knew it still knows.
"""

import fcntl
import json
import os
import time
from pathlib import Path
from typing import Any, TextIO

from kempelen.core.errors import TwinError
from kempelen.twin.grbl import VirtualGrbl
from kempelen.twin.physics.world import World

VERSION = 1
_WAIT_S = 45.0


class StateLock:
    """Only one process runs a table; the next waits until the last has put it away.

    Args:
        path: Of the state file; the lock lies beside it.

    Raises:
        TwinError: another process goes on using the table.
    """

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file: TextIO = path.with_suffix(".lock").open("a+")
        end = time.monotonic() + _WAIT_S
        while not self._try():
            if time.monotonic() > end:
                self._file.close()
                raise TwinError(
                    f"Another twin is running the table kept in {path}.",
                    hint="End the program that uses it, or choose another --data-dir.",
                )
            time.sleep(0.02)

    def _try(self) -> bool:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True

    def release(self) -> None:
        """Let the next one have it."""
        self._file.close()


def save_state(path: Path, controller: VirtualGrbl, world: World) -> None:
    """Write atomically."""
    state = {"version": VERSION, "controller": controller.snapshot(), "world": world.snapshot().decode()}
    temporary = path.with_suffix(".new")
    with temporary.open("w") as file:
        json.dump(state, file)
        file.flush()
        os.fsync(file.fileno())
    temporary.replace(path)


def load_state(path: Path, controller: VirtualGrbl, world: World) -> None:
    """Continue from a saved table.

    Raises:
        TwinError: there is none, or it is damaged or of another version or set of pieces.
    """
    hint = "Start a new game; the pieces are then set up afresh."
    try:
        state: dict[str, Any] = json.loads(path.read_text())
        if state["version"] != VERSION:
            raise TwinError(
                f"{path} is of version {state['version']}, this program reads {VERSION}.", hint=hint
            )
        controller.restore(state["controller"])
        world.restore(state["world"].encode())
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise TwinError(f"The table kept in {path} cannot be read: {error!r}.", hint=hint) from None
