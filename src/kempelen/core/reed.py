"""The reed board's line protocol: what its lines say, and how they are written and read. No I/O.

A line is ``BODY*CCCC`` and a newline, in ASCII; CCCC is the CRC-16/CCITT-FALSE of BODY in hexadecimal.
Squares are numbered a1 = 0, b1 = 1 ... h8 = 63; a set of squares is a 64-bit number, bit n for square n,
written with 16 hexadecimal digits. ``docs/reference/reed-board.md`` describes every line; both ends use
this module, and the firmware in ``firmware/reed-board`` is held against it by the tests.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Literal

PROTOCOL_VERSION = 1
PRODUCT = "kempelen-reed"
NUMBERS = 1 << 16
"""Events are numbered modulo this."""
LONGEST_LINE = 96
"""Bytes, without the newline; what is longer is no line of this protocol."""
ALL_SQUARES = (1 << 64) - 1
Sort = Literal["sneak", "chatter"]
_WHAT: tuple[Sort, ...] = ("sneak", "chatter")
_CRC_START, _CRC_POLYNOMIAL = 0xFFFF, 0x1021
_NAME = re.compile(r"[a-h][1-8]")


class Wiring(StrEnum):
    """How the switches are read."""

    DIODES = "diodes"  # matrix, a diode in series with every switch
    PLAIN = "plain"  # matrix without diodes
    DIRECT = "direct"  # every switch has an input of a multiplexer to itself


class Sound(StrEnum):
    """What the buzzer can say."""

    OFF = "off"
    OK = "ok"
    WARN = "warn"


@dataclass(frozen=True, slots=True)
class Hello:
    """The board's greeting.

    Attributes:
        version: Of the protocol.
        identity: Of this very board, 8 hexadecimal digits.
        wiring: How its switches are read.
        firmware: Its version.
    """

    version: int
    identity: str
    wiring: Wiring
    firmware: str = "1"
    product: str = PRODUCT


@dataclass(frozen=True, slots=True)
class Change:
    """A piece was set down on a square, or lifted off it.

    Attributes:
        number: Of the event, modulo `NUMBERS`.
        time: ms since the board was switched on, of the first edge.
        placed: Whether the switch has closed.
        doubtful: It has closed, and a current through other switches would explain that as well.
    """

    number: int
    time: int
    square: int
    placed: bool
    doubtful: bool = False


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All switches.

    Attributes:
        number: Of the last event before it.
        time: ms since the board was switched on.
        closed: Squares whose switch reads closed.
        doubtful: Those of them that other closed switches may only feign.
        mark: Of the host's last `Ask`: what was read after it is told from what was on its way already.
    """

    number: int
    time: int
    closed: int
    doubtful: int = 0
    mark: int = 0


@dataclass(frozen=True, slots=True)
class Finding:
    """Something is wrong with the switches themselves.

    Attributes:
        number: Of the event.
        time: ms.
        what: ``sneak``: a current flows back through one of the squares, so that its diode is missing;
            ``chatter``: the switch does not come to rest.
        squares: One of them, or all.
    """

    number: int
    time: int
    what: Sort
    squares: int


@dataclass(frozen=True, slots=True)
class Refusal:
    """A line that the board could not follow: ``checksum``, ``unknown``, ``range`` or ``long``."""

    why: str


@dataclass(frozen=True, slots=True)
class Ask:
    """The host wants a greeting (H), or a snapshot (S) with its mark, modulo `NUMBERS`."""

    what: Literal["H", "S"]
    mark: int = 0


@dataclass(frozen=True, slots=True)
class Lamps:
    """Light these squares and no others."""

    squares: int


@dataclass(frozen=True, slots=True)
class Buzz:
    """Make a sound."""

    sound: Sound


Message = Hello | Change | Snapshot | Finding | Refusal | Ask | Lamps | Buzz


def checksum(body: bytes) -> int:
    """CRC-16/CCITT-FALSE (ITU-T V.41's polynomial, all ones at first)."""
    crc = _CRC_START
    for byte in body:
        crc = crc << 8 & 0xFFFF ^ _CRC_TABLE[crc >> 8 ^ byte]
    return crc


