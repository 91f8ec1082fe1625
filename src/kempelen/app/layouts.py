"""Layouts as the eyes are told of them."""

from collections.abc import Sequence

import chess

from kempelen.core.places import Layout, Transfer


def layout_after(layout: Layout, transfers: Sequence[Transfer]) -> Layout:
    """With all transfers made that are not."""
    for transfer in transfers:
        if layout.get(transfer.source) == transfer.piece and transfer.target not in layout:
            layout = layout.after(transfer)
    return layout


def board_of(layout: Layout) -> chess.BaseBoard:
    """The squares of a layout."""
    board = chess.BaseBoard(None)
    board.set_piece_map(layout.board_part())
    return board
