"""What can be said after looking at the board."""

from dataclasses import dataclass

import chess

from kempelen.core.senses import BLACK, EMPTY, WHITE, Sight

Line = tuple[chess.Move, ...]
"""Moves in the order in which they were made."""

STATE_WORDS = {EMPTY: "empty", WHITE: "a white piece", BLACK: "a black piece"}


@dataclass(frozen=True, slots=True)
class Difference:
    """One square that is not as it should be.

    Attributes:
        square: Which.
        expected: The piece that belongs there, or None for an empty square.
        seen: EMPTY, WHITE or BLACK.
    """

    square: chess.Square
    expected: chess.Piece | None
    seen: int

    def __str__(self) -> str:
        should = self.expected.symbol() if self.expected else "nothing"
        return f"{chess.square_name(self.square)}: {STATE_WORDS[self.seen]} instead of {should}"


@dataclass(frozen=True, slots=True)
class Unchanged:
    """The confirmed position stands; ``margin`` is its log posterior odds."""

    margin: float


@dataclass(frozen=True, slots=True)
class Settling:
    """Something has changed, and it is too early to say what: nothing to do but to look on."""


@dataclass(frozen=True, slots=True)
class Moved:
    """One or two legal moves were made.

    Attributes:
        moves: One move, or two plies played quickly; legal one after the other.
        margin: Log odds that it was this and nothing else.
    """

    moves: Line
    margin: float


@dataclass(frozen=True, slots=True)
class TakenBack:
    """The last plies were taken back.

    Attributes:
        plies: 1 or 2.
        moves: What was played instead of the first of them; empty when the table shows the position as it
            was that many plies ago.
        margin: Log odds that it was this and nothing else.
    """

    plies: int
    moves: Line
    margin: float


@dataclass(frozen=True, slots=True)
class Unsure:
    """It cannot be told from here; a person can.

    Attributes:
        candidates: What may have been played, likeliest first; the empty line is "nothing was moved".
        question: One plain sentence: "Is the white pawn on e4 or e5?"
    """

    candidates: tuple[Line, ...]
    question: str


@dataclass(frozen=True, slots=True)
class Wrong:
    """What stands there follows from no legal move.

    Attributes:
        differences: From the position that should stand there.
        advice: Plain sentences: what is wrong, and what to put where.
    """

    differences: tuple[Difference, ...]
    advice: str


@dataclass(frozen=True, slots=True)
class Hidden:
    """Nothing can be read now, and why.

    Attributes:
        sight: HAND for a hand over the board; else the sensor's trouble.
        message: For the operator.
    """

    sight: Sight
    message: str


Verdict = Unchanged | Settling | Moved | TakenBack | Unsure | Wrong | Hidden
