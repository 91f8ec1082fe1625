"""Who stands where: worked out from the confirmed position and the order of what was lifted and set since.

A reed switch knows that something stands on it, not what. So every way in which the pieces in the air may
have come down is followed at once, each with a weight: two captures by one piece leave the same squares
occupied, and only the order tells which of the victims was taken off.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Self

import chess
import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.reed import Change, squares_in

_MOST = 48
"""Ways that are followed."""
_LEAST = 1e-7
"""A way that is so much less likely than the likeliest is given up."""
_ALIKE = 1e-3
"""Ways that are not less likely than that beside the likeliest count as much as it does: weights that tell
only how people usually move are no ground for a decision."""
_LEFT = 1e-6
"""That a piece of the side to move is off the board when nothing has moved for a while, though it might
stand."""
STRANGER = "?"
"""A piece from beside the board."""

# Weights of a piece that comes down.
_MOVES = 1.0  # a piece of the side to move, where it can go, or back where it was
_ASTRAY = 0.03  # elsewhere
_BACK = 0.02  # a piece of the other side, back where it was, while one that could take it is in the air
_PUT_BACK = 0.5  # the same with none in the air
_OTHER = 0.003  # a piece of the other side elsewhere: taking moves back, or nonsense
_UNSEEN = 0.3  # one that has left a square whose switch cannot be believed
_SLID = 0.02  # a neighbour on its way across the edge of two squares
_BESIDE = 0.01  # one from beside the board
_UNCALLED = 1e-5  # times these three, while a piece is in the air
_GHOST = 0.05  # an event that does not fit what was followed


@dataclass(frozen=True, slots=True)
class Aloft:
    """A piece off the board: its letter and where it was lifted."""

    man: str
    home: int


@dataclass(frozen=True, slots=True)
class Way:
    """One story of what happened.

    Attributes:
        standing: 64 letters as FEN has them, ``.`` for none, ``?`` for a stranger.
        aloft: Pieces off the board, in the order in which they were lifted.
    """

    standing: str
    aloft: tuple[Aloft, ...] = ()

    def lifted(self, square: int) -> Self:
        """With that square's piece in the air."""
        gone = Aloft(self.standing[square], square)
        return type(self)(_with(self.standing, square, "."), (*self.aloft, gone))

    def set_down(self, index: int, square: int) -> Self:
        """With a piece from the air on that square."""
        man = self.aloft[index].man
        return type(self)(_with(self.standing, square, man), (*self.aloft[:index], *self.aloft[index + 1 :]))

    def appeared(self, man: str, square: int, source: int | None = None) -> Self:
        """With a piece on that square that was not seen to come."""
        standing = self.standing if source is None else _with(self.standing, source, ".")
        return type(self)(_with(standing, square, man), self.aloft)


def _with(standing: str, square: int, man: str) -> str:
    return standing[:square] + man + standing[square + 1 :]


def letters(board: chess.BaseBoard) -> str:
    """64 letters of a position."""
    pieces = board.piece_map()
    return "".join(pieces[s].symbol() if s in pieces else "." for s in chess.SQUARES)


def _is_white(man: str) -> bool | None:
    """None for a stranger, and for nothing."""
    return None if man in {STRANGER, "."} else man.isupper()


