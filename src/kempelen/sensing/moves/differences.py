"""What is wrong on the board, square by square, and what to put where."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import chess
import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from kempelen.core.pieces import piece_name
from kempelen.core.senses import BLACK, EMPTY, WHITE
from kempelen.core.words import Words, parts_of, say
from kempelen.sensing.moves.hypotheses import colour_state
from kempelen.sensing.moves.verdicts import Difference
from kempelen.sensing.moves.ways import goes, takes

UNLIKE_THE_PIECE = 10.0  # squares of distance that a way the piece does not go counts for
COLOUR_WORDS = {WHITE: "white", BLACK: "black"}


@dataclass(frozen=True, slots=True)
class Repair:
    """One thing to do with the hands.

    Attributes:
        piece: Which, when known.
        colour: WHITE or BLACK, of what is to be moved.
        source: Where it stands now; None: beside the board.
        target: Where it belongs; None: beside the board.
    """

    piece: chess.Piece | None
    colour: int
    source: chess.Square | None
    target: chess.Square | None

    def __str__(self) -> str:
        return self.text

    @property
    def text(self) -> str:
        """What to do, without a full stop."""
        name = piece_name(self.piece) if self.piece else f"{COLOUR_WORDS[self.colour]} piece"
        source, target = _name(self.source), _name(self.target)
        piece = self.piece.symbol() if self.piece else "white" if self.colour == WHITE else "black"
        if self.target is None:
            return say("take_off", f"take the {name} off {source}", piece=piece, place=source)
        if self.source is None:
            return say("put_back", f"put the {name} back on {target}", piece=piece, target=target)
        text = f"put the {name} from {source} back on {target}"
        return say("put_back_from", text, piece=piece, source=source, target=target)


def _name(square: chess.Square | None) -> str:
    return "" if square is None else chess.square_name(square)


def differences(
    expected: chess.BaseBoard | Mapping[chess.Square, chess.Piece], seen: npt.ArrayLike
) -> tuple[Difference, ...]:
    """Squares that are not as they should be.

    Args:
        expected: What should stand where.
        seen: (64,) EMPTY, WHITE or BLACK.
    """
    pieces = expected.piece_map() if isinstance(expected, chess.BaseBoard) else expected
    states = np.asarray(seen)
    out = []
    for square in chess.SQUARES:
        piece = pieces.get(square)
        wanted = colour_state(piece.color) if piece else EMPTY
        if states[square] != wanted:
            out.append(Difference(square, piece, int(states[square])))
    return tuple(out)


def repairs(found: Iterable[Difference]) -> tuple[Repair, ...]:
    """The fewest hand movements that put everything right.

    Pieces too many and pieces missing of one colour are paired, by ways that the missing piece could have
    gone and by distance. Pieces that stand in the way of others come first.
    """
    found = tuple(found)
    out: list[Repair] = []
    for colour in (WHITE, BLACK):
        extra = [d.square for d in found if d.seen == colour]
        missing = [
            (d.square, d.expected) for d in found if d.expected and colour_state(d.expected.color) == colour
        ]
        out += _paired(colour, extra, missing)
    return _in_order(out)


def _paired(
    colour: int, extra: list[chess.Square], missing: list[tuple[chess.Square, chess.Piece]]
) -> list[Repair]:
    cost = np.array([[_way(piece, home, square) for home, piece in missing] for square in extra])
    rows, columns = linear_sum_assignment(cost) if cost.size else ((), ())
    pairs = {int(r): int(c) for r, c in zip(rows, columns, strict=True)}
    moved = [Repair(missing[c][1], colour, extra[r], missing[c][0]) for r, c in pairs.items()]
    taken = [Repair(None, colour, s, None) for i, s in enumerate(extra) if i not in pairs]
    back = [Repair(p, colour, None, s) for i, (s, p) in enumerate(missing) if i not in set(pairs.values())]
    return [*taken, *moved, *back]


def _way(piece: chess.Piece, home: chess.Square, square: chess.Square) -> float:
    """How far the piece is from home, ways that it does not go counting more."""
    possible = goes(piece, home, square) or takes(piece, home, square)
    off = 0.0 if possible else UNLIKE_THE_PIECE
    return chess.square_distance(home, square) + off


def _in_order(todo: list[Repair]) -> tuple[Repair, ...]:
    """So that a piece is put where nothing stands any more, wherever that can be."""
    left, out = list(todo), []
    while left:
        taken = {r.source for r in left}
        free = next((r for r in left if r.target is None or r.target not in taken), left[0])
        left.remove(free)
        out.append(free)
    return tuple(out)


def sentence(todo: Iterable[Repair]) -> str:
    """One sentence of what to do; empty when there is nothing."""
    todo = tuple(todo)
    parts = [str(r) for r in todo]
    if not parts:
        return ""
    text = "; ".join(parts)
    return Words(text[0].upper() + text[1:] + ".", tuple(part for r in todo for part in parts_of(r.text)))
