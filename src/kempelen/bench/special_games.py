"""Seeded games rich in what is rare: castling, en passant, promotions of all kinds.

Legal random play with a taste for the unusual. Every promotion asks for a piece that stands in the trays by
then (a spare queen or a captured piece), so that no operator is needed.
"""

import random

import chess

from kempelen.core.table import pieces_off_board
from kempelen.game.pgn import GameScore

_TRIES = 4000
_LEAST_PLIES, _MOST_PLIES = 40, 160
_WANTED_PROMOTIONS = 2


def special_game(seed: int) -> GameScore:
    """A game with castling, en passant and at least two promotions, one of them an underpromotion.

    Args:
        seed: The same one gives the same game.

    Raises:
        RuntimeError: no such game was found among a few thousand; never seen.
    """
    rng = random.Random(seed)  # noqa: S311 - seeded games, not secrets
    for _ in range(_TRIES):
        board, rare = _play(rng)
        if _rich(rare):
            headers = {"Event": "Special moves", "White": "Special", "Black": str(seed), "Round": str(seed)}
            return GameScore(
                headers, chess.STARTING_FEN, tuple(board.move_stack), board.result(claim_draw=False)
            )
    raise RuntimeError(f"no special game with seed {seed}")


def _play(rng: random.Random) -> tuple[chess.Board, list[str]]:
    board, rare = chess.Board(), list[str]()
    while not board.is_game_over() and len(board.move_stack) < _MOST_PLIES:
        moves = [move for move in board.legal_moves if _possible(board, move)]
        move = rng.choices(moves, [_taste(board, move) for move in moves])[0]
        rare += _rarities(board, move)
        board.push(move)
        if _rich(rare) and len(board.move_stack) >= _LEAST_PLIES:
            break
    return board, rare


def _possible(board: chess.Board, move: chess.Move) -> bool:
    """Whether the piece that a promotion needs stands in the trays."""
    if move.promotion is None:
        return True
    wanted = chess.Piece(move.promotion, board.turn)
    return wanted in pieces_off_board(board, board.turn)


def _taste(board: chess.Board, move: chess.Move) -> float:
    if board.is_castling(move) or board.is_en_passant(move):
        return 200.0
    if move.promotion is not None:
        return 60.0 if move.promotion == chess.QUEEN else 100.0
    if board.piece_type_at(move.from_square) == chess.PAWN:
        rank = chess.square_rank(move.to_square)
        return 1.0 + (rank if board.turn else 7 - rank) ** 2
    return 3.0 if board.is_capture(move) else 2.0


def _rarities(board: chess.Board, move: chess.Move) -> list[str]:
    if board.is_castling(move):
        return ["castling"]
    if board.is_en_passant(move):
        return ["en passant"]
    if move.promotion is not None:
        return [f"={chess.piece_symbol(move.promotion)}"]
    return []


def _rich(rare: list[str]) -> bool:
    promotions = [what for what in rare if what.startswith("=")]
    under = [what for what in promotions if what != "=q"]
    return (
        "castling" in rare and "en passant" in rare and len(promotions) >= _WANTED_PROMOTIONS and bool(under)
    )
