"""Why a move is not legal, in one sentence, and what to put where after it."""

from collections.abc import Sequence

import chess
import numpy as np

from kempelen.core.pieces import kind_name, piece_name
from kempelen.core.senses import states_of
from kempelen.core.words import joined, say
from kempelen.sensing.moves.differences import Repair, repairs, sentence
from kempelen.sensing.moves.evidence import States
from kempelen.sensing.moves.hypotheses import two_plies
from kempelen.sensing.moves.verdicts import Difference, Line
from kempelen.sensing.moves.ways import goes

PAIRS_OF_SQUARES = 6  # more differences than that are no two moves


def advise(board: chess.Board, found: Sequence[Difference]) -> str:
    """What is wrong and what to do about it, in plain sentences.

    Args:
        board: The position that should stand there.
        found: How the table differs from it.
    """
    if not found:
        return ""
    todo = repairs(found)
    return joined(_reason(board, found, todo), sentence(todo))


def _reason(board: chess.Board, found: Sequence[Difference], todo: Sequence[Repair]) -> str:
    moved = [r for r in todo if r.source is not None and r.target is not None]
    gone = [r for r in todo if r.source is None]
    rest = len(todo) - len(moved) - len(gone)
    if len(moved) == 1 and not rest and all(r.target == moved[0].source for r in gone):
        home, target = moved[0].target, moved[0].source
        if home is not None and target is not None:
            if any((m.from_square, m.to_square) == (home, target) for m in board.legal_moves):
                return ""  # one move too many, and nothing else against it
            return say("not_legal", f"That is no legal move: {why_illegal(board, home, target)}.")
    return _two_moves(board, found)


def _two_moves(board: chess.Board, found: Sequence[Difference]) -> str:
    """Two moves of one side, or a move of each."""
    if len(found) > PAIRS_OF_SQUARES:
        return ""
    seen = states_of(board)
    for difference in found:
        seen[difference.square] = difference.seen
    if line := _line_to(board, seen):
        first, second = (chess.square_name(m.to_square) for m in line)
        text = f"Two moves have been made, to {first} and to {second}, but only one was due."
        return say("two_moves", text, first=first, second=second)
    if line := _same_side_twice(board, seen):
        side = "White" if board.turn else "Black"
        first, second = (chess.square_name(m.to_square) for m in line)
        text = f"{side} has moved twice, to {first} and to {second}."
        return say("moved_twice", text, first=first, second=second)
    return ""


def _line_to(board: chess.Board, seen: States) -> Line:
    lines = two_plies(board, states_of(board), list(board.legal_moves))
    return next((line for line, states in lines if np.array_equal(states, seen)), ())


def _same_side_twice(board: chess.Board, seen: States) -> Line:
    before = board.copy(stack=False)
    for first in board.legal_moves:
        before.push(first)
        if not before.is_check():
            before.push(chess.Move.null())
            for second in before.legal_moves:
                before.push(second)
                same = np.array_equal(states_of(before), seen)
                before.pop()
                if same:
                    return first, second
            before.pop()
        before.pop()
    return ()


def why_illegal(board: chess.Board, home: chess.Square, target: chess.Square) -> str:
    """Why the piece on ``home`` cannot go to ``target``; without a full stop.

    Args:
        board: Before the move.
        home: Where the piece belongs; not empty.
        target: Where it stands.
    """
    piece = board.piece_at(home)
    if piece is None:
        return f"nothing stands on {chess.square_name(home)}"
    way = f"from {chess.square_name(home)} to {chess.square_name(target)}"
    if piece.color != board.turn:
        return f"the {piece_name(piece)} went {way}, but it is {'White' if board.turn else 'Black'}'s turn"
    cannot = f"the {kind_name(piece.piece_type)} cannot go {way}"
    return f"{cannot}: {_obstacle(board, piece, home, target)}"


def _obstacle(board: chess.Board, piece: chess.Piece, home: chess.Square, target: chess.Square) -> str:
    pseudo = [m for m in board.pseudo_legal_moves if m.from_square == home and m.to_square == target]
    if pseudo:
        return _check(board, pseudo[0])
    between = [s for s in chess.SquareSet.between(home, target) if board.piece_at(s)]
    if goes(piece, home, target) and between:
        return f"the {_standing(board, between[0])} stands in the way"
    victim = board.piece_at(target)
    if victim and victim.color == piece.color:
        return f"the {_standing(board, target)} stands there"
    if piece.piece_type == chess.PAWN:
        return _pawn(board, home, target)
    if piece.piece_type == chess.KING and chess.square_distance(home, target) > 1:
        return (
            "castling is not possible now" if _castles(home, target) else "a king goes one square at a time"
        )
    return f"a {kind_name(piece.piece_type)} does not go that way"


def _check(board: chess.Board, move: chess.Move) -> str:
    """Why a move that the piece could make is still forbidden."""
    after = board.copy(stack=False)
    after.push(move)
    king = after.king(board.turn)
    attackers = after.attackers(not board.turn, king) if king is not None else chess.SquareSet()
    if not attackers:
        return "the rules forbid it here"
    by = _standing(after, next(iter(attackers)))
    side = "White" if board.turn else "Black"
    return f"{side}'s king would {'still ' if board.is_check() else ''}be in check from the {by}"


def _pawn(board: chess.Board, home: chess.Square, target: chess.Square) -> str:
    if chess.square_file(home) == chess.square_file(target):
        if board.piece_at(target):
            return f"the {_standing(board, target)} stands there, and a pawn takes sideways"
        return "a pawn does not go that far"
    if chess.square_distance(home, target) == 1:
        return "a pawn goes sideways only to take something"
    return "a pawn does not go that way"


def _castles(home: chess.Square, target: chess.Square) -> bool:
    return chess.square_rank(home) == chess.square_rank(target) and chess.square_file(target) in {2, 6}


def _standing(board: chess.Board, square: chess.Square) -> str:
    piece = board.piece_at(square)
    name = piece_name(piece) if piece else "piece"
    return f"{name} on {chess.square_name(square)}"