class Men:
    """All ways, weighed.

    Args:
        board: The confirmed position; its turn says whose pieces are being moved.
    """

    def __init__(self, board: chess.Board) -> None:
        self._ways: dict[Way, float] = {}
        self._colours: Array | None = None
        self.begin(board)

    def begin(self, board: chess.Board) -> None:
        """A position has been confirmed: what went before is over."""
        self.board = board.copy(stack=False)
        self._goals: dict[int, set[int]] = {}
        for move in board.pseudo_legal_moves:
            self._goals.setdefault(move.from_square, set()).add(move.to_square)
        self._ways = {Way(letters(board)): 1.0}
        self._colours = None

    @property
    def awaited(self) -> str:
        """Letter and home of a piece off the board, when a move is being made; else empty.

        One of the side to move has to come down again; one of the other side is a victim whose taker has not
        moved yet.
        """
        way = max(self._ways, key=lambda way: self._ways[way] * _LEFT ** self._own(way))
        own = [each for each in way.aloft if _is_white(each.man) is self.board.turn]
        waiting = own or ([] if self._own_moved(way) else list(way.aloft))
        return f"{waiting[-1].man}{chess.square_name(waiting[-1].home)}" if waiting else ""

    def _own_moved(self, way: Way) -> bool:
        """Whether a piece of the side to move stands elsewhere."""
        pairs = zip(letters(self.board), way.standing, strict=True)
        return any(
            before != now and (_is_white(before) is self.board.turn or _is_white(now) is self.board.turn)
            for before, now in pairs
        )

    def comes_from(self, target: int) -> int:
        """Squares from which the side to move can reach one of ``target``."""
        return sum(
            1 << home for home, goals in self._goals.items() if any(target >> goal & 1 for goal in goals)
        )

    def follow(self, change: Change, unsure: int = 0) -> None:
        """A piece was lifted or set.

        Args:
            change: What the switch said.
            unsure: Squares whose switches cannot be believed, so that a piece may have left unnoticed.
        """
        if not change.placed:
            self._keep(self._lift(change.square))
        elif not change.doubtful:
            self._keep(self._set(change.square, unsure))

    def _lift(self, square: int) -> Iterator[tuple[Way, float]]:
        for way, weight in self._ways.items():
            if way.standing[square] == ".":
                yield way, weight * _GHOST
            else:
                yield way.lifted(square), weight

    def _set(self, square: int, unsure: int) -> Iterator[tuple[Way, float]]:
        for way, weight in self._ways.items():
            before = way if way.standing[square] == "." else way.lifted(square)
            for index, each in enumerate(before.aloft):
                yield before.set_down(index, square), weight * self._comes_down(before, each, square)
            if before.aloft:  # what was in the hand has come down, as good as certainly
                weight *= _UNCALLED  # noqa: PLW2901 - of all that follows
            yield before.appeared(STRANGER, square), weight * _BESIDE
            for source in squares_in(_around(square) | unsure):
                man = way.standing[source]
                if source != square and man != ".":
                    share = _UNSEEN * self._fit(man, source, square) if unsure >> source & 1 else _SLID
                    yield before.appeared(man, square, source), weight * share

    def _comes_down(self, way: Way, each: Aloft, square: int) -> float:
        if _is_white(each.man) is self.board.turn or each.man == STRANGER:
            return self._fit(each.man, each.home, square)
        if each.home != square:
            return _OTHER
        return _BACK if any(self._takes(other, square) for other in way.aloft) else _PUT_BACK

    def _takes(self, each: Aloft, square: int) -> bool:
        return square in self._goals.get(each.home, ()) and _is_white(each.man) is self.board.turn

    def _fit(self, man: str, home: int, square: int) -> float:
        if _is_white(man) is not self.board.turn:
            return _OTHER
        return _MOVES if square == home or square in self._goals.get(home, ()) else _ASTRAY

    def _keep(self, ways: Iterable[tuple[Way, float]]) -> None:
        """The likeliest ones, same ones added up."""
        merged: dict[Way, float] = {}
        for way, weight in ways:
            merged[way] = merged.get(way, 0.0) + weight
        best = sorted(merged.items(), key=lambda item: -item[1])[:_MOST]
        most = best[0][1]
        self._ways = {way: weight / most for way, weight in best if weight >= _LEAST * most}
        self._colours = None

    def _settled(self) -> dict[Way, float]:
        """Weights once nothing has moved for a while: a piece of the side to move is not simply gone."""
        left = {way: weight * _LEFT ** self._own(way) for way, weight in self._ways.items()}
        most = max(left.values())
        return {way: 1.0 if weight >= _ALIKE * most else weight / most for way, weight in left.items()}

    def _own(self, way: Way) -> int:
        return sum(_is_white(each.man) is self.board.turn for each in way.aloft)

    def colours(self) -> Array:
        """(64, 2) how likely the piece of each square is white, black, if one stands there at all."""
        if self._colours is None:
            self._colours = self._weighed()
        return self._colours

    def _weighed(self) -> Array:
        out = np.full((64, 2), 1e-9)
        for way, weight in self._settled().items():
            for square, man in enumerate(way.standing):
                if man == STRANGER:
                    out[square] += weight / 2
                elif man != ".":
                    out[square, 0 if man.isupper() else 1] += weight
        normal: Array = out / out.sum(axis=1, keepdims=True)
        return normal


def _around(square: int) -> int:
    return int(chess.BB_KING_ATTACKS[square])
