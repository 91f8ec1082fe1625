"""The latch bridge's side of the wire: frames with numbers and checksums. No I/O, no clock.

Source: docs/reference/latch-bridge.md, version 1. A line is ``body*CCCC``: four hexadecimal digits of
CRC-16/CCITT-FALSE over the body. A command's body begins with its number, so that a line that was lost or
damaged on its way is noticed before the next one is carried out. What only ever stops the arm is a bare byte.
"""

import re
from binascii import crc_hqx
from collections.abc import Callable

from kempelen.robots.grbl.codec import (
    LONGEST_LINE,
    Alarm,
    Axes,
    Banner,
    BuildInfo,
    Damaged,
    Error,
    Event,
    Message,
    Ok,
    Status,
)

VERSION = 1
NAME = "Kempelen latch bridge"
_LAST = 255  # numbers run 0, 1 .. 255, 1 .. 255: 0 begins anew
_OVERHEAD = 9  # "255 " and "*CCCC"
_FRAME = re.compile(rb"(.*)\*([0-9A-F]{4})")
_OK = re.compile(r"ok \d+")
_ERROR = re.compile(r"error (\d{1,3}) \d+")
_ALARM = re.compile(r"alarm (\d{1,2})")
_GREETING = re.compile(rf"{NAME} (\d+), (\d) motors")
_INFO = re.compile(r"\[([A-Z]{3}):(.*)\]")
_STATUS = re.compile(
    r"<(Idle|Run|Jog|Home|Alarm|Hold)(?::(\d))?\|P:(-?\d+(?:,-?\d+)*)\|Q:(\d+)\|L:([XYZABC]*)\|G:([oc])"
    r"\|K:([01])>"
)

ERRORS: dict[int, tuple[str, str]] = {
    1: ("an unknown command or a wrong number of values", "Use a bridge of version 1."),
    2: ("a value out of range", "Check the arm's parameter file."),
    3: ("a motor would have to step faster than the bridge can", "Plan slower."),
    8: ("it is busy", "Wait for rest."),
    9: ("it is locked", "Recover, then home the arm."),
    101: ("it arrived damaged (checksum)", "Check the cable; keep it away from motor wires."),
    102: ("a line before it was lost (number)", "Check the cable; keep it away from motor wires."),
    103: ("it is too long", "Use a bridge of version 1."),
}


def framed(body: bytes) -> bytes:
    """``body*CCCC`` and a newline."""
    return b"%b*%04X\n" % (body, crc_hqx(body, 0xFFFF))


def unframed(line: bytes) -> bytes | None:
    """The body of a line without its newline; None when the checksum is not right."""
    match = _FRAME.fullmatch(line)
    if match is None or int(match[2], 16) != crc_hqx(match[1], 0xFFFF):
        return None
    return match[1]


class Numbered:
    """The `kempelen.robots.grbl.framing.Framing` of the bridge.

    Attributes:
        memory_kept: Whether the last report said that a driver has driven the bridge since its last reset.
    """

    device = "a latch bridge"
    resume = framed(b"~")
    overhead = _OVERHEAD

    def __init__(self) -> None:
        self.memory_kept = False
        self._next = 0
        self._axes = 0
        self._tail = b""

    def encode(self, line: bytes) -> bytes:
        """With its number and its checksum."""
        number, self._next = self._next, self._next % _LAST + 1
        return framed(b"%d %b" % (number, line.rstrip(b"\n")))

    def restarted(self) -> None:
        """Numbers begin anew."""
        self._next = 0

    def expect_axes(self, count: int) -> None:
        """From now on a report of another number of motors is damaged."""
        self._axes = count

    def explain(self, code: int) -> tuple[str, str]:
        """What ``error`` means, and what to do next."""
        return ERRORS.get(code, ("an unknown reason", "See docs: reference/latch-bridge."))

    def feed(self, data: bytes) -> list[Event]:
        """Events of the lines that ``data`` completes, however it is cut."""
        *lines, tail = (self._tail + data).split(b"\n")
        self._tail = tail[: LONGEST_LINE + 2]
        return [event for line in lines if line.strip() for event in self._decode(line.removesuffix(b"\r"))]

    def _decode(self, line: bytes) -> tuple[Event, ...]:
        body = unframed(line)
        if body is None:
            # Noise in front of a greeting must not hide it: whatever was outstanding is void.
            start = line.rfind(NAME.encode())
            rest = unframed(line[start:]) if start > 0 else None
            damaged = Damaged(line, "wrong checksum")
            return (
                (damaged,) if rest is None else (damaged, *self._event(rest.decode("ascii", "replace"), line))
            )
        return self._event(body.decode("ascii", "replace"), line)

    def _event(self, text: str, line: bytes) -> tuple[Event, ...]:
        for pattern, make in _EVENTS:
            if match := pattern.fullmatch(text):
                return (make(match),)
        if match := _STATUS.fullmatch(text):
            return (self._status(match, line),)
        return (Damaged(line, "not a line of the bridge"),)

    def _status(self, match: re.Match[str], line: bytes) -> Event:
        counts: Axes = tuple(float(count) for count in match[3].split(","))
        if self._axes and len(counts) != self._axes:
            return Damaged(line, f"a report of {len(counts)} motors, there are {self._axes}")
        self.memory_kept = match[7] == "1"
        return Status(
            state=match[1],
            sub=int(match[2]) if match[2] else None,
            machine=counts,
            work=counts,
            accessories="F" if match[6] == "o" else "",
            pins=match[5],
        )


_EVENTS: tuple[tuple[re.Pattern[str], Callable[[re.Match[str]], Event]], ...] = (
    (_OK, lambda _match: Ok()),
    (_ERROR, lambda match: Error(int(match[1]))),
    (_ALARM, lambda match: Alarm(int(match[1]))),
    (_GREETING, lambda match: Banner(match[1])),
    (re.compile(r"\[(VER|AXS|QUE|HOM):(.*)\]"), lambda match: BuildInfo(match[1], match[2])),
    (_INFO, lambda match: Message(match[0])),
)
