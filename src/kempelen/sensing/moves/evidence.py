"""From frames to per-square log-likelihoods that no single square and no single frame can dominate.

Two kinds of error are kept apart. A *glitch* is one square in one frame; the mean over a window and a bound
per frame take care of it. A square that is *misread for good* says the same in every frame, so that adding
up frames would make it ever surer: its sum over the window is bounded by the rate of such squares, and how
it looked in the confirmed position is remembered, so that only what is new counts.
"""

from collections import deque

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.core.senses import Observation
from kempelen.sensing.moves.parameters import MoveParameters

States = npt.NDArray[np.int64]
"""(64,) EMPTY, WHITE or BLACK."""
STATES = 3
PRIOR_FRAMES = 5.0  # a standing square's nominal look counts as much as so many frames of it


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

    Args:
        states: (64,) EMPTY, WHITE or BLACK of the confirmed position.
    """

    def __init__(self, states: States, parameters: MoveParameters) -> None:
        self._parameters = parameters
        self._look = np.eye(STATES)[states]  # (64, 3) mean probability of looking like each state
        self._frames = np.zeros(64)
        self.states = states

    def confirm(self, states: States) -> None:
        """Another position stands now; squares whose state is the same keep their look."""
        changed = states != self.states
        self._look[changed] = np.eye(STATES)[states[changed]]
        self._frames[changed] = 0.0
        self.states = states

    def learn(self, window: Array, weight: float = 1.0) -> None:
        """Take in how the standing position looks: (64, 3) log-likelihoods of a window."""
        share = weight / (self._frames + weight)
        self._look += share[:, None] * (np.exp(window) - self._look)
        self._frames = np.minimum(self._frames + weight, self._parameters.memory)

    @property
    def expected(self) -> Array:
        """(64, 3) probability that a square that nobody touched looks empty, white, black.

        Nominal and remembered look, mixed by how many frames stand behind each, and a floor for squares
        that start to be misread.
        """
        nominal = np.eye(STATES)[self.states]
        share = (self._frames / (self._frames + PRIOR_FRAMES))[:, None]
        mixed = share * self._look + (1 - share) * nominal
        turned = self._parameters.turned
        out: Array = (1 - turned) * mixed + turned / STATES
        return out

    def untouched(self, window: Array) -> Array:
        """(64,) log p(window | the square is as it was)."""
        out: Array = np.log((self.expected * np.exp(window)).sum(axis=1))
        return out

    def touched(self, window: Array) -> Array:
        """(64, 3) log p(window | the square is now empty, white, black, and was not before).

        With the rate of misread squares it looks as before, or like anything.
        """
        seen, rate = np.exp(window), self._parameters.misread
        stuck = (self._look * seen).sum(axis=1, keepdims=True)
        out: Array = np.log((1 - rate) * seen + rate * (0.5 * stuck + 0.5 / STATES))
        return out

    def ratios(self, window: Array) -> Array:
        """(64, 3) log-likelihood ratio of each new state to "as it was"; 0 in the present state's column."""
        out = self.touched(window) - self.untouched(window)[:, None]
        out[np.arange(64), self.states] = 0.0
        return out
