"""Whether the table agrees with the position that should stand there: after each transfer, and at set-up."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated

import chess
import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceSet
from kempelen.core.places import Transfer
from kempelen.core.senses import EMPTY, WHITE, Observation
from kempelen.core.words import Words, joined, parts_of, say
from kempelen.sensing.moves.differences import differences, repairs, sentence
from kempelen.sensing.moves.evidence import STATES, States, Window
from kempelen.sensing.moves.hypotheses import colour_state
from kempelen.sensing.moves.parameters import MoveParameters, Rate, log_odds
from kempelen.sensing.moves.stance import Stance, StanceParameters, faults
from kempelen.sensing.moves.verdicts import STATE_WORDS, Difference

WORTH_A_LOOK = 9.0  # a person is told of squares that are wrong with at least one to so many odds

Pieces = chess.BaseBoard | Mapping[chess.Square, chess.Piece]


class CheckParameters(BaseModel):
    """Rates, and what counts as standing well.

    Attributes:
        failed: Probability that a transfer went wrong at one of its squares.
        displaced: Probability that another square is not as it should be.
        budget: Wrong agreements allowed per square of a transfer.
        frames: Clear frames that are looked at.
        stance: Upright and centred.
        rates: Of what the sensor does wrong.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    failed: Rate = 0.01
    displaced: Rate = 1e-3
    budget: Rate = 1e-4
    frames: Annotated[int, Field(ge=1, le=1000)] = 5
    stance: StanceParameters = StanceParameters()
    rates: MoveParameters = MoveParameters()


@dataclass(frozen=True, slots=True)
class Agrees:
    """Everything stands as it should.

    Attributes:
        margin: Smallest log odds of a transfer's squares, or of any square without one.
    """

    margin: float


@dataclass(frozen=True, slots=True)
class Disagrees:
    """Something does not.

    Attributes:
        differences: Squares with the wrong look; none when a piece only stands badly.
        sentence: What is wrong and what to do, in plain words.
    """

    differences: tuple[Difference, ...]
    sentence: str


@dataclass(frozen=True, slots=True)
class CannotTell:
    """Not enough seen, or too badly; ``reason`` says what."""

    reason: str


class PositionCheck:
    """Compares observations with one expected position.

    Args:
        expected: What should stand where; squares only.
        transfers: Those just made: their squares must be made out clearly, and the pieces must stand
            upright and centred.
        pieces: Heights of the kinds; None: heights are not checked.
        look: (64, 3) how each square looked before, `MoveReader.expected_look`: a square that never reads
            well does not count then, unless a transfer touched it.
        parameters: Rates and tolerances.
    """

    def __init__(
        self,
        expected: Pieces,
        transfers: Iterable[Transfer] = (),
        *,
        pieces: PieceSet | None = None,
        look: Array | None = None,
        parameters: CheckParameters | None = None,
    ) -> None:
        self._parameters = parameters or CheckParameters()
        self._expected = dict(expected.piece_map() if isinstance(expected, chess.BaseBoard) else expected)
        self._states = np.array([self._state(s) for s in chess.SQUARES])
        places = {place.square for t in transfers for place in (t.source, t.target)}
        self._touched = np.isin(np.arange(64), [s for s in places if s is not None])
        self._look = self._expected_look(look)
        self._pieces = pieces
        rates = self._parameters.rates
        self._window = Window(self._parameters.frames, rates.glitch, rates.correlation)
        self._stance = Stance(self._parameters.frames)

    def _state(self, square: chess.Square) -> int:
        piece = self._expected.get(square)
        return colour_state(piece.color) if piece else EMPTY

    def _expected_look(self, look: Array | None) -> Array:
        nominal: Array = np.eye(STATES)[self._states]
        if look is None:
            return nominal
        out: Array = np.where(self._touched[:, None], nominal, look)
        return out

    def update(self, observation: Observation) -> Agrees | Disagrees | CannotTell:
        """Take in one observation; ``CannotTell`` until enough has been seen."""
        if not observation.valid:
            self._window.clear()
            self._stance.clear()
            return CannotTell(observation.message or f"The board cannot be seen: {observation.sight.value}.")
        self._window.add(observation)
        self._stance.add(observation)
        if not self._window.full:
            return CannotTell(say("not_seen_long", "The board has not been seen for long enough."))
        return self._compare()

    def _compare(self) -> Agrees | Disagrees | CannotTell:
        odds, seen = self._odds()
        found = differences(self._expected, seen)
        if found:
            return Disagrees(found, describe(found))
        if vague := self._vague(odds):
            return CannotTell(vague)
        upright = self._stand_well()
        if upright is not None:
            return upright
        weighed = odds[self._touched] if self._touched.any() else odds
        return Agrees(-float(weighed.max()))

    def _odds(self) -> tuple[Array, States]:
        """(64,) log odds that a square is not as expected, and (64,) what it seems to be.

        A square of a transfer is called wrong when that is likelier than not; another one already when it is
        worth a look, since nobody can say more about it by looking on.
        """
        seen, rate = np.exp(self._window.log_likelihood), self._parameters.rates.misread
        told = (1 - rate) * seen + rate / STATES
        turned = self._parameters.rates.turned if self._known else rate
        right = (((1 - turned) * self._look + turned / STATES) * seen).sum(axis=1)
        prior = np.where(self._touched, self._parameters.failed, self._parameters.displaced) / 2
        others = told * prior[:, None]
        others[np.arange(64), self._states] = 0.0
        odds = np.log(others.sum(axis=1)) - np.log(right)
        least = np.where(self._touched, 0.0, -np.log(WORTH_A_LOOK))
        wrong = np.where(odds > least, others.argmax(axis=1), self._states)
        return odds, wrong

    @property
    def _known(self) -> bool:
        """Whether it is known how the squares looked before."""
        return not np.array_equal(self._look, np.eye(STATES)[self._states])

    def _vague(self, odds: Array) -> str:
        """Which squares cannot be made out well enough; empty when all can."""
        p = self._parameters
        unclear = np.flatnonzero(self._touched & (odds > -log_odds(p.budget)))
        rest = np.where(self._touched, -np.inf, odds)
        if np.logaddexp.reduce(rest) > -log_odds(p.rates.stray_allowed):
            unclear = np.append(unclear, int(np.argmax(rest)))
        if not len(unclear):
            return ""
        names = ", ".join(chess.square_name(int(s)) for s in unclear)
        return say("not_made_out", f"It cannot be made out what stands on {names}.", squares=names)

    def _stand_well(self) -> Disagrees | CannotTell | None:
        targets = [s for s in np.flatnonzero(self._touched) if int(s) in self._expected]
        bad, vague = faults(
            self._stance, self._expected, [int(s) for s in targets], self._pieces, self._parameters.stance
        )
        if bad:
            return Disagrees((), " ".join(bad))
        return CannotTell(" ".join(vague)) if vague else None


def describe(found: tuple[Difference, ...]) -> str:
    """What is wrong, square by square, and what to put where."""
    parts = [_seen(difference) for difference in found]
    seen = ", ".join(parts)
    said = Words(f"{seen[0].upper()}{seen[1:]}.", tuple(one for part in parts for one in parts_of(part)))
    return joined(said, sentence(repairs(found)))


def _seen(difference: Difference) -> str:
    square = chess.square_name(difference.square)
    if difference.seen == EMPTY:
        return say("is_empty", f"{square} is empty", square=square)
    text = f"{STATE_WORDS[difference.seen]} stands on {square}"
    if difference.seen == WHITE:
        return say("white_stands", text, square=square)
    return say("black_stands", text, square=square)
