"""GRBL 1.1's side of the wire: bytes in, events out. No I/O, no clock.

Source: the GRBL 1.1 interface as documented with the firmware (``interface.md``) and as measured on it; what
its relatives with more axes say besides, grblHAL and FluidNC, as documented with them. There are no
checksums, so a line that cannot be what the firmware sends becomes a `Damaged` event, never an exception and
never a guess.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

Axes = tuple[float, ...]
"""A number for each of the controller's axes, in its order: mm, degrees for an axis that turns."""

# Real-time bytes: raw, uncounted, acted upon at once.
ASK = b"?"
HOLD = b"!"
RESUME = b"~"
RESET = b"\x18"
JOG_CANCEL = b"\x85"

LONGEST_LINE = 256
STATES = frozenset({"Idle", "Run", "Hold", "Jog", "Alarm", "Door", "Check", "Home", "Sleep"})


@dataclass(frozen=True, slots=True)
class Ok:
    """A line was taken (not: was carried out)."""


@dataclass(frozen=True, slots=True)
class Error:
    """A line was refused."""

    code: int


@dataclass(frozen=True, slots=True)
class Alarm:
    """The controller locked itself."""

    code: int


@dataclass(frozen=True, slots=True)
class Banner:
    """The controller (re)started; every outstanding acknowledgement is void."""

    version: str


@dataclass(frozen=True, slots=True)
class Status:
    """An answer to ``?``.

    Attributes:
        state: One of `STATES`.
        sub: The number after the colon of ``Hold:0`` and ``Door:1``; None without one.
        machine: MPos; None when the report has WPos.
        work: WPos; None when the report has MPos.
        offset: WCO; only in some reports.
        accessories: Letters of ``A:`` (``F`` flood on, ``S`` spindle on); ``""`` when ``Ov:`` came without
            ``A:``; None when the report does not tell.
        pins: Triggered inputs, ``"XY"``.
    """

    state: str
    sub: int | None = None
    machine: Axes | None = None
    work: Axes | None = None
    offset: Axes | None = None
    accessories: str | None = None
    pins: str = ""

    @property
    def moving(self) -> bool:
        """Whether axes may be in motion."""
        return self.state in {"Run", "Jog", "Home"} or (self.state, self.sub) in {
            ("Hold", 1),
            ("Door", 2),
            ("Door", 3),
        }


@dataclass(frozen=True, slots=True)
class Setting:
    """``$n=value``."""

    number: int
    value: float


@dataclass(frozen=True, slots=True)
class Offset:
    """A line of ``$#`` with a number for each axis: G54..G59, G28, G30, G92."""

    name: str
    value: Axes


@dataclass(frozen=True, slots=True)
class ParserState:
    """The words of ``[GC:...]``."""

    words: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class BuildInfo:
    """``[VER:...]``, ``[OPT:...]`` and ``[AXS:...]``."""

    key: str
    text: str


@dataclass(frozen=True, slots=True)
class Message:
    """Anything else that the firmware says in brackets, and start-up lines."""

    text: str


@dataclass(frozen=True, slots=True)
class Damaged:
    """A line that the firmware does not send: noise on the line, or no GRBL at its other end."""

    raw: bytes
    reason: str


Event = Ok | Error | Alarm | Banner | Status | Setting | Offset | ParserState | BuildInfo | Message | Damaged

_OK = Ok()
_BANNER = re.compile(r"Grbl(?:HAL)? (\d\S*) \[(?:FluidNC [^\]']*)?'\$'[^\]]*\]$", re.IGNORECASE)
_CODE = re.compile(r"(error|ALARM):(\d{1,3})")
_SETTING = re.compile(r"\$(\d{1,3})=(-?\d+(?:\.\d+)?)(?: *\(.*\))?")
_TEXT_SETTING = re.compile(r"\$(?:[4-9]\d|[3-9]\d\d)=.*")  # grblHAL's lists, addresses and passwords
_NUMBER = re.compile(r"-?\d{1,7}(?:\.\d{1,4})?")
_HEAD = re.compile(r"([A-Z][a-z]+)(?::(\d{1,2}))?")
_FEWEST, _MOST = 3, 6  # axes
_OFFSETS = frozenset({"G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30", "G92"})


class Decoder:
    """Cuts a byte stream into lines and lines into events.

    However the stream is cut into pieces, the events are the same.

    Attributes:
        axes: How many the controller has; a report of more or fewer is damaged. 0 while it is not known.
    """

    def __init__(self) -> None:
        self.axes = 0
        self._tail = b""

    def feed(self, data: bytes) -> list[Event]:
        """Events of the lines that ``data`` completes."""
        *lines, tail = (self._tail + data).split(b"\n")
        self._tail = tail[: LONGEST_LINE + 2]  # what is longer is damaged anyway
        return [self._counted(event, line) for line in lines for event in decode_line(line)]

    def _counted(self, event: Event, line: bytes) -> Event:
        place = (event.machine or event.work) if isinstance(event, Status) else None
        if self.axes and place is not None and len(place) != self.axes:
            return Damaged(line, f"a report of {len(place)} axes, there are {self.axes}")
        return event


