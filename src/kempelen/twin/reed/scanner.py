"""The scan's logic, as the firmware has it: debounce, order of events, missing diodes.

`firmware/reed-board/reed_scan.h` is the same in C++; a test feeds both the same edges and compares lines.
"""

from dataclasses import dataclass, field
from typing import Literal

from kempelen.core.reed import NUMBERS, Change, Finding, Snapshot, squares_in
from kempelen.twin.reed.matrix import Scan

DEBOUNCE_MS = 20
"""A switch must have kept still for so long."""
CHATTER_MS, CHATTER_EDGES = 250, 12
"""One that has not for so long, with so many edges, is chattering."""
_ROW = 0xFF

Told = Change | Finding | Snapshot


@dataclass
class Scanner:
    """Turns readings into events.

    Events come in the order of their first edges: one that is certain waits for an earlier one that is not.

    Attributes:
        stable: Squares taken for closed.
        number: Of the last event.
    """

    stable: int = 0
    number: int = NUMBERS - 1
    _raw: int = 0
    _doubtful: int = 0
    _moving: int = 0
    _chattering: int = 0
    _cleared: int = 0
    _suspected: int = 0
    _looked_at: Scan | None = None
    _first: list[int] = field(default_factory=lambda: [0] * 64)
    _last: list[int] = field(default_factory=lambda: [0] * 64)
    _edges: list[int] = field(default_factory=lambda: [0] * 64)

    def begin(self, scan: Scan) -> None:
        """The first reading after power-up is how things are, not news."""
        self.stable = self._raw = scan.closed
        self._doubtful = scan.doubtful

    @property
    def at_rest(self) -> bool:
        """Whether no switch is being debounced."""
        return not self._moving

    def step(self, now: int, scan: Scan) -> list[Told]:
        """Take in a reading at ``now`` ms; what there is to tell."""
        self._note_edges(now, scan.closed)
        self._doubtful = scan.doubtful
        out: list[Told] = [*self._chatter(now), *self._settle(now)]
        if not self._moving:
            out += self._sneaks(now, scan)
        return out

    def snapshot(self, now: int, mark: int = 0) -> Snapshot:
        """Everything, as it is taken to be."""
        return Snapshot(self.number, now, self.stable, self.stable & self._doubtful, mark)

    def _note_edges(self, now: int, raw: int) -> None:
        for square in squares_in(raw ^ self._raw):
            if not self._moving >> square & 1:
                self._moving |= 1 << square
                self._first[square], self._edges[square] = now, 0
            self._last[square] = now
            self._edges[square] += 1
        self._raw = raw

    def _chatter(self, now: int) -> list[Finding]:
        out = []
        for square in squares_in(self._moving & ~self._chattering):
            if self._edges[square] >= CHATTER_EDGES and now - self._first[square] >= CHATTER_MS:
                self._chattering |= 1 << square
                out.append(self._finding(now, "chatter", 1 << square))
        return out

    def _settle(self, now: int) -> list[Change]:
        """Changes that are certain, and that no earlier one may still precede."""
        ready = []
        for square in squares_in(self._moving):
            if now - self._last[square] < DEBOUNCE_MS:
                continue
            if (self._raw ^ self.stable) >> square & 1:
                ready.append(square)
            else:
                self._rest(square)
        ready.sort(key=lambda square: (self._first[square], self._raw >> square & 1, square))
        waiting = self._moving & ~self._chattering & ~sum(1 << square for square in ready)
        earliest = min((self._first[square] for square in squares_in(waiting)), default=now + 1)
        return [self._change(square) for square in ready if self._first[square] <= earliest]

    def _rest(self, square: int) -> None:
        self._moving &= ~(1 << square)
        self._chattering &= ~(1 << square)

    def _change(self, square: int) -> Change:
        self._rest(square)
        self.stable ^= 1 << square
        placed = bool(self.stable >> square & 1)
        doubtful = placed and bool(self._doubtful >> square & 1)
        return Change(self._next(), self._first[square], square, placed, doubtful)

    def _sneaks(self, now: int, scan: Scan) -> list[Finding]:
        """A missing diode: where a current may have come back, but for squares where it was seen not to."""
        if scan == self._looked_at:
            return []
        self._looked_at = scan
        sound = [row for row in range(8) if not scan.live[row]]
        rows = [scan.closed >> 8 * row & _ROW for row in range(8)]
        for driven in sound:
            for other in sound:
                if other != driven:
                    self._cleared |= (rows[driven] & rows[other]) << 8 * other
        suspects = 0
        for some in scan.suspects:
            if not some & ~self._cleared:
                self._cleared &= ~some  # one of them was sound, and is no more
            suspects |= some & ~self._cleared
        if not suspects or suspects == self._suspected:
            return []
        self._suspected = suspects
        return [self._finding(now, "sneak", suspects)]

    def _finding(self, now: int, what: Literal["sneak", "chatter"], squares: int) -> Finding:
        return Finding(self._next(), now, what, squares)

    def _next(self) -> int:
        self.number = (self.number + 1) % NUMBERS
        return self.number
