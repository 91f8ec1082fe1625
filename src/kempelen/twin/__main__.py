"""The twin's process: its spec is the first line of standard input, whose end means that nobody needs it."""

import json
import os
import sys
from contextlib import suppress
from pathlib import Path

from kempelen.core.errors import KempelenError
from kempelen.twin.loop import TwinLoop
from kempelen.twin.spec import CONTROL_FOLDER, TwinSpec


def _first_line() -> bytes:
    """Byte by byte, so that nothing after it is buffered: the loop watches the descriptor itself."""
    line = bytearray()
    while not line.endswith(b"\n") and (byte := os.read(sys.stdin.fileno(), 1)):
        line += byte
    return bytes(line)


def _tell(answer: dict[str, str | list[str]]) -> None:
    """To the parent, if it is still there."""
    with suppress(BrokenPipeError):
        os.write(sys.stdout.fileno(), json.dumps(answer).encode() + b"\n")


def _tidy(folder: Path) -> None:
    """What a parent has made for the socket alone, it cannot remove when it was killed."""
    if folder.name.startswith(CONTROL_FOLDER):
        with suppress(OSError):
            folder.rmdir()


def main() -> int:
    """Read the spec, say where the wire is, run."""
    line = _first_line()
    if not line.endswith(b"\n"):
        return 1  # the parent died before it had said what it wanted
    try:
        spec = TwinSpec.model_validate_json(line)
    except ValueError as error:
        _tell({"error": str(error)})
        return 1
    try:
        return _run(spec)
    finally:
        _tidy(Path(spec.control).parent)


def _run(spec: TwinSpec) -> int:
    try:
        loop = TwinLoop(spec, alive=sys.stdin.fileno())
    except KempelenError as error:
        _tell({"error": str(error)})
        return 1
    _tell({"address": loop.address, "rings": loop.rings, "reed": loop.reed})
    try:
        loop.run()
    except KempelenError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
