"""The numbers of move inference; its thresholds follow from the budget of wrong accepts."""

import math
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Rate = Annotated[float, Field(gt=0, lt=1)]
Seconds = Annotated[float, Field(ge=0, le=60)]


def log_odds(left: float) -> float:
    """Natural log of the odds of something whose complement has probability ``left``."""
    return math.log((1 - left) / left)


class MoveParameters(BaseModel):
    """Rates of what can go wrong, and how patient to be.

    Attributes:
        budget: Most doubt that any single accepted move may leave: the posterior probability of everything
            else together. It bounds the rate of wrong accepts; the mean doubt of the moves of whole games
            was fifty times smaller (2e-7 over 328 moves, good sensor).
        plies: Moves that may have been made since the last confirmed position; 2 where people move both
            sides, 1 where the robot moves the other one.
        pairs: Whether two plies at once are thought of, even where they are not accepted: what looks like
            them is asked then. It takes most of the time of a position.
        kind_budget: The same for the kind of a promoted piece as the piece classifier reads it; larger, since
            about one move in a hundred is a promotion. A tiny one, and the person is always asked.
        misread: Probability that a square that has just changed is read wrongly for good, such as a glossy
            black piece that the sensor does not see. Of the 512 squares of eight real depth frames one was.
        turned: Probability that a square that nobody touched starts to be read wrongly for good between one
            move and the next.
        glitch: Probability that one square of one frame says nothing.
        correlation: Of the errors of two frames of a window: light, pose and bias are shared, only the pixel
            noise is not. n frames count as n / (1 + (n - 1) correlation), never more than 1 / correlation.
        missed_hand: Probability that a hand came and went without ever being reported.
        missed_hand_frame: Probability that a frame with a hand over the board is reported as clear.
        stray: Probability that a move comes with another change that no rule explains.
        stray_allowed: Up to this probability of such a change a move is still accepted.
        memory: Windows of frames for which the look of the standing position is remembered.
        seconds: An answer must have been the same for this long.
        settle: And no hand may have been seen for this long.
        castling_seconds: A rook's move that could be the first half of castling waits this long.
        patience: With no hand in view, after this long a question is asked.
        gap: Longer than this without a frame, and a hand may have come and gone.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    budget: Rate = 1e-5
    kind_budget: Rate = 1e-3
    plies: Annotated[int, Field(ge=1, le=2)] = 2
    pairs: bool = True
    misread: Rate = 2e-3
    turned: Rate = 1e-5
    glitch: Rate = 1e-3
    correlation: Annotated[float, Field(ge=0, le=1)] = 0.25
    missed_hand: Annotated[float, Field(gt=0, le=1)] = 0.01
    missed_hand_frame: Rate = 0.1
    stray: Rate = 0.01
    stray_allowed: Rate = 0.01
    memory: Annotated[int, Field(ge=1, le=10_000)] = 12
    seconds: Seconds = 0.4
    settle: Seconds = 0.2
    castling_seconds: Seconds = 2.5
    patience: Seconds = 1.5
    gap: Seconds = 0.5

    @property
    def threshold(self) -> float:
        """Log posterior odds from which an answer is accepted: ln((1 - budget) / budget)."""
        return log_odds(self.budget)

    @property
    def kind_threshold(self) -> float:
        """The same for kinds."""
        return log_odds(self.kind_budget)

    @property
    def frames(self) -> int:
        """Clear frames that must give the same answer.

        So many that a hand, missed in each of them independently, is missed in all of them less often than
        the budget allows.
        """
        return max(1, math.ceil(math.log(self.budget) / math.log(self.missed_hand_frame)))

    @classmethod
    def of_pictures(cls, budget: float = 1e-3) -> "MoveParameters":
        """For two single pictures, one before and one after a move: nothing to wait for.

        One picture bounds no glitches by repetition, so that the budget cannot be that of a video.
        """
        return cls(
            budget=budget, glitch=1e-6, missed_hand=1.0, missed_hand_frame=min(budget, 0.5),
            seconds=0, settle=0, castling_seconds=0, patience=0, gap=0, plies=1,
        )  # fmt: skip
