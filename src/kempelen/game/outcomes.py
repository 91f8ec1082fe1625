"""When a game is over, and why (FIDE Laws of Chess 2023, articles 5 and 9)."""

import chess

from kempelen.game.records import RESULTS, Ended, Result

_REASONS = {
    chess.Termination.CHECKMATE: "checkmate",
    chess.Termination.STALEMATE: "stalemate",
    chess.Termination.INSUFFICIENT_MATERIAL: "insufficient material",
    chess.Termination.SEVENTYFIVE_MOVES: "75 moves without capture or pawn move",
    chess.Termination.FIVEFOLD_REPETITION: "fivefold repetition",
}
_LATE = "forfeits on time"


def as_result(text: str) -> Result:
    """A PGN result; whatever is none counts as ``*``."""
    return next((result for result in RESULTS if result == text), "*")


def end_of(board: chess.Board, *, claim_draws: bool) -> Ended | None:
    """How the game has ended in this position; None when it goes on.

    Args:
        board: With the whole game on its move stack, for repetitions.
        claim_draws: Threefold repetition and fifty moves end the game too, as if the side to move claimed it.
    """
    if (outcome := board.outcome(claim_draw=False)) is not None:
        return Ended(result=as_result(outcome.result()), reason=_REASONS[outcome.termination])
    if claim_draws and board.is_repetition(3):
        return Ended(result="1/2-1/2", reason="threefold repetition")
    if claim_draws and board.is_fifty_moves():
        return Ended(result="1/2-1/2", reason="50 moves without capture or pawn move")
    return None


def by_resignation(loser: chess.Color) -> Ended:
    """``loser`` gives up."""
    return Ended(result="0-1" if loser else "1-0", reason=f"{'White' if loser else 'Black'} resigns")


def by_time(board: chess.Board, loser: chess.Color) -> Ended:
    """The time of ``loser`` is over (article 6.9): a draw if its opponent cannot mate by any moves."""
    late = "White" if loser else "Black"
    if board.has_insufficient_material(not loser):
        other = "Black" if loser else "White"
        return Ended(result="1/2-1/2", reason=f"{late} {_LATE}, but {other} cannot mate")
    return Ended(result="0-1" if loser else "1-0", reason=f"{late} {_LATE}")


def termination(ended: Ended | None) -> str:
    """The PGN tag Termination; None: the game goes on another time."""
    if ended is None:
        return "unterminated"
    return "time forfeit" if _LATE in ended.reason else "normal"


def by_agreement() -> Ended:
    """Both sides want a draw."""
    return Ended(result="1/2-1/2", reason="draw agreed")


def by_score(result: str) -> Ended:
    """The replayed score has no further move; its headers tell the result."""
    return Ended(result=as_result(result), reason="score ends")
