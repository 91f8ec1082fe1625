"""A position without a history: the likeliest placement that a game of chess can have.

Each colour has exactly one king and fifteen other men: two knights, two rooks, two bishops of opposite
squares, a queen and eight pawns, each of which may have been promoted. Every man is a slot, every square
takes one slot or stays empty, and the best choice is an assignment problem (Kuhn 1955), solved exactly.
"""

from dataclasses import dataclass

import chess
import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from kempelen.core.errors import SensorError
from kempelen.core.geometry import Array
from kempelen.core.pieces import piece_name
from kempelen.core.senses import Observation
from kempelen.sensing.moves.evidence import bounded

PROMOTED = 0.01  # probability that a pawn's man on the board has been promoted
MISREAD = 1e-4  # rate of squares whose kind is misread whatever the classifier says
MUST = 1e6  # log-likelihood that makes a king's slot be filled
DOUBTFUL = 0.9  # squares of less confidence are reported

_NEVER = -1e9
_OFFICERS = (5, 4, 3, 2)


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """What stands where.

    Attributes:
        board: The likeliest placement; sides to move and castling rights are not known.
        confidence: (64,) probability that a square is read rightly, given that the others are.
        whole: Probability that the whole placement is right.
        findings: What is strange, in plain sentences.
    """

    board: chess.BaseBoard
    confidence: Array
    whole: float
    findings: tuple[str, ...]


def read_position(observation: Observation) -> Placement:
    """The likeliest placement.

    Args:
        observation: With ``kinds``.

    Raises:
        SensorError: nothing can be seen, or the kinds were not read.
    """
    if not observation.valid:
        raise SensorError(
            f"No position can be read: {observation.message or observation.sight.value}",
            hint="Clear the view of the board and look again.",
        )
    if observation.kinds is None:
        raise SensorError(
            "The kinds of the pieces were not read, so that a position without a history cannot be told.",
            hint="Use a colour camera, with the piece classifier switched on.",
        )
    return placement(observation.kinds)


def placement(kinds: Array) -> Placement:
    """The likeliest placement of (64, 13) log-likelihoods."""
    told = bounded(kinds, MISREAD)
    gains, labels = _gains(told)
    chosen, best = _assign(gains, labels)
    losses = np.array([best - _without(told, gains, labels, s, int(chosen[s])) for s in chess.SQUARES])
    wrong = np.exp(-np.maximum(losses, 0.0))
    confidence = 1 / (1 + wrong)
    board = chess.BaseBoard(None)
    for square in chess.SQUARES:
        board.set_piece_at(square, piece_of(int(chosen[square])))
    whole = float(1 / (1 + wrong.sum()))
    return Placement(board, confidence, whole, _findings(board, told, confidence))


def piece_of(column: int) -> chess.Piece | None:
    """The piece of a column of `Observation.kinds`."""
    return None if column == 0 else chess.Piece((column - 1) % 6 + 1, column <= 6)  # noqa: PLR2004 - six kinds


def _gains(told: Array) -> tuple[Array, npt.NDArray[np.int64]]:
    """(64, 96) log-likelihood of each square in each slot, and the kind's column that it stands for there."""
    slots = [_row(told[s], s) for s in chess.SQUARES]
    return np.array([g for g, _ in slots]), np.array([k for _, k in slots])


def _row(told: Array, square: chess.Square) -> tuple[list[float], list[int]]:
    """One square in every slot: 16 white men, 16 black men, 64 times empty."""
    light = bool(chess.BB_SQUARES[square] & chess.BB_LIGHT_SQUARES)
    edge = chess.square_rank(square) in {0, 7}
    gains: list[float] = []
    labels: list[int] = []
    for offset in (0, 6):
        bishops = [told[3 + offset] if light == shade else _NEVER for shade in (True, False)]
        gains += [told[6 + offset] + MUST, told[5 + offset], *2 * [told[4 + offset]], *bishops]
        gains += 2 * [told[2 + offset]]
        labels += [k + offset for k in (6, 5, 4, 4, 3, 3, 2, 2)]
        gain, kind = _foot_soldier(told, offset, edge=edge)
        gains += 8 * [gain]
        labels += 8 * [kind]
    return gains + 64 * [told[0]], labels + 64 * [0]


def _foot_soldier(told: Array, offset: int, *, edge: bool) -> tuple[float, int]:
    """The likeliest of a pawn and what it may have become."""
    officer = max(_OFFICERS, key=lambda k: float(told[k + offset]))
    promoted = float(told[officer + offset]) + float(np.log(PROMOTED / len(_OFFICERS)))
    pawn = _NEVER if edge else float(told[1 + offset]) + float(np.log1p(-PROMOTED))
    return (pawn, 1 + offset) if pawn >= promoted else (promoted, officer + offset)


def _assign(gains: Array, labels: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], float]:
    rows, columns = linear_sum_assignment(gains, maximize=True)
    return labels[rows, columns], float(gains[rows, columns].sum())


def _without(
    told: Array, gains: Array, labels: npt.NDArray[np.int64], square: chess.Square, column: int
) -> float:
    """The best total when that square is anything but ``column``."""
    changed = told[square].copy()
    changed[column] = _NEVER
    other, names = gains.copy(), labels.copy()
    other[square], names[square] = _row(changed, square)
    return _assign(other, names)[1]


def _findings(board: chess.BaseBoard, told: Array, confidence: Array) -> tuple[str, ...]:
    seen = [piece_of(int(k)) for k in told.argmax(axis=1)]
    out = [*_counts(seen), *_edges(seen), *_kings(board)]
    if doubtful := [chess.square_name(int(s)) for s in np.flatnonzero(confidence < DOUBTFUL)]:
        out.append(f"Doubtful: {', '.join(doubtful)}.")
    return tuple(out)


def _counts(seen: list[chess.Piece | None]) -> list[str]:
    """More or fewer men than a game has, as each square by itself looks."""
    out = []
    for colour, word in ((chess.WHITE, "white"), (chess.BLACK, "black")):
        men = [p for p in seen if p and p.color == colour]
        kings = sum(p.piece_type == chess.KING for p in men)
        pawns = sum(p.piece_type == chess.PAWN for p in men)
        if kings != 1:
            out.append(f"{kings or 'No'} {word} king{'s' if kings > 1 else ''} seen; there must be one.")
        if pawns > 8:  # noqa: PLR2004 - of chess
            out.append(f"{pawns} {word} pawns seen; there are 8 at most.")
        if len(men) > 16:  # noqa: PLR2004 - of chess
            out.append(f"{len(men)} {word} men seen; there are 16 at most.")
    return out


def _edges(seen: list[chess.Piece | None]) -> list[str]:
    return [
        f"A {piece_name(piece)} seems to stand on {chess.square_name(square)}, where no pawn can be."
        for square, piece in enumerate(seen)
        if piece and piece.piece_type == chess.PAWN and chess.square_rank(square) in {0, 7}
    ]


def _kings(board: chess.BaseBoard) -> list[str]:
    """Checks that no game can show, and those that tell whose turn it is."""
    white, black = board.king(chess.WHITE), board.king(chess.BLACK)
    if white is None or black is None:
        return []
    if chess.square_distance(white, black) == 1:
        return ["The kings stand next to each other."]
    checked = [c for c, king in ((True, white), (False, black)) if board.is_attacked_by(not c, king)]
    if len(checked) > 1:
        return ["Both kings are in check."]
    return [f"{'White' if c else 'Black'} is in check, and so to move." for c in checked]
