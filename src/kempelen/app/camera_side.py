"""At which side of its picture each camera has seen White sit: in an endgame the few men may not tell."""

import json
from contextlib import suppress
from pathlib import Path

from kempelen.app.files import replace_file
from kempelen.core.geometry import Array
from kempelen.sensing.board.orientation import Side


def side_of(corners: Array) -> str:
    """Where White sits.

    Args:
        corners: (4, 2) pixels of the outer corners of a1, h1, h8 and a8.
    """
    across, down = corners[:2].mean(axis=0) - corners[2:].mean(axis=0)
    if abs(across) > abs(down):
        return str(Side.RIGHT if across > 0 else Side.LEFT)
    return str(Side.BOTTOM if down > 0 else Side.TOP)


class KnownSides:
    """A small file. It is a memory and nothing more: unreadable is as good as empty.

    Args:
        path: Of the file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def get(self, camera: str) -> str:
        """The side; empty when it is not known."""
        side = self._read().get(camera, "")
        return side if side in set(Side) else ""

    def put(self, camera: str, side: str) -> None:
        """Remember it."""
        known = self._read()
        if known.get(camera) != side:
            with suppress(OSError):
                replace_file(self._path, json.dumps({**known, camera: side}, indent=2) + "\n")

    def _read(self) -> dict[str, str]:
        try:
            known = json.loads(self._path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return known if isinstance(known, dict) else {}
