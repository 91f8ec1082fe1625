"""Everything that may have happened since the confirmed position, as changes of squares.

Moves that leave the same squares empty, white and black are one hypothesis with several lines: nothing but
the kinds of the pieces can tell them apart.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import IntEnum

import chess
import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.pieces import piece_name
from kempelen.core.senses import BLACK, EMPTY, WHITE, states_of
from kempelen.core.words import say
from kempelen.sensing.moves.evidence import States
from kempelen.sensing.moves.verdicts import Line

Changes = frozenset[tuple[chess.Square, int]]


class Happened(IntEnum):
    """In the order in which they claim changes that several would explain."""

    STANDING = 0  # nothing
    MOVE = 1
    BACK = 2  # the position of one or two plies ago
    TWO = 3  # two plies
    REPLACED = 4  # the last ply taken back and another one made
    HALF = 5  # a move that has been begun


PRIOR = {
    Happened.STANDING: 0.5,
    Happened.MOVE: 0.471,
    Happened.BACK: 0.01,
    Happened.TWO: 0.015,
    Happened.REPLACED: 0.003,
    Happened.HALF: 0.001,
}
"""Of a board that has settled, with no hand over it: there hardly ever is a piece in the air. What can be
completed in several ways shares its part; but see ``FORGOTTEN``."""

BACK_SHARE = (0.8, 0.2)  # of take-backs: one ply, two plies

FORGOTTEN = 0.1  # of castlings and en passants, how many are left half made at first


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """One look of the board.

    Attributes:
        happened: What it is.
        changes: Squares whose state differs from the confirmed position's, with their new state.
        lines: Moves that lead there; for REPLACED from the position a ply ago, for HALF the moves that
            would complete it. Empty lines for STANDING and BACK.
        plies: Plies taken back first.
        advice: For HALF: what to do next, one sentence, where there is only one thing to do.
        castling: It could be the first half of castling.
        log_prior: Natural logarithm.
        also: Other stories, of another kind, that leave the board looking the same.
    """

    happened: Happened
    changes: Changes
    lines: tuple[Line, ...]
    log_prior: float
    plies: int = 0
    advice: str = ""
    castling: bool = False
    also: tuple["Hypothesis", ...] = ()


def colour_state(colour: chess.Color) -> int:
    """WHITE or BLACK."""
    return WHITE if colour else BLACK


def _changes(before: States, after: States) -> Changes:
    return frozenset((int(s), int(after[s])) for s in np.flatnonzero(before != after))


def _played(states: States, board: chess.Board, move: chess.Move) -> States:
    """States after the move, without playing it."""
    after, own = states.copy(), colour_state(board.turn)
    after[move.from_square] = EMPTY
    if board.is_castling(move):
        king, rook = castling_targets(board, move)
        after[castling_rook(board, move)] = EMPTY
        after[[king, rook]] = own
        return after
    if board.is_en_passant(move):
        after[en_passant_victim(move)] = EMPTY
    after[move.to_square] = own
    return after


def castling_rook(board: chess.Board, move: chess.Move) -> chess.Square:
    """Where the castling rook stands."""
    if board.chess960 or board.piece_at(move.to_square) == chess.Piece(chess.ROOK, board.turn):
        return move.to_square
    rank = chess.square_rank(move.from_square)
    rooks = [s for s in chess.SquareSet(board.clean_castling_rights()) if chess.square_rank(s) == rank]
    return max(rooks) if board.is_kingside_castling(move) else min(rooks)


def castling_targets(board: chess.Board, move: chess.Move) -> tuple[chess.Square, chess.Square]:
    """Where king and rook stand after castling."""
    rank = chess.square_rank(move.from_square)
    files = (6, 5) if board.is_kingside_castling(move) else (2, 3)
    return chess.square(files[0], rank), chess.square(files[1], rank)


def en_passant_victim(move: chess.Move) -> chess.Square:
    """Where the pawn stands that is taken en passant."""
    return chess.square(chess.square_file(move.to_square), chess.square_rank(move.from_square))


class Hypotheses:
    """All of them for one confirmed position, made once per position.

    Args:
        board: The confirmed position; its move stack tells what can be taken back.
        pairs: Whether two plies are among them.
    """

    def __init__(self, board: chess.Board, *, pairs: bool = True) -> None:
        self._board = board
        self._pairs = pairs
        self.states = states_of(board)
        self._found: dict[Changes, list[Hypothesis]] = {}
        for hypothesis in self._all():
            self._found.setdefault(hypothesis.changes, []).append(hypothesis)
        self.all = tuple(_merged(same) for same in self._found.values())
        self._squares, self._states = self._table()
        self.log_prior = np.array([h.log_prior for h in self.all])

    def _table(self) -> tuple[States, States]:
        """Changes as two rectangular index arrays; square 64 stands for none."""
        width = max(len(h.changes) for h in self.all) or 1
        squares = np.full((len(self.all), width), 64)
        states = np.zeros((len(self.all), width), dtype=np.int64)
        for row, hypothesis in enumerate(self.all):
            for column, (square, state) in enumerate(hypothesis.changes):
                squares[row, column], states[row, column] = square, state
        return squares, states

    def scores(self, ratios: Array) -> Array:
        """(n,) log-likelihood ratio of each hypothesis to STANDING, of (64, 3) per-square ratios."""
        padded = np.vstack([ratios, np.zeros(3)])
        out: Array = padded[self._squares, self._states].sum(axis=1)
        return out

    def after(self, hypothesis: Hypothesis) -> States:
        """(64,) what stands on the squares if it is true."""
        states = self.states.copy()
        for square, state in hypothesis.changes:
            states[square] = state
        return states

    def _all(self) -> Iterator[Hypothesis]:
        yield Hypothesis(Happened.STANDING, frozenset(), ((),), float(np.log(PRIOR[Happened.STANDING])))
        moves = list(self._board.legal_moves)
        yield from self._moves(moves)
        if self._pairs:
            yield from self._two(moves)
        yield from self._back()
        yield from halves(self._board, self.states, moves)

    def _moves(self, moves: list[chess.Move]) -> Iterator[Hypothesis]:
        log_prior = _shared(Happened.MOVE, len(moves))
        for move in moves:
            changes = _changes(self.states, _played(self.states, self._board, move))
            yield Hypothesis(Happened.MOVE, changes, ((move,),), log_prior)

    def _two(self, moves: list[chess.Move]) -> Iterator[Hypothesis]:
        found = list(two_plies(self._board, self.states, moves))
        log_prior = _shared(Happened.TWO, len(found))
        for line, after in found:
            yield Hypothesis(Happened.TWO, _changes(self.states, after), (line,), log_prior)

    def _back(self) -> Iterator[Hypothesis]:
        earlier = self._board.copy(stack=2)
        for plies in range(1, len(earlier.move_stack) + 1):
            undone = earlier.pop()
            states = states_of(earlier)
            log_prior = float(np.log(PRIOR[Happened.BACK] * BACK_SHARE[plies - 1]))
            yield Hypothesis(Happened.BACK, _changes(self.states, states), ((),), log_prior, plies)
            if plies == 1:
                yield from self._replaced(earlier, states, undone)

    def _replaced(self, earlier: chess.Board, states: States, undone: chess.Move) -> Iterator[Hypothesis]:
        others = [m for m in earlier.legal_moves if m != undone]
        log_prior = _shared(Happened.REPLACED, len(others))
        for move in others:
            changes = _changes(self.states, _played(states, earlier, move))
            if changes:  # another promotion looks the same
                yield Hypothesis(Happened.REPLACED, changes, ((move,),), log_prior, 1)


def _shared(happened: Happened, count: int) -> float:
    return float(np.log(PRIOR[happened] / max(1, count)))


def two_plies(board: chess.Board, states: States, moves: list[chess.Move]) -> Iterator[tuple[Line, States]]:
    """Every pair of legal moves, with the states after it."""
    after_first = board.copy(stack=False)
    for first in moves:
        between = _played(states, board, first)
        after_first.push(first)
        for second in after_first.legal_moves:
            yield (first, second), _played(between, after_first, second)
        after_first.pop()


def _merged(same: list[Hypothesis]) -> Hypothesis:
    """One hypothesis of all that look the same: the most ordinary one, with its own lines.

    A half-made move that looks like a whole one does not make that doubtful; half a castling makes it wait.
    """
    first = min(same, key=lambda h: h.happened)
    alike = [h for h in same if h.happened == first.happened]
    return replace(
        first,
        lines=tuple(dict.fromkeys(line for h in alike for line in h.lines)),
        log_prior=float(np.logaddexp.reduce([h.log_prior for h in alike])),
        advice=next((h.advice for h in alike if h.advice), ""),
        castling=any(h.castling for h in same),
        also=tuple(h for h in same if first.happened < h.happened < Happened.HALF),
    )


def halves(board: chess.Board, states: States, moves: list[chess.Move]) -> Iterator[Hypothesis]:
    """Moves that have been begun and not finished."""
    each = _shared(Happened.HALF, 3 * len(moves))
    forgotten = _shared(Happened.MOVE, len(moves)) + float(np.log(FORGOTTEN))
    for move in moves:
        for changes in _begun(board, states, move):
            yield Hypothesis(Happened.HALF, changes, ((move,),), each)
        if board.is_castling(move):
            yield _king_first(board, states, move, forgotten)
            yield _rook_first(board, states, move, each)
        elif board.is_en_passant(move):
            yield _victim_left(states, board, move, forgotten)


def _begun(board: chess.Board, states: States, move: chess.Move) -> Iterator[Changes]:
    """The piece in the hand; the victim too; the victim alone."""
    yield frozenset({(move.from_square, EMPTY)})
    if board.is_castling(move):
        king, _ = castling_targets(board, move)
        rook = castling_rook(board, move)
        yield frozenset({(move.from_square, EMPTY), (rook, EMPTY)})
        after = states.copy()
        after[[move.from_square, rook]] = EMPTY
        after[king] = colour_state(board.turn)
        yield _changes(states, after)
    elif board.is_capture(move):
        victim = en_passant_victim(move) if board.is_en_passant(move) else move.to_square
        yield frozenset({(victim, EMPTY)})
        yield frozenset({(move.from_square, EMPTY), (victim, EMPTY)})


def _king_first(board: chess.Board, states: States, move: chess.Move, log_prior: float) -> Hypothesis:
    king, target = castling_targets(board, move)
    rook = castling_rook(board, move)
    after = states.copy()
    after[move.from_square] = EMPTY
    after[king] = colour_state(board.turn)
    source, goal = chess.square_name(rook), chess.square_name(target)
    text = f"Castling: now move the rook from {source} to {goal}."
    advice = say("castle_rook", text, source=source, target=goal)
    return Hypothesis(
        Happened.HALF, _changes(states, after), ((move,),), log_prior, advice=advice, castling=True
    )


def _rook_first(board: chess.Board, states: States, move: chess.Move, log_prior: float) -> Hypothesis:
    king, target = castling_targets(board, move)
    after = states.copy()
    after[castling_rook(board, move)] = EMPTY
    after[target] = colour_state(board.turn)
    home = chess.square_name(move.from_square)
    goal = chess.square_name(king)
    text = f"Castling: now move the king from {home} to {goal}."
    advice = say("castle_king", text, source=home, target=goal)
    return Hypothesis(
        Happened.HALF, _changes(states, after), ((move,),), log_prior, advice=advice, castling=True
    )


def _victim_left(states: States, board: chess.Board, move: chess.Move, log_prior: float) -> Hypothesis:
    after = states.copy()
    after[move.from_square] = EMPTY
    after[move.to_square] = colour_state(board.turn)
    pawn, square = chess.Piece(chess.PAWN, not board.turn), chess.square_name(en_passant_victim(move))
    text = f"En passant: now take the {piece_name(pawn)} off {square}."
    advice = say("en_passant", text, piece=pawn, square=square)
    return Hypothesis(Happened.HALF, _changes(states, after), ((move,),), log_prior, advice=advice)
