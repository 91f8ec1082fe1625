"""Several searches of one position, and the move that they choose together.

Source: the vote among the threads of Stockfish (``Threads::get_best_thread``): each search gives the move
that it found the weight (score - least score + 14) times its depth, so that deep searches count for more.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import chess

from kempelen.core.protocols import Thinking

_LEAST = 14.0  # centipawns: even the most doubtful search has a voice
_MATE = 10_000.0  # centipawns
_MATES = 1_000  # moves; scores nearer to that than this are mates
CANDIDATES = 4  # moves among which the voters are spread
_SHORTLIST, _WARM = 0.02, 0.08  # parts of a voter's effort: enough to part their ways, little to lose


@dataclass(frozen=True, slots=True)
class Vote:
    """What one voter found.

    Attributes:
        move: In UCI's notation, as it travels between machines.
        score: Centipawns from the side to move; a mate counts as 10000 less one for each move to it.
        depth: Half-moves.
        line: Principal variation; empty where it is about another move.
    """

    move: str
    score: float
    depth: int
    line: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Effort:
    """How much one voter may search: exactly one of the two.

    Attributes:
        seconds: Of time, s.
        nodes: Positions.
    """

    seconds: float | None = None
    nodes: int | None = None

    def part(self, share: float) -> "Effort":
        """A part of it, at least 1 node."""
        if self.nodes is not None:
            return Effort(nodes=max(1, round(self.nodes * share)))
        return Effort(seconds=(self.seconds or 0.0) * share)

    def split(self) -> "tuple[Effort, Effort, Effort]":
        """For the list of candidates, for the warming under one of them, for the position itself."""
        return self.part(_SHORTLIST), self.part(_WARM), self.part(1.0 - _SHORTLIST - _WARM)


def score_of(thinking: Thinking) -> float:
    """A thought's score as a vote counts it."""
    if thinking.mate is not None:
        return (_MATE - abs(thinking.mate)) * (1 if thinking.mate > 0 else -1)
    return float(thinking.centipawns or 0)


def thinking_of(vote: Vote) -> Thinking:
    """A vote as a thought."""
    line = tuple(chess.Move.from_uci(move) for move in vote.line or (vote.move,))
    if abs(vote.score) > _MATE - _MATES:
        mate = round(_MATE - abs(vote.score))
        return Thinking(vote.depth, None, mate if vote.score > 0 else -mate, line)
    return Thinking(vote.depth, round(vote.score), None, line)


def tally(votes: Sequence[Vote]) -> dict[str, float]:
    """The weight of each move that anybody found."""
    least = min((vote.score for vote in votes), default=0.0)
    weights: dict[str, float] = {}
    for vote in votes:
        weights[vote.move] = weights.get(vote.move, 0.0) + (vote.score - least + _LEAST) * max(1, vote.depth)
    return weights


def elected(votes: Sequence[Vote], board: chess.Board) -> Vote | None:
    """The best vote for the move that weighs most; None where there is no legal one.

    Args:
        votes: Of all the voters that answered in time; those for illegal moves do not count.
        board: The searched position.
    """
    valid = [vote for vote in votes if _is_legal(vote.move, board)]
    if not valid:
        return None
    weights = tally(valid)
    # Equal weights: the move that stands first in the alphabet, whoever answered first.
    chosen = max(sorted(weights), key=weights.__getitem__)
    return max((vote for vote in valid if vote.move == chosen), key=lambda vote: (vote.depth, vote.score))


def _is_legal(move: str, board: chess.Board) -> bool:
    try:
        return chess.Move.from_uci(move) in board.legal_moves
    except ValueError:
        return False
