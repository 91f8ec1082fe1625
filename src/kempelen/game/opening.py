"""Beginning a game: headers, layout, first record."""

from collections.abc import Mapping

import chess

from kempelen.core.places import Layout
from kempelen.core.table import Table, start_layout
from kempelen.game.clock import TimeControl
from kempelen.game.fen import parse_fen
from kempelen.game.journal import GameLog, Journal
from kempelen.game.modes import Mode, Pairing, TakeOver
from kempelen.game.options import ArbiterOptions
from kempelen.game.records import Begun, ClockSpec


def new_game(
    journal: Journal,
    pairing: Pairing,
    table: Table,
    *,
    start_fen: str = chess.STARTING_FEN,
    headers: Mapping[str, str] | None = None,
    take_over: TakeOver | None = None,
    options: ArbiterOptions | None = None,
    clock: TimeControl | None = None,
    layout: Layout | None = None,
) -> GameLog:
    """Write the beginning of a game.

    Args:
        journal: Gets a new game.
        pairing: Who plays whom.
        table: The trays hold what is not on the board, spare queens included.
        start_fen: The position of the first move.
        headers: PGN tags that are known better than the defaults.
        take_over: Another pairing that takes over later.
        options: The same ones go to the arbiter.
        clock: Time control; None: the game is played without a clock.
        layout: Where the pieces stand, if not as `start_layout` says; the robot then sets up ``start_fen``.

    Raises:
        NotationError: No game can be played from ``start_fen``.
        FitError: The trays have too few slots.
        JournalError: It could not be written.
    """
    options = options or ArbiterOptions()
    board = parse_fen(start_fen)
    now = journal.now()
    tags = {
        "Event": {Mode.PLAY: "Casual game", Mode.WATCH: "Engine game", Mode.REPLAY: "Replay"}[pairing.mode],
        "Site": "Kempelen chess robot",
        "Date": now.strftime("%Y.%m.%d"),
        "Round": "-",
        "White": pairing.white.spec.name,
        "Black": pairing.black.spec.name,
        "UTCDate": now.strftime("%Y.%m.%d"),
        "UTCTime": now.strftime("%H:%M:%S"),
    }
    if clock is not None:
        tags["TimeControl"] = str(clock)
    begun = Begun(
        headers=tags | dict(headers or {}),
        start_fen=start_fen,
        pairing=pairing.spec,
        take_over=take_over.spec if take_over else None,
        hands=options.hands,
        table=options.table_digest,
        robot=options.robot,
        layout=layout or start_layout(table, board),
        clock=ClockSpec(seconds=clock.seconds, increment=clock.increment) if clock else None,
    )
    return journal.begin(begun)
