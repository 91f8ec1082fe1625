"""From frames to per-square log-likelihoods that no single square and no single frame can dominate.

Two kinds of error are kept apart. A *glitch* is one square in one frame; the mean over a window and a bound
per frame take care of it. A square that is *misread for good* says the same in every frame, so that adding
up frames would make it ever surer: its sum over the window is bounded by the rate of such squares, and how
it looked in the confirmed position is remembered, so that only what is new counts.
"""

from collections import deque

import numpy as np
import numpy.typing as npt
from scipy.special import expit

from kempelen.core.geometry import Array
from kempelen.core.senses import Observation
from kempelen.sensing.moves.parameters import MoveParameters, log_odds

States = npt.NDArray[np.int64]
"""(64,) EMPTY, WHITE or BLACK."""
STATES = 3


def normalised(log_likelihood: Array) -> Array:
    """Rows shifted so that their exponentials sum to 1."""
    raised = log_likelihood - log_likelihood.max(axis=-1, keepdims=True)
    out: Array = raised - np.log(np.exp(raised).sum(axis=-1, keepdims=True))
    return out


def bounded(log_likelihood: Array, rate: float) -> Array:
    """Mixture with a report that says nothing, at that rate; rows come out normalised."""
    columns = log_likelihood.shape[-1]
    out: Array = np.log((1 - rate) * np.exp(normalised(log_likelihood)) + rate / columns)
    return out


def frames_worth(frames: int, correlation: float) -> float:
    """Independent frames that ``frames`` of pairwise correlated errors are worth."""
    return frames / (1 + (frames - 1) * correlation) if frames else 0.0


class Window:
    """The newest clear frames, summed with tempering.

    Args:
        frames: How many are kept.
        glitch: Rate of squares that say nothing in a frame.
        correlation: Of the errors of two frames.
    """

    def __init__(self, frames: int, glitch: float, correlation: float) -> None:
        self._rows: deque[Array] = deque(maxlen=frames)
        self._glitch = glitch
        self._correlation = correlation

    def add(self, observation: Observation) -> None:
        """Take in a clear frame."""
        self._rows.append(bounded(observation.log_likelihood, self._glitch))

    def clear(self) -> None:
        """Forget everything."""
        self._rows.clear()

    @property
    def full(self) -> bool:
        """Whether it holds as many frames as it can."""
        return len(self._rows) == self._rows.maxlen

    @property
    def log_likelihood(self) -> Array:
        """(64, 3), rows normalised; all alike when no frame has been taken in."""
        if not self._rows:
            return np.full((64, STATES), -np.log(STATES))
        worth = frames_worth(len(self._rows), self._correlation)
        return normalised(worth * np.mean(self._rows, axis=0))


class Standing:
    """How each square looks in the confirmed position.

    A square is of one of two classes. A good one looks like what it is, but for the rate of squares that turn
    bad untouched. A misread one looks like anything, again and again: its look is categorical with a uniform
    Dirichlet prior, so that what it looked like before predicts what it looks like now. A square that has
    just been touched is misread with the rate of such squares; what is seen of it afterwards decides.

    Args:
        states: What stands on the squares of the confirmed position.
        parameters: Rates.
    """

    def __init__(self, states: States, parameters: MoveParameters) -> None:
        self._parameters = parameters
        self.states = states
        self._counts = np.zeros((64, STATES))  # windows in which a square looked like each state
        self._odds = np.full(64, self._fresh)  # log odds that it is misread

    def confirm(self, states: States) -> None:
        """Another position stands now; squares whose state is the same keep their look."""
        touched = states != self.states
        self._counts[touched] = 0.0
        self._odds[touched] = self._fresh
        self.states = states

    def learn(self, window: Array, windows: float) -> None:
        """Take in how the standing position looks.

        Args:
            window: (64, 3) log-likelihoods.
            windows: How many independent looks it counts as.
        """
        seen = np.exp(window)
        evidence = np.log((self._usual * seen).sum(axis=1)) - np.log((self._good * seen).sum(axis=1))
        self._odds = np.clip(self._odds + windows * evidence, -self._surest, self._surest)
        self._counts += windows * seen
        most = self._parameters.memory / self._counts.sum(axis=1, keepdims=True)
        self._counts *= np.minimum(1.0, most)

    @property
    def _fresh(self) -> float:
        """Log odds that a square that has just been touched is misread."""
        return -log_odds(self._parameters.misread)

    @property
    def _surest(self) -> float:
        """No log odds get beyond this: a square that changes its ways is noticed as soon as it does."""
        return -self._fresh + 2 * float(np.log1p(self._parameters.memory))

    @property
    def _good(self) -> Array:
        """(64, 3) how good squares look."""
        turned = self._parameters.turned
        out: Array = (1 - turned) * np.eye(STATES)[self.states] + turned / STATES
        return out

    @property
    def misread(self) -> Array:
        """(64,) posterior probability that a square is misread."""
        out: Array = expit(self._odds)
        return out

    @property
    def _usual(self) -> Array:
        """(64, 3) how a misread square would look, after what has been seen of it."""
        out: Array = (self._counts + 1) / (self._counts.sum(axis=1, keepdims=True) + STATES)
        return out

    @property
    def expected(self) -> Array:
        """(64, 3) probability that a square that nobody touched looks empty, white, black."""
        misread = self.misread[:, None]
        out: Array = (1 - misread) * self._good + misread * self._usual
        return out

    def untouched(self, window: Array) -> Array:
        """(64,) log p(window | the square is as it was)."""
        out: Array = np.log((self.expected * np.exp(window)).sum(axis=1))
        return out

    def touched(self, window: Array) -> Array:
        """(64, 3) log p(window | the square is now empty, white, black, and was not before).

        It may be misread now, and then look like anything; if it was misread before, it may look as it did,
        whatever stands there.
        """
        seen, rate = np.exp(window), self._parameters.misread
        stuck = 0.5 * self.misread[:, None]
        as_before = (self._usual * seen).sum(axis=1, keepdims=True)
        out: Array = np.log((1 - rate) * ((1 - stuck) * seen + stuck * as_before) + rate / STATES)
        return out

    def ratios(self, window: Array) -> Array:
        """(64, 3) log-likelihood ratio of each new state to "as it was"; 0 in the present state's column."""
        out = self.touched(window) - self.untouched(window)[:, None]
        out[np.arange(64), self.states] = 0.0
        return out
