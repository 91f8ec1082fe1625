"""Lines that leave the same squares taken, told apart by the kinds of the pieces."""

from collections.abc import Sequence

import chess
import numpy as np

from kempelen.core.geometry import Array
from kempelen.sensing.moves.evidence import bounded
from kempelen.sensing.moves.verdicts import Line


def kind_column(piece: chess.Piece | None) -> int:
    """Column of `Observation.kinds`: empty, P N B R Q K, p n b r q k."""
    if piece is None:
        return 0
    return piece.piece_type + (0 if piece.color else 6)


def after(board: chess.Board, line: Line) -> chess.Board:
    """The position after the line."""
    out = board.copy(stack=False)
    for move in line:
        out.push(move)
    return out


def promoted_line(
    lines: Sequence[Line], board: chess.Board, kinds: Array, misread: float
) -> tuple[Line, float]:
    """The likeliest of lines that differ in what stands where, by kind.

    Args:
        lines: At least two, legal in ``board``.
        board: Before them.
        kinds: (64, 13) log-likelihoods.
        misread: Rate of squares whose kind is misread for good.

    Returns:
        The line and its log odds against all the others; 0 at most when another one leaves the very same
        pieces.
    """
    told = bounded(kinds, misread)
    positions = [after(board, line) for line in lines]
    squares = [s for s in chess.SQUARES if len({p.piece_at(s) for p in positions}) > 1]
    scores = [sum(float(told[s, kind_column(p.piece_at(s))]) for s in squares) for p in positions]
    best = int(np.argmax(scores))
    rest = np.logaddexp.reduce(np.delete(scores, best))
    return lines[best], float(scores[best] - rest)
