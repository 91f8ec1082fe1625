"""Numbers as GRBL reads them: a sign, digits, one point; no exponent, no spaces."""

import re

from kempelen.twin.grbl.gcode import GcodeError
from kempelen.twin.grbl.status import Status

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")


def read_number(text: str, at: int) -> tuple[float, int]:
    """The number at ``at`` and where it ends.

    Raises:
        GcodeError: there is none.
    """
    found = _NUMBER.match(text, at)
    if found is None:
        raise GcodeError(Status.BAD_NUMBER_FORMAT)
    return float(found.group()), found.end()
