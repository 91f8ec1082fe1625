"""A move becomes transfers: which piece goes from which place to which, squares and tray slots alike.

Pieces of one kind and colour are alike, so a piece that is needed from the tray is the nearest one of its
kind, whether it was captured or stood there as a spare. Everything here is a pure function of position,
layout and table.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import chess
import numpy as np

from kempelen.core.errors import OperatorNeededError
from kempelen.core.pieces import piece_name
from kempelen.core.places import Layout, Place, Transfer
from kempelen.core.table import Table
from kempelen.core.words import joined, say

OTHER_SIDE_SQUARES = 4.0  # a slot on the opponent's side of the board counts as this much farther away


@dataclass(frozen=True, slots=True)
class Missing:
    """The table lacks a piece that the move needs: the operator stands ``piece`` on ``place``."""

    piece: chess.Piece
    place: Place

    @property
    def reason(self) -> str:
        """Why it is needed."""
        return say("tray_lacks", f"The trays hold no {piece_name(self.piece)}.", piece=self.piece)

    @property
    def text(self) -> str:
        """What to do."""
        return joined(self.reason, say("stand_one", f"Stand one on {self.place}.", place=str(self.place)))

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Crowded:
    """The trays are full: the operator takes ``piece``, which nobody needs, away from ``place``."""

    piece: chess.Piece
    place: Place

    @property
    def reason(self) -> str:
        """Why it is in the way."""
        return say("trays_full", "The trays are full.")

    @property
    def text(self) -> str:
        """What to do."""
        name, place = piece_name(self.piece), str(self.place)
        return joined(
            self.reason, say("take_off", f"Take the {name} off {place}.", piece=self.piece, place=place)
        )

    def __str__(self) -> str:
        return self.text


Request = Missing | Crowded


class _RequestError(Exception):
    """Ends the planning of a move that waits for the operator; never leaves this module."""

    def __init__(self, request: Request) -> None:
        super().__init__(str(request))
        self.request = request


def move_transfers(
    board: chess.Board, move: chess.Move, layout: Layout, table: Table
) -> tuple[Transfer, ...] | Request:
    """The 1 to 4 transfers that make a move on the table, in order.

    Args:
        board: Before the move.
        move: Legal in ``board``; castling as python-chess writes it for that board, Chess960 included.
        layout: What stands where; its squares agree with ``board``.
        table: For the distances between places.

    Returns:
        The transfers, or what the operator has to do first; with that done, ask again with the new layout.

    Raises:
        OperatorNeededError: The layout's squares differ from ``board``.
    """
    check_agreement(board, layout)
    return _attempt(_move_steps, board, move, layout, table)


def takeback_transfers(board: chess.Board, layout: Layout, table: Table) -> tuple[Transfer, ...] | Request:
    """The transfers that undo the last move of ``board``'s stack on the table; as `move_transfers`.

    Raises:
        OperatorNeededError: The layout's squares differ from ``board``.
    """
    check_agreement(board, layout)
    before = board.copy()
    move = before.pop()
    return _attempt(_undo_steps, before, move, layout, table)


def check_agreement(board: chess.Board, layout: Layout) -> None:
    """Make sure that a layout's squares hold what the position says.

    Raises:
        OperatorNeededError: They do not; the message names the squares.
    """
    wanted, standing = board.piece_map(), layout.board_part()
    differing = sorted(s for s in chess.SQUARES if wanted.get(s) != standing.get(s))
    if differing:
        raise OperatorNeededError(
            "The recorded places of the pieces differ from the position of the game on "
            f"{', '.join(chess.square_name(s) for s in differing)}.",
            hint="Put the pieces as the position shows them and tell the program where they stand.",
        )


def _attempt(
    steps: "Callable[[chess.Board, chess.Move, _Carrier], None]",
    board: chess.Board,
    move: chess.Move,
    layout: Layout,
    table: Table,
) -> tuple[Transfer, ...] | Request:
    carrier = _Carrier(layout, table)
    try:
        steps(board, move, carrier)
    except _RequestError as needed:
        return needed.request
    return tuple(carrier.transfers)


class _Carrier:
    """Collects transfers and keeps the layout that results from them."""

    def __init__(self, layout: Layout, table: Table) -> None:
        self.layout = layout
        self.table = table
        self.transfers: list[Transfer] = []

    def carry(self, source: Place, target: Place) -> None:
        transfer = Transfer(self.layout[source], source, target)
        self.layout = self.layout.after(transfer)
        self.transfers.append(transfer)

    def carry_many(self, ways: Sequence[tuple[Place, Place]]) -> None:
        """Each piece along its way, in an order in which every target is free when its piece arrives.

        Castling in Chess960 may put the king where the rook stands and the rook where the king stands; then
        one of them waits on the nearest free place.
        """
        waiting = [way for way in ways if way[0] != way[1]]
        while waiting:
            ready = next((way for way in waiting if way[1] not in self.layout), None)
            if ready is None:
                source, target = waiting.pop()
                aside = self._nearest(source, (p for p in self.table.places if p not in self.layout))
                self.carry(source, aside)
                waiting.append((aside, target))
            else:
                waiting.remove(ready)
                self.carry(*ready)

    def put_away(self, source: Place) -> None:
        """Into the trays: the nearest free slot, its own side of the board preferred."""
        self.carry(source, self._free_slot(source, self.layout[source].color))

    def fetch(self, piece: chess.Piece, target: Place) -> None:
        """From the trays: the nearest piece of that kind and colour."""
        sources = [slot for slot in self.table.slots if self.layout.get(slot) == piece]
        if not sources:
            raise _RequestError(Missing(piece, self._free_slot(target, piece.color)))
        self.carry(self._nearest(target, sources), target)

    def _free_slot(self, near: Place, colour: chess.Color) -> Place:
        free = [slot for slot in self.table.slots if slot not in self.layout]
        if not free:
            raise _RequestError(self._crowded())
        foreign = self.table.trays[-1 if colour else 0].name if len(self.table.trays) > 1 else ""
        penalty = OTHER_SIDE_SQUARES * self.table.square
        return min(free, key=lambda slot: self._distance(near, slot) + penalty * (slot.tray == foreign))

    def _crowded(self) -> Crowded:
        """The least useful piece in the trays: no pawn is ever fetched for a promotion."""
        standing = [(self.layout[slot].piece_type, slot) for slot in self.table.slots if slot in self.layout]
        if not standing:
            raise OperatorNeededError(
                "The table has no tray, and a piece must leave the board.",
                hint="Configure trays beside the board.",
            )
        _, slot = min(standing, key=lambda item: item[0])
        return Crowded(self.layout[slot], slot)

    def _nearest(self, to: Place, places: Iterable[Place]) -> Place:
        return min(places, key=lambda place: self._distance(to, place))

    def _distance(self, a: Place, b: Place) -> float:
        """Between two centres in the plane, mm; rounded, so that ties are ties on every machine."""
        difference = self.table.centre(a)[:2] - self.table.centre(b)[:2]
        return round(float(np.hypot(*difference)), 3)


def _move_steps(board: chess.Board, move: chess.Move, carrier: _Carrier) -> None:
    if board.is_castling(move):
        carrier.carry_many(_castling_ways(board, move))
        return
    source, target = Place.at(move.from_square), Place.at(move.to_square)
    if (victim := captured_square(board, move)) is not None:
        carrier.put_away(Place.at(victim))
    if move.promotion is None:
        carrier.carry(source, target)
    else:
        carrier.put_away(source)
        carrier.fetch(chess.Piece(move.promotion, board.turn), target)


def _undo_steps(before: chess.Board, move: chess.Move, carrier: _Carrier) -> None:
    if before.is_castling(move):
        carrier.carry_many([(target, source) for source, target in _castling_ways(before, move)])
        return
    source, target = Place.at(move.from_square), Place.at(move.to_square)
    if move.promotion is None:
        carrier.carry(target, source)
    else:
        carrier.put_away(target)
        carrier.fetch(chess.Piece(chess.PAWN, before.turn), source)
    if (victim := captured_square(before, move)) is not None:
        piece = before.piece_at(victim)
        if piece is not None:
            carrier.fetch(piece, Place.at(victim))


def captured_square(board: chess.Board, move: chess.Move) -> chess.Square | None:
    """Where the piece stands that ``move`` takes; for en passant not the square that the move goes to."""
    if board.is_en_passant(move):
        return chess.square(chess.square_file(move.to_square), chess.square_rank(move.from_square))
    return move.to_square if board.is_capture(move) else None


def _castling_ways(board: chess.Board, move: chess.Move) -> tuple[tuple[Place, Place], tuple[Place, Place]]:
    """(source, target) of the king, then of the rook."""
    kingside = board.is_kingside_castling(move)
    rank = chess.square_rank(move.from_square)
    # python-chess writes castling as "king takes rook" in Chess960, else as the king's two squares.
    if board.color_at(move.to_square) == board.turn:
        rook = move.to_square
    else:
        rook = chess.square(7 if kingside else 0, rank)
    king_to, rook_to = (chess.square(file, rank) for file in ((6, 5) if kingside else (2, 3)))
    return (Place.at(move.from_square), Place.at(king_to)), (Place.at(rook), Place.at(rook_to))
