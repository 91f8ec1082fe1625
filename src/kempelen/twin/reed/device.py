"""A reed board without hardware: what the firmware does with readings and with lines. No I/O, no clock."""

import random
from collections.abc import Iterable
from dataclasses import dataclass, field

from kempelen.core.reed import (
    PROTOCOL_VERSION,
    Ask,
    Buzz,
    Hello,
    Lamps,
    Lines,
    Message,
    Refusal,
    Sound,
    Wiring,
    encode,
)
from kempelen.twin.reed.matrix import Matrix
from kempelen.twin.reed.scanner import Scanner

SNAPSHOT_MS = 100
_BACKLOG = 1024
"""Bytes that wait to be sent; with more of them there are no snapshots."""


@dataclass
class Line:
    """What happens to bytes on their way to the host.

    Attributes:
        damage: Probability that a byte is changed.
        loss: Probability that a line is lost.
    """

    damage: float = 0.0
    loss: float = 0.0


@dataclass
class Device:
    """The board.

    Attributes:
        identity: 8 hexadecimal digits.
        matrix: Its switches.
        version: Of the protocol that it speaks.
        seed: Of the line's faults.
        line: Those.
        lit: Squares whose lamps are on.
        sounds: That it was told to make, in order.
    """

    identity: str = "7F3A09C1"
    matrix: Matrix = field(default_factory=Matrix)
    version: int = PROTOCOL_VERSION
    seed: int = 0
    line: Line = field(default_factory=Line)
    lit: int = 0
    sounds: list[Sound] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._rng = random.Random(self.seed)  # noqa: S311 - no secret
        self._scanner = Scanner()
        self._lines = Lines()
        self._out = bytearray()
        self._mark = self._due = 0

    def power_up(self, magnets: int) -> None:
        """Read everything once, and greet."""
        self._scanner.begin(self.matrix.scan(self.matrix.contacts(magnets)))
        self._say(self._hello())

    @property
    def at_rest(self) -> bool:
        """Whether no switch is being debounced."""
        return self._scanner.at_rest

    def scan(self, now: int, magnets: int) -> None:
        """A reading of all switches at ``now`` ms, with these contacts closed by magnets."""
        told = self._scanner.step(now, self.matrix.scan(self.matrix.contacts(magnets)))
        self._say(*told)
        if now >= self._due and len(self._out) < _BACKLOG:
            self._due = now + SNAPSHOT_MS
            self._say(self._scanner.snapshot(now, self._mark))

    def receive(self, now: int, data: bytes) -> None:
        """Bytes from the host."""
        for message in self._lines.feed(data):
            self._obey(now, message)

    def _obey(self, now: int, message: Message | ValueError) -> None:
        match message:
            case Ask("H"):
                self._say(self._hello())
            case Ask("S", mark):
                self._mark = mark
                self._say(self._scanner.snapshot(now, mark))
            case Lamps(squares):
                self.lit = squares
            case Buzz(sound):
                self.sounds.append(sound)
            case ValueError():
                self._say(Refusal(str(message)))
            case _:
                self._say(Refusal("unknown"))

    def _hello(self) -> Hello:
        return Hello(self.version, self.identity, Wiring(self.matrix.wiring))

    def _say(self, *messages: Message) -> None:
        for message in messages:
            if self.line.loss and self._rng.random() < self.line.loss:
                continue
            self._out += bytes(self._damaged(encode(message)))

    def _damaged(self, line: bytes) -> Iterable[int]:
        if not self.line.damage:
            return line
        return (self._rng.randrange(256) if self._rng.random() < self.line.damage else byte for byte in line)

    def take_output(self, most: int = 1 << 20) -> bytes:
        """Bytes for the host, at most so many."""
        data = bytes(self._out[:most])
        del self._out[:most]
        return data
