"""Switches that cannot be believed: noticed, named, left out."""

from collections.abc import Callable
from dataclasses import dataclass

import chess

from kempelen.core.pieces import piece_name
from kempelen.core.reed import Finding, square_name, squares_in

_NAMED = 8


@dataclass(frozen=True, slots=True)
class SwitchFault:
    """What is wrong with some switch.

    Attributes:
        kind: ``stuck closed``, ``not felt`` (a dead switch or a weak magnet), ``weak magnet``, ``diode``,
            ``chatter``, ``works again``.
        squares: It is at one of these.
        sentence: For the operator, with what to do.
    """

    kind: str
    squares: int
    sentence: str


def occupied(board: chess.BaseBoard) -> int:
    """Squares with a piece; the library's bitboards have the protocol's order."""
    return board.occupied


class SwitchFaults:
    """All that is known of the switches.

    Args:
        tell: Called once for each fault.

    Attributes:
        named: In the order in which they were found.
        left_out: Squares that are not believed.
    """

    def __init__(self, tell: Callable[[SwitchFault], None] = lambda _: None) -> None:
        self._tell = tell
        self.named: list[SwitchFault] = []
        self.left_out = 0
        self._unfelt: dict[int, chess.Piece] = {}
        self._suspects = 0

    def name(self, wrong: int, board: chess.BaseBoard) -> None:
        """These squares read otherwise than the position that has been confirmed, and no hand is at work."""
        for square in squares_in(wrong & ~self.left_out):
            self.left_out |= 1 << square
            name, piece = square_name(square), board.piece_at(square)
            if piece is None:
                self._found(
                    "stuck closed", 1 << square,
                    f"The switch of {name} is stuck closed: it reads a piece where none stands. It is left "
                    "out; have a look at it after the game.",
                )  # fmt: skip
            else:
                self._unfelt[square] = piece
                self._found(
                    "not felt", 1 << square,
                    f"The {piece_name(piece)} is not felt on {name}: its switch is stuck open, or the "
                    "piece's magnet is weak or missing. The square is left out; try another piece there.",
                )  # fmt: skip

    def moved(self, square: int) -> None:
        """There was news of a square: its switch lives."""
        if not self.left_out >> square & 1:
            return
        self.left_out &= ~(1 << square)
        piece = self._unfelt.pop(square, None)
        name = square_name(square)
        if piece is None:
            self._found(
                "works again", 1 << square, f"The switch of {name} works again; it is believed again."
            )
        else:
            self._found(
                "weak magnet", 1 << square,
                f"The switch of {name} works, so it is the magnet of the {piece_name(piece)} that was not "
                "felt there: glue it in again, or change it.",
            )  # fmt: skip

    def take(self, finding: Finding) -> None:
        """What the board itself has found."""
        if finding.what == "chatter":
            names = _list(finding.squares)
            self._found(
                "chatter", finding.squares,
                f"The switch of {names} does not come to rest. Put its piece into the middle of the square; "
                "if that does not help, the contact is loose.",
            )  # fmt: skip
            return
        self._suspects = finding.squares
        one = finding.squares.bit_count() == 1
        where = f"at {_list(finding.squares)}" if one else f"at one of {_list(finding.squares)}"
        self._found(
            "diode", finding.squares,
            f"A diode is missing {where}: a current flows back there, and three closed corners of a "
            "rectangle feign the fourth. What cannot be told meanwhile is left out; solder the diode in.",
        )  # fmt: skip

    def _found(self, kind: str, squares: int, sentence: str) -> None:
        fault = SwitchFault(kind, squares, sentence)
        if fault not in self.named:
            self.named.append(fault)
            self._tell(fault)


def _list(squares: int) -> str:
    names = [square_name(square) for square in squares_in(squares)]
    if len(names) > _NAMED:
        return f"{', '.join(names[:_NAMED])} and {len(names) - _NAMED} more"
    return " or ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)
