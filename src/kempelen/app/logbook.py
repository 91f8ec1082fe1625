"""What was said lately, in memory and bounded: lines on the robot's wire, and the program's own log.

Both are handlers of the standard library's logging, hung in while somebody may want to look (`kept`). Each
entry has a number, so that whoever comes again asks for what is newer.
"""

import logging
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

from kempelen.app.discreet import without_secrets
from kempelen.robots.transport import WIRE

WIRE_LINES = 20_000
LOG_LINES = 2_000
_LONGEST = 400  # characters of a line; a device that never sends a newline fills no memory
_NAMES = {0x18: "reset", 0x84: "safety door", 0x85: "jog cancel"}
_REALTIME = frozenset({*b"?!~\x18", *range(0x80, 0x100)})

Way = Literal["out", "in"]
_Entry = TypeVar("_Entry", "Heard", "Noted")


@dataclass(frozen=True, slots=True)
class Heard:
    """A line on the robot's wire.

    Attributes:
        number: From 1, in order.
        at: s since the epoch.
        way: ``out`` to the robot, ``in`` from it.
        text: Without its newline; real-time bytes by name.
    """

    number: int
    at: float
    way: Way
    text: str


@dataclass(frozen=True, slots=True)
class Noted:
    """A record of the program's log.

    Attributes:
        number: From 1, in order.
        at: s since the epoch.
        level: ``DEBUG``, ``INFO``, ``WARNING``, ``ERROR`` or ``CRITICAL``.
        name: Of the part of the program that says it.
        text: Without directories and secrets.
    """

    number: int
    at: float
    level: str
    name: str
    text: str


class _Ring(Generic[_Entry]):
    """The newest entries, and whoever wants each at once.

    Args:
        size: How many are kept.

    Attributes:
        listeners: Called with each new entry, in the thread that made it.
    """

    def __init__(self, size: int) -> None:
        self._entries: deque[_Entry] = deque(maxlen=size)
        self._count = 0
        self.listeners: list[Callable[[_Entry], None]] = []

    def next_number(self) -> int:
        self._count += 1
        return self._count

    def add(self, entry: _Entry) -> None:
        self._entries.append(entry)
        for listener in self.listeners:
            listener(entry)

    def find(self, after: int, limit: int, match: str) -> list[_Entry]:
        """The newest ``limit`` after a number that hold a text, capitals or not; oldest first."""
        wanted = match.casefold()
        found: list[_Entry] = []
        for entry in reversed(self._entries):
            if entry.number <= after or len(found) == limit:
                break
            if wanted in entry.text.casefold():
                found.append(entry)
        return found[::-1]


class WireLog(logging.Handler):
    """Lines on the robot's wire.

    Attributes:
        ring: They are kept there.
    """

    def __init__(self, size: int = WIRE_LINES) -> None:
        super().__init__(logging.DEBUG)
        self.ring: _Ring[Heard] = _Ring(size)
        self._part: dict[Way, bytes] = {"out": b"", "in": b""}

    def emit(self, record: logging.LogRecord) -> None:
        """Take what went over the wire."""
        match record.args:
            case ("out" | "in" as way, bytes(data)):
                for text in self._lines(way, data):
                    self.ring.add(Heard(self.ring.next_number(), record.created, way, text))

    def _lines(self, way: Way, data: bytes) -> Iterator[str]:
        if way == "out" and _REALTIME.issuperset(data):  # they go past all lines, so they end none
            yield from map(_realtime, data)
            return
        *whole, rest = (self._part[way] + data).split(b"\n")
        for line in whole:
            if text := _printable(line):
                yield text
        self._part[way] = rest[:_LONGEST]


class ProgramLog(logging.Handler):
    """What the program says of itself.

    Attributes:
        ring: Records are kept there.
    """

    def __init__(self, size: int = LOG_LINES) -> None:
        super().__init__(logging.INFO)
        self.ring: _Ring[Noted] = _Ring(size)

    def emit(self, record: logging.LogRecord) -> None:
        """Take a record."""
        text = without_secrets(record.getMessage())
        if record.exc_info and record.exc_info[0] is not None:
            text += f" ({record.exc_info[0].__name__}: {without_secrets(str(record.exc_info[1]))})"
        number = self.ring.next_number()
        self.ring.add(Noted(number, record.created, record.levelname, record.name, text[: 5 * _LONGEST]))


@dataclass(frozen=True, slots=True)
class Logbook:
    """Both logs."""

    wire: WireLog
    program: ProgramLog


@contextmanager
def kept() -> Iterator[Logbook]:
    """Keep a logbook from now on."""
    book = Logbook(WireLog(), ProgramLog())
    wire, program = logging.getLogger(WIRE), logging.getLogger("kempelen")
    before = wire.level, wire.propagate, program.level
    wire.setLevel(logging.DEBUG)
    wire.propagate = False
    program.setLevel(min(program.getEffectiveLevel(), logging.INFO))
    wire.addHandler(book.wire)
    logging.getLogger().addHandler(book.program)
    try:
        yield book
    finally:
        wire.removeHandler(book.wire)
        logging.getLogger().removeHandler(book.program)
        wire.setLevel(before[0])
        wire.propagate = before[1]
        program.setLevel(before[2])


def _printable(line: bytes) -> str:
    text = line.rstrip(b"\r")[:_LONGEST].decode("ascii", "backslashreplace")
    return "".join(letter if letter.isprintable() else f"\\x{ord(letter):02x}" for letter in text)


def _realtime(byte: int) -> str:
    name = _NAMES.get(byte)
    if name:
        return f"<{name} 0x{byte:02X}>"
    return chr(byte) if chr(byte).isprintable() and byte < 0x80 else f"<0x{byte:02X}>"  # noqa: PLR2004 - ASCII