def _crc_of(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = ((crc << 1) ^ (_CRC_POLYNOMIAL if crc & 0x8000 else 0)) & 0xFFFF
    return crc


_CRC_TABLE = [_crc_of(byte) for byte in range(256)]


def square_name(square: int) -> str:
    """``e4`` for 28."""
    return f"{'abcdefgh'[square & 7]}{(square >> 3) + 1}"


def squares_in(mask: int) -> Iterator[int]:
    """Squares of a set, lowest first."""
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


def encode(message: Message) -> bytes:
    """The whole line, newline included."""
    body = _body(message).encode("ascii")
    return b"%s*%04X\n" % (body, checksum(body))


def _body(message: Message) -> str:
    return _WRITERS[type(message)](message)


_WRITERS: dict[type, Callable[[Any], str]] = {
    Hello: lambda m: f"H {m.version} {m.product} {m.identity} {m.wiring} {m.firmware}",
    Change: lambda m: (
        f"E {m.number} {m.time} {'+' if m.placed else '-'}{square_name(m.square)}{'?' if m.doubtful else ''}"
    ),
    Snapshot: lambda m: f"S {m.number} {m.time} {m.closed:016X} {m.doubtful:016X} {m.mark}",
    Finding: lambda m: f"F {m.number} {m.time} {m.what} {m.squares:016X}",
    Refusal: lambda m: f"N {m.why}",
    Ask: lambda m: f"S {m.mark}" if m.what == "S" else "H",
    Lamps: lambda m: f"L {m.squares:016X}",
    Buzz: lambda m: f"B {m.sound}",
}


def decode(line: bytes) -> Message:
    """The message of a line without its newline.

    Raises:
        ValueError: damaged, or nothing of this protocol; the text is ``checksum``, ``unknown``, ``range`` or
            ``long``, as a `Refusal` has it.
    """
    line = line.rstrip(b"\r")
    if len(line) > LONGEST_LINE:
        raise ValueError("long")
    body, star, told = line.rpartition(b"*")
    if not star or told != b"%04X" % checksum(body):
        raise ValueError("checksum")
    try:
        kind, *words = body.decode("ascii").split(" ")
        reader = _READERS[kind, len(words)]
    except (KeyError, UnicodeDecodeError):
        raise ValueError("unknown") from None
    try:
        return reader(words)
    except (ValueError, IndexError):
        raise ValueError("range") from None


def _hello(words: list[str]) -> Message:
    version, product, identity, wiring, firmware = words
    return Hello(int(version), identity, Wiring(wiring), firmware, product)


def _change(words: list[str]) -> Message:
    number, time, where = words
    sign, name, mark = where[0], where[1:3], where[3:]
    if sign not in "+-" or not _NAME.fullmatch(name) or mark not in {"", "?"}:
        raise ValueError(where)
    square = "abcdefgh".index(name[0]) + 8 * (int(name[1]) - 1)
    return Change(_number(number), int(time), square, sign == "+", bool(mark))


def _snapshot(words: list[str]) -> Message:
    return Snapshot(_number(words[0]), int(words[1]), _set(words[2]), _set(words[3]), _number(words[4]))


def _finding(words: list[str]) -> Message:
    return Finding(_number(words[0]), int(words[1]), _WHAT[_WHAT.index(words[2])], _set(words[3]))


def _number(text: str) -> int:
    number = int(text)
    if not 0 <= number < NUMBERS:
        raise ValueError(text)
    return number


def _set(text: str) -> int:
    if len(text) != 16:  # noqa: PLR2004 - hexadecimal digits of 64 bits
        raise ValueError(text)
    return int(text, 16)


_READERS: dict[tuple[str, int], Callable[[list[str]], Message]] = {
    ("H", 5): _hello,
    ("E", 3): _change,
    ("S", 5): _snapshot,
    ("F", 4): _finding,
    ("N", 1): lambda words: Refusal(words[0]),
    ("H", 0): lambda _: Ask("H"),
    ("S", 1): lambda words: Ask("S", _number(words[0])),
    ("L", 1): lambda words: Lamps(_set(words[0])),
    ("B", 1): lambda words: Buzz(Sound(words[0])),
}


class Lines:
    """Cuts a stream of bytes into lines and reads them.

    Attributes:
        damaged: Lines that could not be read so far.
        stranger: The last of them, for saying who else may be talking; at most `LONGEST_LINE` bytes.
    """

    def __init__(self) -> None:
        self._rest = b""
        self.damaged = 0
        self.stranger = b""

    def feed(self, data: bytes) -> Iterator[Message | ValueError]:
        """Messages in the order of their lines; for a line that cannot be read, the reason."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > LONGEST_LINE:
            lines, self._rest = [*lines, self._rest], b""
        for line in lines:
            if not line.strip():
                continue
            try:
                yield decode(line)
            except ValueError as error:
                self.damaged += 1
                self.stranger = line[:LONGEST_LINE]
                yield error
