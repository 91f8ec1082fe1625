"""The twin's process: its spec is the first line of standard input, whose end means that the parent is gone."""

import json
import sys

from kempelen.core.errors import KempelenError
from kempelen.twin.loop import TwinLoop
from kempelen.twin.spec import TwinSpec


def main() -> int:
    """Read the spec, say where the wire is, run."""
    try:
        spec = TwinSpec.model_validate_json(sys.stdin.buffer.raw.readline())  # type: ignore[attr-defined]
        loop = TwinLoop(spec, alive=sys.stdin.fileno())
    except (KempelenError, ValueError) as error:
        print(json.dumps({"error": str(error)}), flush=True)  # noqa: T201 - the parent reads it
        return 1
    print(json.dumps({"address": loop.address}), flush=True)  # noqa: T201 - the parent reads it
    loop.run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
