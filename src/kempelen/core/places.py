"""Places, transfers and what stands where.

A place is a square or a tray slot, and holds at most one piece. Its name is what people, journal and logs
use: ``e4``, ``left7``.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Self

import chess

from kempelen.core.errors import KempelenError

_SLOT = re.compile(r"[a-z]{2,12}[1-9][0-9]{0,2}")


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A square or a tray slot.

    Attributes:
        name: ``"e4"`` for a square; tray name and number from 1 for a slot, ``"left7"``.
    """

    name: str

    @classmethod
    def at(cls, square: chess.Square) -> Self:
        """The place of a python-chess square 0..63."""
        return cls(chess.SQUARE_NAMES[square])

    @classmethod
    def slot(cls, tray: str, number: int) -> Self:
        """Slot ``number`` (from 1) of a tray."""
        return cls(f"{tray}{number}")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read a place's name.

        Raises:
            KempelenError: the text names neither a square nor a slot.
        """
        name = text.strip().lower()
        if name in chess.SQUARE_NAMES or _SLOT.fullmatch(name):
            return cls(name)
        raise KempelenError(
            f"'{text}' is no place.", hint="Name a square (a1..h8) or a tray slot (left1, right3)."
        )

    @property
    def square(self) -> chess.Square | None:
        """0..63, or None for a slot."""
        return chess.SQUARE_NAMES.index(self.name) if self.name in chess.SQUARE_NAMES else None

    @property
    def is_square(self) -> bool:
        """Whether this is one of the 64 squares."""
        return self.name in chess.SQUARE_NAMES

    @property
    def tray(self) -> str:
        """Name of the tray; empty for a square."""
        return "" if self.is_square else self.name.rstrip("0123456789")

    @property
    def number(self) -> int:
        """Number of the slot, from 1; 0 for a square."""
        return 0 if self.is_square else int(self.name[len(self.tray) :])

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class Transfer:
    """One piece from one place to another; a move is 1 to 4 of them."""

    piece: chess.Piece
    source: Place
    target: Place

    def __str__(self) -> str:
        return f"{self.piece.symbol()} {self.source}-{self.target}"


class Layout(Mapping[Place, chess.Piece]):
    """What stands where, squares and slots alike. Immutable; changes give a new layout."""

    __slots__ = ("_pieces",)

    def __init__(self, pieces: Mapping[Place, chess.Piece]) -> None:
        self._pieces = dict(pieces)

    def __getitem__(self, place: Place) -> chess.Piece:
        return self._pieces[place]

    def __iter__(self) -> Iterator[Place]:
        return iter(self._pieces)

    def __len__(self) -> int:
        return len(self._pieces)

    def __repr__(self) -> str:
        return f"Layout({', '.join(f'{p.symbol()}{place}' for place, p in sorted(self.items()))})"

    def without(self, place: Place) -> "Layout":
        """The layout with that place empty."""
        return Layout({k: v for k, v in self._pieces.items() if k != place})

    def having(self, place: Place, piece: chess.Piece) -> "Layout":
        """The layout with ``piece`` standing on ``place``.

        Raises:
            KempelenError: the place is taken.
        """
        if place in self._pieces:
            raise KempelenError(
                f"{place} is taken by {self._pieces[place].symbol()}; {piece.symbol()} cannot stand there.",
                hint="Check the position on the table against the game.",
            )
        return Layout({**self._pieces, place: piece})

    def after(self, transfer: Transfer) -> "Layout":
        """The layout once the transfer is done.

        Raises:
            KempelenError: the source holds another piece, or the target is taken.
        """
        if self._pieces.get(transfer.source) != transfer.piece:
            raise KempelenError(
                f"{transfer.source} holds {self._pieces.get(transfer.source) or 'nothing'}, "
                f"not the {transfer.piece.symbol()} to carry.",
                hint="Check the position on the table against the game.",
            )
        return self.without(transfer.source).having(transfer.target, transfer.piece)

    def board_part(self) -> dict[chess.Square, chess.Piece]:
        """Squares only, as python-chess's piece map."""
        return {s: p for place, p in self._pieces.items() if (s := place.square) is not None}
