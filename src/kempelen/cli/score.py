"""The game so far, for the picture: moves in SAN and what was taken."""

import chess

_WORTH = (chess.QUEEN, chess.ROOK, chess.BISHOP, chess.KNIGHT, chess.PAWN)


def move_log(board: chess.Board) -> list[str]:
    """A line for each full move."""
    replay = board.root()
    lines: list[str] = []
    for move in board.move_stack:
        san = replay.san(move)
        if replay.turn or not lines:
            lines.append(f"{replay.fullmove_number:>3}. {san if replay.turn else '…'}")
        if not replay.turn:
            lines[-1] = f"{lines[-1]:<13} {san}"
        replay.push(move)
    return lines


def captured(board: chess.Board) -> tuple[list[chess.Piece], list[chess.Piece]]:
    """White's pieces that were taken, and Black's; the heaviest first."""
    replay = board.root()
    taken: list[chess.Piece] = []
    for move in board.move_stack:
        if replay.is_en_passant(move):
            taken.append(chess.Piece(chess.PAWN, not replay.turn))
        elif (piece := replay.piece_at(move.to_square)) is not None and replay.is_capture(move):
            taken.append(piece)
        replay.push(move)
    taken.sort(key=lambda piece: _WORTH.index(piece.piece_type))
    return [p for p in taken if p.color], [p for p in taken if not p.color]
