"""The robot sets up a position: where the pieces stand before, and the game without moves that it is."""

import chess

from kempelen.app.cast import GameRequest
from kempelen.app.config import Config
from kempelen.app.paths import journal_path
from kempelen.app.table_session import calibrated_table
from kempelen.core.errors import GameError
from kempelen.core.places import Layout
from kempelen.core.table import Table, start_layout
from kempelen.core.words import say
from kempelen.game.fen import parse_fen
from kempelen.game.journal import JournalReader
from kempelen.game.modes import Mode
from kempelen.game.pgn import GameScore

LAST = "last"
"""Where the newest game of the journal left the pieces; before the first one, as at the start of a game."""


def standing_after(config: Config, table: Table, told: str) -> Layout:
    """Where everything stands now.

    Args:
        config: For the journal.
        table: For its trays, where a position is told.
        told: `LAST`, the number of a game in the journal, or a position in Forsyth-Edwards notation; what is
            not on that board waits in the trays as at the start of a game.

    Raises:
        GameError: the game is in the midst of a move, so that a piece may be in the hand.
        JournalError: there is no such game.
        NotationError: this is no position.
        FitError: the trays have too few slots.
    """
    if told != LAST and not told.isdecimal():
        return start_layout(table, parse_fen(told))
    if told == LAST and not journal_path(config.data_dir).exists():
        return start_layout(table, chess.Board())
    with JournalReader(journal_path(config.data_dir)) as journal:
        game = journal.latest() if told == LAST else int(told)
        state = journal.state(game)
    if state.pending is not None:
        raise GameError(
            say(
                "left_in_move",
                f"Game {game} was left in the midst of a move; the hand may hold a piece.",
                game=game,
            ),
            hint=say("finish_it_first", f"Finish the move first: kempelen resume {game}", game=game),
        )
    return state.layout


def setup_request(config: Config, fen: str, told: str) -> GameRequest:
    """A game without moves, before which the robot sets up ``fen``.

    Args:
        config: For table and journal.
        fen: The position wanted.
        told: Where the pieces stand, as for `standing_after`.

    Raises:
        KempelenError: as `standing_after` and `calibrated_table`.
    """
    score = GameScore({"Event": "Set-up", "White": "Kempelen", "Black": "Kempelen"}, fen, ())
    standing = standing_after(config, calibrated_table(config), told)
    return GameRequest(Mode.REPLAY, fen, score=score, standing=standing)
