"""The bridge's end of a frame: ``number letter values*CCCC``, CRC-16/CCITT-FALSE in hexadecimal."""

from binascii import crc_hqx
from collections.abc import Callable

Answer = Callable[[], bool] | None
"""When a command is done: at once, or when asked again later."""
_CHECKSUM = 5  # "*" and four digits


class Refused(Exception):  # noqa: N818 - an answer on the wire, not a fault of the program
    """A line that the bridge does not take.

    Args:
        code: Of the error.
    """

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


def frame(text: str) -> bytes:
    """A line to the host."""
    body = text.encode("ascii")
    return b"%b*%04X\r\n" % (body, crc_hqx(body, 0xFFFF))


def command(line: bytes) -> tuple[int, str, tuple[int, ...]]:
    """Number, letter and values of a line from the host; a resume has no number.

    Raises:
        Refused: its checksum is not right, or it is no command.
    """
    body, given = line[:-_CHECKSUM], line[-_CHECKSUM:]
    if given != b"*%04X" % crc_hqx(body, 0xFFFF):
        raise Refused(101)
    if body == b"~":
        return 0, "~", ()
    try:
        number, letter, *values = body.decode("ascii").split(" ")
        return int(number), letter, tuple(map(int, values))
    except (ValueError, UnicodeDecodeError):
        raise Refused(1) from None
