"""What a scan reads of 64 switches, as currents flow: rows are driven one after another, columns read.

Row r, column c carry square 8 r + c. With a diode in series with every switch a current flows from a driven
row to a column only. Where a diode is missing it also flows back, from a column to another row and on:
three closed corners of a rectangle feign the fourth. Rows that are not driven are read as well: one that is
live although nobody drives it gives that away.
"""

from dataclasses import dataclass, field

from kempelen.core.reed import ALL_SQUARES, Wiring, squares_in

_ROW = 0xFF


@dataclass
class Matrix:
    """The switches and their faults.

    Attributes:
        wiring: How they are read.
        bare: Squares without a diode; of a matrix with diodes, those where it is missing.
        stuck_closed: Squares whose contacts have welded.
        stuck_open: Squares whose switch or wire is broken.
    """

    wiring: Wiring = Wiring.DIODES
    bare: int = 0
    stuck_closed: int = 0
    stuck_open: int = 0
    _sneaking: int = field(default=0, init=False)

    def contacts(self, magnets: int) -> int:
        """Switches that are really closed, of those that a magnet is over."""
        return (magnets | self.stuck_closed) & ~self.stuck_open & ALL_SQUARES

    def scan(self, contacts: int) -> "Scan":
        """What the 64 readings are."""
        if self.wiring is Wiring.DIRECT:
            return Scan(contacts, (0,) * 8)
        bare = ALL_SQUARES if self.wiring is Wiring.PLAIN else self.bare
        back = contacts & bare
        if not back:
            return Scan(contacts, (0,) * 8)
        rows = [self._driven(row, contacts, back) for row in range(8)]
        return Scan(
            sum(columns << 8 * row for row, (columns, _) in enumerate(rows)), tuple(r for _, r in rows)
        )

    def _driven(self, row: int, contacts: int, back: int) -> tuple[int, int]:
        """Columns that are live while a row is driven, and the other rows that are."""
        live, fresh, columns = 1 << row, 1 << row, 0
        while fresh:
            for each in squares_in(fresh):
                columns |= contacts >> 8 * each & _ROW
            reached = sum(1 << r for r in range(8) if back >> 8 * r & columns)
            fresh = reached & ~live
            live |= reached
        return columns, live & ~(1 << row)


@dataclass(frozen=True, slots=True)
class Scan:
    """One reading of everything.

    Attributes:
        closed: Squares that read closed.
        live: For each driven row, the other rows that were live with it.
    """

    closed: int
    live: tuple[int, ...]

    @property
    def doubtful(self) -> int:
        """Squares that another way of the current would explain: closed in a row and in one live with it."""
        out = 0
        for row, others in enumerate(self.live):
            for other in squares_in(others):
                out |= (self.closed >> 8 * row & self.closed >> 8 * other & _ROW) << 8 * row
        return out

    @property
    def suspects(self) -> list[int]:
        """Sets of squares in each of which a diode is missing: where a current may have come back."""
        return [
            (self.closed >> 8 * row & self.closed >> 8 * other & _ROW) << 8 * other
            for row, others in enumerate(self.live)
            for other in squares_in(others)
        ]
