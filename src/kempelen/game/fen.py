"""Positions in Forsyth-Edwards notation, refused with reasons when no game can be played from them."""

import chess

from kempelen.core.errors import NotationError

_SHOWN = 90  # characters of a faulty FEN that are repeated in a message

_POSITION_FAULTS = {
    chess.STATUS_EMPTY: "the board is empty",
    chess.STATUS_NO_WHITE_KING: "the white king is missing",
    chess.STATUS_NO_BLACK_KING: "the black king is missing",
    chess.STATUS_TOO_MANY_KINGS: "a side has more than one king",
    chess.STATUS_TOO_MANY_WHITE_PAWNS: "White has more than 8 pawns",
    chess.STATUS_TOO_MANY_BLACK_PAWNS: "Black has more than 8 pawns",
    chess.STATUS_PAWNS_ON_BACKRANK: "a pawn stands on the first or last rank",
    chess.STATUS_TOO_MANY_WHITE_PIECES: "White has more than 16 pieces",
    chess.STATUS_TOO_MANY_BLACK_PIECES: "Black has more than 16 pieces",
    chess.STATUS_BAD_CASTLING_RIGHTS: "the castling rights do not fit kings and rooks",
    chess.STATUS_INVALID_EP_SQUARE: "the en passant square does not fit the pawns",
    chess.STATUS_OPPOSITE_CHECK: "the side that is not to move stands in check",
    chess.STATUS_TOO_MANY_CHECKERS: "the king is in check from more pieces than one move can bring",
    chess.STATUS_IMPOSSIBLE_CHECK: "the king is in check in a way that no move can bring about",
}


def parse_fen(text: str) -> chess.Board:
    """Read a position in Forsyth-Edwards notation.

    Raises:
        NotationError: It is unreadable, or no game of standard chess can be played from it; each fault is
            named.
    """
    shown = repr(text if len(text) <= _SHOWN else text[:_SHOWN] + "…")
    try:
        board = chess.Board(text.strip())
    except ValueError as error:
        why = f": {error}" if len(text) <= _SHOWN else ""
        raise NotationError(
            f"The position {shown} cannot be read as FEN{why}.",
            hint=f"A FEN looks like: {chess.STARTING_FEN}",
        ) from error
    if board.has_chess960_castling_rights():
        raise NotationError(
            f"The position {shown} is one of Chess960, which is not supported.",
            hint="Give castling rights for kings on e1 and e8 with rooks on the a and h files.",
        )
    faults = [words for flag, words in _POSITION_FAULTS.items() if board.status() & flag]
    if faults:
        raise NotationError(
            f"No game can be played from {shown}: {'; '.join(faults)}.", hint="Correct the FEN."
        )
    return board