def decode_line(line: bytes) -> tuple[Event, ...]:
    """The events of one line without its newline: none for a blank one, two for noise before a banner."""
    line = line.removesuffix(b"\r")
    if line == b"ok":
        return (_OK,)
    if not line:
        return ()
    if len(line) > LONGEST_LINE:
        return (Damaged(line[:LONGEST_LINE], "longer than any line of GRBL"),)
    if not all(32 <= byte < 127 for byte in line):  # noqa: PLR2004 - printable ASCII
        text = line.decode("ascii", "replace")
        return (Damaged(line, "not printable"), *_banner(text))
    return _decode_text(line)


def _decode_text(line: bytes) -> tuple[Event, ...]:
    text = line.decode("ascii")
    if text[0] == "<" or text[0] == "[":
        decoded = (_status if text[0] == "<" else _bracket)(text)
        return (decoded,) if decoded is not None else (Damaged(line, "incomplete report"), *_banner(text))
    if match := _CODE.fullmatch(text):
        code = int(match[2])
        return (Error(code) if match[1] == "error" else Alarm(code),)
    if match := _SETTING.fullmatch(text):
        return (Setting(int(match[1]), float(match[2])),)
    if text[0] == ">" or _TEXT_SETTING.fullmatch(text):  # the first: the echo of a start-up line, ">G54:ok"
        return (Message(text),)
    banner = _banner(text)
    if banner and _BANNER.match(text):
        return banner
    return (Damaged(line, "not a line of GRBL"), *banner)


def _banner(text: str) -> tuple[Banner, ...]:
    match = _BANNER.search(text)
    return (Banner(match[1]),) if match else ()


def _axes(text: str) -> Axes | None:
    parts = text.split(",")
    if not _FEWEST <= len(parts) <= _MOST or not all(map(_NUMBER.fullmatch, parts)):
        return None
    return tuple(map(float, parts))


def _status(text: str) -> Status | None:
    if not text.endswith(">"):
        return None
    head, *fields = text[1:-1].split("|")
    match = _HEAD.fullmatch(head)
    if match is None or match[1] not in STATES:
        return None
    named = dict(part.partition(":")[::2] for part in fields)
    points = {key: _axes(named[key]) for key in ("MPos", "WPos", "WCO") if key in named}
    if None in points.values() or ("MPos" in points) == ("WPos" in points):
        return None
    return Status(
        state=match[1],
        sub=int(match[2]) if match[2] else None,
        machine=points.get("MPos"),
        work=points.get("WPos"),
        offset=points.get("WCO"),
        accessories=named.get("A", "" if "Ov" in named else None),
        pins=named.get("Pn", ""),
    )


def _offset(key: str, value: str) -> Event | None:
    point = _axes(value)
    return None if point is None else Offset(key, point)


_BRACKETS: dict[str, Callable[[str], Event]] = {
    "GC": lambda value: ParserState(tuple(value.split())),
    "VER": lambda value: BuildInfo("VER", value),
    "OPT": lambda value: BuildInfo("OPT", value),
    "AXS": lambda value: BuildInfo("AXS", value),
}


def _bracket(text: str) -> Event | None:
    if not text.endswith("]"):
        return None
    key, _, value = text[1:-1].partition(":")
    if key in _OFFSETS:
        return _offset(key, value)
    make = _BRACKETS.get(key)
    return make(value) if make else Message(text[1:-1].removeprefix("MSG:"))


class PositionTracker:
    """Work positions from reports that carry either machine or work coordinates.

    WCO comes only now and then; the last one is kept. WPos = MPos - WCO.
    """

    def __init__(self) -> None:
        self.offset: Axes | None = None

    def work(self, status: Status) -> Axes | None:
        """In work coordinates; None while the offset is unknown."""
        if status.offset is not None:
            self.offset = status.offset
        if status.work is not None or status.machine is None:
            return status.work
        return _minus(status.machine, self.offset)

    def machine(self, status: Status) -> Axes | None:
        """In machine coordinates; None while the offset is unknown."""
        if status.offset is not None:
            self.offset = status.offset
        if status.machine is not None or status.work is None or self.offset is None:
            return status.machine
        return _minus(status.work, tuple(-value for value in self.offset))


def _minus(a: Axes, b: Axes | None) -> Axes | None:
    if b is None or len(a) != len(b):
        return None
    return tuple(round(one - other, 3) for one, other in zip(a, b, strict=True))
