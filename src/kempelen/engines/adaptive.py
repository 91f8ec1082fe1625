"""A level that keeps the chances near even, whoever sits on the other side.

After every search the engine knows how it stands. It takes two things from that: a slow estimate of how
strongly it should play, which falls while it is ahead and rises while it is behind, and a quick correction by
the score of the moment. At the Elo that comes of both, it errs as every sampled level does (see `strength`).
It never plays a move that only somebody stronger would find, and it says at which Elo it has chosen.
"""

from dataclasses import dataclass, field, replace

from kempelen.core.protocols import EngineChoice

START = 1400
LEAST, MOST = 400.0, 2000.0  # Elo; from the upper one on it plays its best move
_PER_MOVE = 80.0  # Elo by which the estimate moves where one side is sure to win
_PER_PAWN = 120.0  # Elo of the correction
_PAWNS = 5.0  # beyond which a score says no more
_POINTS = 400.0  # centipawns for 10 to 1


@dataclass
class Balance:
    """How strongly to play just now; kept from move to move and from game to game.

    Attributes:
        estimate: Elo at which the chances have been even so far.
        elo: That the last move was chosen at.
    """

    estimate: float = START
    elo: int = field(default=START)

    def weigh(self, centipawns: float) -> int:
        """Take a score into account.

        Args:
            centipawns: Of the position, from the engine's side.

        Returns:
            The Elo to choose at now, 400..2000.
        """
        pawns = max(-_PAWNS, min(_PAWNS, centipawns / 100.0))
        expected = 1.0 / (1.0 + 10.0 ** (-100.0 * pawns / _POINTS))
        self.estimate = _within(self.estimate - _PER_MOVE * (2.0 * expected - 1.0))
        self.elo = round(_within(self.estimate - _PER_PAWN * pawns))
        return self.elo


def adapted(choice: EngineChoice, elo: int) -> EngineChoice:
    """The choice with the Elo that it was made at, for everybody to see."""
    return replace(choice, thinking=replace(choice.thinking, adapted=elo))


def _within(elo: float) -> float:
    return max(LEAST, min(MOST, elo))
