"""The robot sets up the position that a game begins with, from wherever the pieces stand."""

from collections import Counter
from typing import TYPE_CHECKING

import chess

from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.table import Table
from kempelen.game.transfers import Crowded, Missing, Request

if TYPE_CHECKING:
    from kempelen.motion.setting_up import Differences


def setting_up_transfers(board: chess.Board, layout: Layout, table: Table) -> tuple[Transfer, ...] | Request:
    """The fewest transfers after which ``layout`` agrees with ``board``, in order.

    Args:
        board: As it shall stand.
        layout: What stands where now, trays included.
        table: For the distances between places.

    Returns:
        The transfers, or what the operator has to do first; with that done, ask again with the new layout.
    """
    from kempelen.motion.setting_up import Differences, plan_setting_up  # noqa: PLC0415 - brings an optimizer along

    wanted = board.piece_map()
    differences = Differences.between(layout, wanted)
    if lacking := differences.lacking(layout):
        return Missing(lacking[0], _free_place(layout, table, wanted, lacking[0]))
    if differences.leaving > sum(slot not in layout for slot in table.slots) + differences.fetched:
        return _crowded(layout, differences)
    return plan_setting_up(table, layout, wanted).transfers


def _free_place(
    layout: Layout, table: Table, wanted: dict[chess.Square, chess.Piece], piece: chess.Piece
) -> Place:
    """Where the piece belongs, if that is free; else a free slot, else any free square."""
    belongs = [Place.at(square) for square, meant in wanted.items() if meant == piece]
    squares = [Place.at(square) for square in chess.SQUARES]
    return next(place for place in (*belongs, *table.slots, *squares) if place not in layout)


def _crowded(layout: Layout, differences: "Differences") -> Crowded:
    """A piece that nobody needs: one of those that have to leave the board."""
    surplus = Counter(differences.wrong.values()) - Counter(differences.unfilled.values())
    square = next(square for square, piece in sorted(differences.wrong.items()) if surplus[piece])
    return Crowded(layout[Place.at(square)], Place.at(square))
