"""A sloppy person at a reed board, as switches feel it: who lifts and sets what, and when."""

import random
from collections.abc import Iterator
from dataclasses import dataclass, field

import chess

from kempelen.core.reed import squares_in
from kempelen.sensing.moves.hypotheses import castling_rook, castling_targets, en_passant_victim

Deed = tuple[int, int, bool]
"""ms after the one before, square, whether a piece is set down there."""

_HAND_MS = (250, 900)
"""From one lift or set to the next."""
_DITHER_MS = (200, 700)
"""A piece that is set down and taken up again stands for so long at most."""
_THINK_MS = (900, 5000)
_PASS_MS = (40, 130)
"""A square that a piece slides over is felt for so long."""
_ADJUST_MS = (120, 400)


@dataclass(frozen=True, slots=True)
class Habits:
    """Shares of moves in which a person does so.

    Attributes:
        touch: Takes another piece up and puts it back first.
        slide: Slides a piece that could slide.
        dither: Sets the piece down elsewhere first.
        think: Stops with the piece in the hand.
        adjust: Straightens the piece afterwards.
        wrong: Makes an impossible move first, and puts it right when told.
        second_thoughts: With the piece in the hand, takes up one victim, puts it back and takes another.
    """

    touch: float = 0.12
    slide: float = 0.2
    dither: float = 0.1
    think: float = 0.1
    adjust: float = 0.1
    wrong: float = 0.04
    second_thoughts: float = 0.01


