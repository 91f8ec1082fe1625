"""A game as people keep it: the log in SAN, and a PGN file that is up to date after every move."""

import os
from collections.abc import Callable
from pathlib import Path

from kempelen.core.events import Event, GameOver, GameStarted, MoveCommitted, MoveTakenBack
from kempelen.game.notation import numbered, san_log
from kempelen.game.outcomes import termination
from kempelen.game.pgn import GameScore
from kempelen.game.pgn_write import format_pgn, write_pgn
from kempelen.game.state import GameState


def score_of(state: GameState) -> GameScore:
    """The game so far, with full headers; players who took over stand behind those before them."""
    white, black = (" / ".join(names) for names in state.names)
    headers = dict(state.begun.headers)
    headers["White"] = white if len(state.names[0]) > 1 else headers.get("White", white)
    headers["Black"] = black if len(state.names[1]) > 1 else headers.get("Black", black)
    headers["Termination"] = termination(state.ended)
    return GameScore(
        headers=headers,
        start_fen=state.begun.start_fen,
        moves=tuple(state.board.move_stack),
        result=state.ended.result if state.ended else "*",
    )


def pgn_of(state: GameState) -> str:
    """The game so far as PGN; the reason of its end is a comment before the result."""
    return format_pgn(score_of(state), comment=_reason(state))


def san_of(state: GameState) -> str:
    """The log in one line: ``1. e4 e5 2. Nf3``."""
    start = state.begun.start_fen
    return " ".join(numbered(start, san_log(start, state.board.move_stack)))


def _reason(state: GameState) -> str:
    return state.ended.reason if state.ended else ""


class PgnKeeper:
    """An observer (`kempelen.game.observers.EventBus.listen`) that writes the PGN after every move.

    Args:
        path: Of the file; it holds this game alone.
        state: Gives the game as it is now.
    """

    def __init__(self, path: str | os.PathLike[str], state: Callable[[], GameState]) -> None:
        self.path = Path(path)
        self._state = state

    def __call__(self, event: Event) -> None:
        """Write the file if the game has changed."""
        if isinstance(event, GameStarted | MoveCommitted | MoveTakenBack | GameOver):
            state = self._state()
            write_pgn(self.path, score_of(state), comment=_reason(state))
