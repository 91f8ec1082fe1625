"""Names the move that was made, or says why it cannot.

The posterior of everything that may have happened since the confirmed position is worked out for the newest
clear frames. A move is accepted when everything else together is less likely than the budget of wrong
accepts, when nothing else on the board is unexplained, and when the answer has been the same for long enough.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import log

import chess
import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.senses import Observation, Sight
from kempelen.core.words import joined, say
from kempelen.sensing.moves.differences import differences
from kempelen.sensing.moves.evidence import Standing, States, Window, frames_worth
from kempelen.sensing.moves.hypotheses import Happened, Hypotheses, Hypothesis
from kempelen.sensing.moves.illegal import advise
from kempelen.sensing.moves.parameters import MoveParameters
from kempelen.sensing.moves.promotion import after, promoted_line
from kempelen.sensing.moves.questions import ask
from kempelen.sensing.moves.verdicts import (
    Difference,
    Hidden,
    Line,
    Moved,
    Settling,
    TakenBack,
    Unchanged,
    Unsure,
    Verdict,
    Wrong,
)  # fmt: skip

STANDING_ODDS = 9.0  # the confirmed position stands when it is that much likelier than everything else
CLEAR_ODDS = 99.0  # one move stands out among all when it is that much likelier than the others
ALSO_SEEN = 3.0  # log odds below the strongest sign of a change, to be named with it
CANDIDATE_ODDS = 1e-2  # of the best one: less likely lines are not worth a question
SLOW_GAP = 3.0  # usual intervals: so much longer than usual, and what was seen before is over
INTERVAL_MEMORY = 0.7  # of the usual interval between observations, kept by each new one
_ORDINARY = frozenset({Happened.MOVE, Happened.TWO, Happened.REPLACED})


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """What the newest frames say.

    Attributes:
        best: Index of the likeliest hypothesis.
        margin: Its log odds against all others together.
        log_posterior: (n,) of all hypotheses.
        stray: Log odds that something beside the best hypothesis has changed on the board.
        seen: (64,) likeliest state of each square, beside the best hypothesis where that must be.
    """

    best: int
    margin: float
    log_posterior: Array
    stray: float
    seen: Array

    @property
    def suspicious(self) -> bool:
        """Whether something else may well have changed."""
        return self.stray > -log(STANDING_ODDS)


class MoveReader:
    """Follows one game from observation to observation.

    After a verdict is acted upon, the caller says what stands now with `confirm`; nothing is taken for
    granted before.

    Args:
        board: The confirmed position, with its moves where it has a history (for take-backs).
        parameters: Rates and patience.
    """

    def __init__(self, board: chess.Board, parameters: MoveParameters | None = None) -> None:
        self.parameters = parameters or MoveParameters()
        self._hypotheses = Hypotheses(board, pairs=self.parameters.pairs)
        self._standing = Standing(self._hypotheses.states, self.parameters)
        self._window = Window(self.parameters.frames, self.parameters.glitch, self.parameters.correlation)
        self._kinds: list[Array] = []
        self._board = board.copy(stack=2)
        self._time: float | None = None
        self._interval = 0.0  # usual time between observations
        self._seen_since = -np.inf  # since when nothing has been in the way
        self._quiet_until = 0.0  # when the confirmed position was last seen, or a hand
        self._touched = False  # whether hands may have been over the board since the position was confirmed
        self._best: Hypothesis | None = None
        self._best_since, self._best_frames = 0.0, 0
        self._unlearned = 0  # of these frames, those that no lesson has counted

    @property
    def board(self) -> chess.Board:
        """The confirmed position."""
        return self._board.copy()

    @property
    def expected_look(self) -> Array:
        """(64, 3) probability that an untouched square looks empty, white, black: what has been learnt."""
        return self._standing.expected

    def confirm(self, board: chess.Board, *, as_seen: bool = False) -> None:
        """Another position stands now: a move was accepted, the robot has moved, a person has said so.

        Args:
            board: The position.
            as_seen: A person has looked and says that it stands as given: what the newest frames show is how
                it looks, however strange.
        """
        self._board = board.copy(stack=2)
        seen_already = None if self._best is None else self._hypotheses.after(self._best)
        self._hypotheses = Hypotheses(board, pairs=self.parameters.pairs)
        self._standing.confirm(self._hypotheses.states)
        stands = seen_already is not None and np.array_equal(seen_already, self._hypotheses.states)
        self._touched, self._best = False, self._hypotheses.all[0] if stands else None
        if as_seen and self._window.full:
            self._standing.learn(self._window.log_likelihood, self.parameters.memory)
            self._unlearned = 0
        elif stands:
            self._learn(self._believe())

    def update(self, observation: Observation) -> Verdict:
        """Take in one observation and say what can be said."""
        self._note_time(observation.time)
        if not observation.valid:
            return self._hidden(observation)
        self._window.add(observation)
        self._note_kinds(observation)
        belief = self._believe()
        self._note_best(belief, observation.time)
        self._learn(belief)
        return self._verdict(belief, observation.time)

    def _note_time(self, time: float) -> None:
        gap = 0.0 if self._time is None else time - self._time
        if gap < 0 or gap > max(self.parameters.gap, SLOW_GAP * self._interval):
            self._lose_sight(time)
        elif self._time is None:
            self._quiet_until = time
        # A sensor that is always slow is still to be believed, but a hand fits between its observations.
        self._touched |= gap > self.parameters.gap
        self._interval = INTERVAL_MEMORY * self._interval + (1 - INTERVAL_MEMORY) * max(gap, 0.0)
        self._time = time

    def _lose_sight(self, time: float) -> None:
        """From here on the board may have been touched, and what was seen before is over."""
        self._window.clear()
        self._kinds.clear()
        self._best = None
        self._touched, self._seen_since, self._quiet_until = True, time, time

    def _hidden(self, observation: Observation) -> Hidden:
        self._lose_sight(observation.time)
        return Hidden(observation.sight, observation.message or _hidden_message(observation.sight))

    def _note_kinds(self, observation: Observation) -> None:
        if observation.kinds is not None:
            self._kinds = [*self._kinds, observation.kinds][-self.parameters.frames :]

    def _believe(self) -> Belief:
        ratios = self._standing.ratios(self._window.log_likelihood)
        hypotheses = self._hypotheses
        unseen = 0.0 if self._touched else log(self.parameters.missed_hand)
        prior = hypotheses.log_prior + unseen * (np.arange(len(hypotheses.all)) > 0)
        joint = hypotheses.scores(ratios) + prior
        best = int(np.argmax(joint))
        total = float(np.logaddexp.reduce(joint))
        others = np.delete(joint, [best, *self._same_move(hypotheses.all[best])])
        rest = float(np.logaddexp.reduce(others)) if len(others) else -np.inf
        stray, seen = self._strays(ratios, hypotheses.after(hypotheses.all[best]), unseen)
        return Belief(best, float(joint[best]) - rest, joint - total, stray, seen)

    def _same_move(self, best: Hypothesis) -> list[int]:
        """Half-made moves that could only become the one that is seen whole: no other move's rivals."""
        if best.happened is not Happened.MOVE:
            return []
        return [
            index
            for index, half in enumerate(self._hypotheses.all)
            if half.happened is Happened.HALF and set(half.lines) <= set(best.lines)
        ]

    def _strays(self, ratios: Array, states: States, unseen: float) -> tuple[float, Array]:
        """Log odds of any other change than those that lead to ``states``, and what is seen then."""
        odds = ratios - ratios[np.arange(64), states][:, None]
        odds += np.log(self.parameters.stray / 128) + unseen  # 64 squares, two other states each
        odds[np.arange(64), states] = -np.inf
        total = float(np.logaddexp.reduce(odds, axis=None))
        least = min(0.0, float(odds.max())) - ALSO_SEEN if total > -log(STANDING_ODDS) else 0.0
        seen = np.where(odds.max(axis=1) > least, odds.argmax(axis=1), states)
        return total, seen

    def _note_best(self, belief: Belief, time: float) -> None:
        best = self._hypotheses.all[belief.best]
        if best is not self._best:
            self._best, self._best_since, self._best_frames = best, time, 0
            self._unlearned = 0
        self._best_frames += 1
        self._unlearned += 1

    def _learn(self, belief: Belief) -> None:
        """How the standing position looks, as far as it is believed to stand; each frame counts once.

        Those that fill the window count when it is full; those that show a move, when that is confirmed.
        """
        if not self._window.full or belief.best:
            return
        windows, self._unlearned = self._unlearned / self.parameters.frames, 0
        if belief.stray > 0 or (self._touched and belief.margin < self.parameters.threshold):
            return  # a piece may be in the hand: that must not become how its square looks
        standing = float(np.exp(belief.log_posterior[0]))
        self._standing.learn(self._window.log_likelihood, windows * standing)

    def _verdict(self, belief: Belief, time: float) -> Verdict:
        best = self._hypotheses.all[belief.best]
        if belief.best == 0 and not belief.suspicious and belief.margin > log(STANDING_ODDS):
            self._quiet_until = time
            return Unchanged(belief.margin)
        accepted = self._accept(best, belief)
        if accepted is not None and self._steady(best, time):
            return accepted
        waiting = time - self._quiet_until < self.parameters.patience or not self._window.full
        if accepted is not None or waiting:
            return Settling()
        return self._trouble(best, belief)

    def _steady(self, best: Hypothesis, time: float) -> bool:
        p = self.parameters
        wait = p.castling_seconds if best.castling and best.happened is Happened.MOVE else p.seconds
        return (
            self._best_frames >= p.frames
            and time - self._best_since >= wait
            and time - self._seen_since >= p.settle
        )

    def _accept(self, best: Hypothesis, belief: Belief) -> Moved | TakenBack | None:
        p = self.parameters
        if belief.margin < p.threshold or belief.stray > log(p.stray_allowed) or best.also:
            return None
        if best.happened is Happened.BACK:
            return TakenBack(best.plies, (), belief.margin)
        if best.happened not in _allowed(p.plies):
            return None
        line, margin = self._one_line(best)
        if line is None:
            return None
        margin = min(margin, belief.margin)
        if best.happened is Happened.REPLACED:
            return TakenBack(best.plies, line, margin)
        return Moved(line, margin)

    def _one_line(self, best: Hypothesis) -> tuple[Line | None, float]:
        """The line of a hypothesis that has only one, or whose promotions the kinds tell apart."""
        if len(best.lines) == 1:
            return best.lines[0], np.inf
        if not self._kinds:
            return None, 0.0
        worth = frames_worth(len(self._kinds), self.parameters.correlation)
        kinds = worth * np.mean(self._kinds, axis=0)
        start = self._board.copy()
        for _ in range(best.plies):
            start.pop()
        line, margin = promoted_line(best.lines, start, kinds, self.parameters.misread)
        return (line, margin) if margin >= self.parameters.kind_threshold else (None, margin)

    def _trouble(self, best: Hypothesis, belief: Belief) -> Unsure | Wrong:
        if belief.suspicious and best.happened is Happened.MOVE and self._stands_out(belief):
            return self._move_and_more(best.lines[0], belief)
        if begun := self._begun(belief):
            return Unsure(*ask(self._board, [begun]))
        if belief.suspicious or best.happened in _ORDINARY - _allowed(self.parameters.plies):
            found = differences(self._board, belief.seen)
            return Wrong(found, _words(self._board, found))
        return Unsure(*ask(self._board, self._candidates(best, belief)))

    def _begun(self, belief: Belief) -> Hypothesis | None:
        """The half-made move that what is seen looks like."""
        halves = (h for h in self._hypotheses.all if h.happened is Happened.HALF)
        return next((h for h in halves if np.array_equal(self._hypotheses.after(h), belief.seen)), None)

    def _stands_out(self, belief: Belief) -> bool:
        """Whether the likeliest move is far likelier than every other and none."""
        single = [
            belief.log_posterior[i]
            for i, h in enumerate(self._hypotheses.all)
            if h.happened in {Happened.STANDING, Happened.MOVE} and i != belief.best
        ]
        rest = float(np.logaddexp.reduce(single))
        return float(belief.log_posterior[belief.best]) - rest > log(CLEAR_ODDS)

    def _move_and_more(self, line: Line, belief: Belief) -> Wrong:
        """A clear move, and something else beside it."""
        moved = after(self._board, line)
        found = differences(moved, belief.seen)
        san = self._board.san(line[0])
        return Wrong(found, joined(say("after_move", f"After {san}:", move=san), _words(moved, found)))

    def _candidates(self, best: Hypothesis, belief: Belief) -> list[Hypothesis]:
        floor = belief.log_posterior[belief.best] + log(CANDIDATE_ODDS)
        order = np.argsort(-belief.log_posterior, kind="stable")
        rivals = [self._hypotheses.all[i] for i in order if belief.log_posterior[i] >= floor]
        return [best, *(h for h in rivals if h is not best)]


def _words(board: chess.Board, found: tuple[Difference, ...]) -> str:
    return _advice(board.fen(), board.chess960, found)


@lru_cache(maxsize=8)
def _advice(fen: str, chess960: bool, found: tuple[Difference, ...]) -> str:  # noqa: FBT001 - part of the key
    """The same words for the same table: looking for the reason takes longer than a frame."""
    return advise(chess.Board(fen, chess960=chess960), found)


def _allowed(plies: int) -> frozenset[Happened]:
    return _ORDINARY if plies > 1 else _ORDINARY - {Happened.TWO}


def _hidden_message(sight: Sight) -> str:
    if sight is Sight.HAND:
        return "A hand is over the board."
    return f"The board cannot be seen: {sight.value}."
