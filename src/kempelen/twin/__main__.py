"""The twin's process: its spec is the first line of standard input, whose end means that nobody needs it."""

import json
import os
import sys

from kempelen.core.errors import KempelenError
from kempelen.twin.loop import TwinLoop
from kempelen.twin.spec import TwinSpec


def _first_line() -> bytes:
    """Byte by byte, so that nothing after it is buffered: the loop watches the descriptor itself."""
    line = bytearray()
    while not line.endswith(b"\n") and (byte := os.read(sys.stdin.fileno(), 1)):
        line += byte
    return bytes(line)


def main() -> int:
    """Read the spec, say where the wire is, run."""
    try:
        spec = TwinSpec.model_validate_json(_first_line())
        loop = TwinLoop(spec, alive=sys.stdin.fileno())
    except (KempelenError, ValueError) as error:
        print(json.dumps({"error": str(error)}), flush=True)  # noqa: T201 - the parent reads it
        return 1
    print(json.dumps({"address": loop.address}), flush=True)  # noqa: T201 - the parent reads it
    loop.run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
