"""Ways that pieces go on an empty board."""

import chess

_RANKS_AHEAD = {chess.WHITE: 1, chess.BLACK: -1}
_HOME_RANK = {chess.WHITE: 1, chess.BLACK: 6}


def goes(piece: chess.Piece, home: chess.Square, target: chess.Square) -> bool:
    """Whether the piece could go from ``home`` to ``target`` without taking, were the board empty."""
    if piece.piece_type == chess.PAWN:
        return _advances(piece.color, home, target)
    return takes(piece, home, target)


def takes(piece: chess.Piece, home: chess.Square, target: chess.Square) -> bool:
    """Whether the piece on ``home`` could take something on ``target``, were nothing else on the board."""
    empty = chess.BaseBoard(None)
    empty.set_piece_at(home, piece)
    return target in empty.attacks(home)


def _advances(colour: chess.Color, home: chess.Square, target: chess.Square) -> bool:
    if chess.square_file(home) != chess.square_file(target):
        return False
    ranks = (chess.square_rank(target) - chess.square_rank(home)) * _RANKS_AHEAD[colour]
    return ranks in ({1, 2} if chess.square_rank(home) == _HOME_RANK[colour] else {1})