@dataclass
class SloppyPerson:
    """Makes moves on the squares of a board.

    Attributes:
        rng: All that is random.
        habits: What may happen.
        done: How often each of them has.
    """

    rng: random.Random
    habits: Habits = field(default_factory=Habits)
    done: dict[str, int] = field(default_factory=dict)

    def _does(self, habit: str) -> bool:
        if self.rng.random() >= getattr(self.habits, habit):
            return False
        self.done[habit] = self.done.get(habit, 0) + 1
        return True

    def _ms(self, least_and_most: tuple[int, int]) -> int:
        return self.rng.randint(*least_and_most)

    def move(self, board: chess.Board, move: chess.Move) -> list[Deed]:
        """All that the hand does for a move, sloppiness included; the last deed completes it."""
        out: list[Deed] = []
        if self._does("touch"):
            out += self._put_back(self.rng.choice(list(squares_in(board.occupied))))
        out += list(self._make(board, move))
        if self._does("adjust"):
            out += [(self._ms(_HAND_MS), move.to_square, False), (self._ms(_ADJUST_MS), move.to_square, True)]
        return out

    def wrong_move(self, board: chess.Board) -> chess.Move | None:
        """An impossible move of the side to move onto an empty square, now and then."""
        if not self._does("wrong"):
            return None
        own = list(squares_in(board.occupied_co[board.turn]))
        empty = list(squares_in(~board.occupied & chess.BB_ALL))
        for _ in range(20):
            move = chess.Move(self.rng.choice(own), self.rng.choice(empty))
            if not any(_alike(board, move, legal) for legal in board.legal_moves):
                return move
        return None

    def carry(self, source: int, target: int) -> list[Deed]:
        """One piece, lifted and set."""
        return [(self._ms(_HAND_MS), source, False), (self._ms(_HAND_MS), target, True)]

    def _put_back(self, square: int) -> list[Deed]:
        return [(self._ms(_HAND_MS), square, False), (self._ms(_ADJUST_MS), square, True)]

    def _make(self, board: chess.Board, move: chess.Move) -> Iterator[Deed]:
        if board.is_castling(move):
            yield from self._castle(board, move)
        elif board.is_capture(move):
            yield from self._take(board, move)
        elif move.promotion:
            yield from self._promote(move)
        else:
            yield from self._quiet(board, move)

    def _quiet(self, board: chess.Board, move: chess.Move) -> Iterator[Deed]:
        way = list(squares_in(chess.between(move.from_square, move.to_square)))
        if move.from_square > move.to_square:
            way.reverse()
        yield self._ms(_HAND_MS), move.from_square, False
        if board.piece_type_at(move.from_square) != chess.KNIGHT and self._does("slide"):
            for square in way:
                yield self._ms(_PASS_MS), square, True
                yield self._ms(_PASS_MS), square, False
            yield self._ms(_PASS_MS), move.to_square, True
            return
        yield from self._dither(board, move)
        yield self._ms(_HAND_MS), move.to_square, True

    def _dither(self, board: chess.Board, move: chess.Move) -> Iterator[Deed]:
        if self._does("think"):
            yield self._ms(_THINK_MS), move.from_square, True
            yield self._ms(_DITHER_MS), move.from_square, False
        if self._does("dither"):
            square = self.rng.choice(list(squares_in(~board.occupied & chess.BB_ALL)))
            yield self._ms(_HAND_MS), square, True
            yield self._ms(_DITHER_MS), square, False

    def _take(self, board: chess.Board, move: chess.Move) -> Iterator[Deed]:
        victim = en_passant_victim(move) if board.is_en_passant(move) else move.to_square
        first = [move.from_square, victim]
        if self.rng.random() < 0.5:  # noqa: PLR2004 - either way round
            first.reverse()
        elif self._does("second_thoughts"):
            other = [m.to_square for m in board.legal_moves if m.from_square == move.from_square]
            other = [s for s in other if board.piece_at(s) and s != victim]
            yield self._ms(_HAND_MS), first.pop(0), False
            if other:
                yield from self._put_back(self.rng.choice(other))
        if board.is_en_passant(move) and self.rng.random() < 0.5:  # noqa: PLR2004 - either way round
            yield self._ms(_HAND_MS), move.from_square, False
            yield self._ms(_HAND_MS), move.to_square, True
            yield self._ms(_HAND_MS), victim, False
            return
        for square in first:
            yield self._ms(_HAND_MS), square, False
        yield self._ms(_HAND_MS), move.to_square, True

    def _promote(self, move: chess.Move) -> Iterator[Deed]:
        yield self._ms(_HAND_MS), move.from_square, False
        if self.rng.random() < 0.5:  # noqa: PLR2004 - the pawn goes there first, or straight into the box
            yield self._ms(_HAND_MS), move.to_square, True
            yield self._ms(_HAND_MS), move.to_square, False
        yield self._ms(_HAND_MS), move.to_square, True

    def _castle(self, board: chess.Board, move: chess.Move) -> Iterator[Deed]:
        rook = castling_rook(board, move)
        king_to, rook_to = castling_targets(board, move)
        king = [(move.from_square, False), (king_to, True)]
        tower = [(rook, False), (rook_to, True)]
        orders = (
            [*king, *tower],
            [*tower, *king],
            [king[0], tower[0], tower[1], king[1]],
            [tower[0], king[0], king[1], tower[1]],
        )
        for square, placed in self.rng.choice(orders):
            yield self._ms(_HAND_MS), square, placed


def _alike(board: chess.Board, move: chess.Move, legal: chess.Move) -> bool:
    """Whether the first is a part of the second, or looks like it."""
    if board.is_castling(legal):
        return move.from_square in {legal.from_square, castling_rook(board, legal)}
    return (move.from_square, move.to_square) == (legal.from_square, legal.to_square)


def robot_deeds(board: chess.Board, move: chess.Move) -> list[Deed]:
    """The same move as a robot makes it: the victim first, one piece after another, unhurried."""
    step = 1500
    if board.is_castling(move):
        king_to, rook_to = castling_targets(board, move)
        rook = castling_rook(board, move)
        return [
            (step, move.from_square, False), (step, king_to, True),
            (step, rook, False), (step, rook_to, True),
        ]  # fmt: skip
    out: list[Deed] = []
    if board.is_capture(move):
        victim = en_passant_victim(move) if board.is_en_passant(move) else move.to_square
        out.append((step, victim, False))
    return [*out, (step, move.from_square, False), (step, move.to_square, True)]
