"""Whether a square still looks as it was remembered, and if not, into what it may have changed.

All likelihoods are learned from the pictures themselves. What a *changed* square looks like is taken from the
known position: squares of one shade that hold different things differ as a square does that changed from one
into the other. What an *unchanged* square looks like is taken from the two pictures that are compared: few
squares change in a move, all others show what the camera's movement, its noise and the light do. A share of
the changed squares come to lie in an invented shadow.
"""

from itertools import permutations

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array
from kempelen.sensing.colour.columns import Columns
from kempelen.sensing.colour.looks import changes, nudged, shadowed
from kempelen.sensing.colour.parameters import ColourParameters
from kempelen.sensing.colour.predictive import Student, broad, fitted, hedged

PAIRS = 60  # of differing squares for each change and shade; more say nothing new
CHANGED = 4 / 64  # share of the squares that a castling changes, the move that changes most
ROUNDS = 6  # of expectation maximisation
CAUTION = 0.3  # share of the changed squares' covariance in that of the unchanged ones: a fixed camera
# without noise would else take the faintest shimmer for a change
NUDGED = 1 / 32  # share of pieces that a sleeve has pushed ...
NUDGE = 0.15  # ... by up to so many squares: more, and the arbiter would ask for them to be centred
COPIES = 3  # of each piece, pushed differently
HALF = 3.0  # squared deviations, per feature, at which a square weighs half in the first guess
MAD_TO_SIGMA = 1.4826
EXTREME = 30.0  # nats beyond which a probability is 0 or 1


class ChangeModel:
    """Of one remembered picture of a known position.

    Args:
        memory: Encoded columns.
        states: (64,) what stands there.
        dark: (64,) which squares are dark.
        parameters: Of the reader.
        generator: Seeded by the caller.
    """

    def __init__(
        self,
        memory: Columns,
        states: npt.NDArray[np.int64],
        dark: npt.NDArray[np.bool_],
        parameters: ColourParameters,
        generator: np.random.Generator,
    ) -> None:
        self._search, self._share = parameters.search, parameters.shaded
        self._memory, self._states, self._dark = memory, states, dark
        self._examples = _differing(
            memory, memory, states, dark, search=parameters.search, generator=generator
        )
        every = np.concatenate(list(self._examples.values()))
        self._covariance = np.cov(every.T)
        self._broad = broad(every, np.ones(len(every)))
        self._any = self._model(every)
        self._changed = {key: self._model(examples) for key, examples in self._examples.items()}
        shade = shadowed(memory, parameters.depth, generator)
        shaded = _differing(memory, shade, states, dark, search=parameters.search, generator=generator)
        self._in_shade = {key: self._model(examples) for key, examples in shaded.items()}

        standing = np.flatnonzero(states)
        reach = round(NUDGE * memory.shape[2])
        pushed = np.concatenate([nudged(memory[standing], reach, generator) for _ in range(COPIES)])
        self._nudged = self._model(
            changes(np.tile(memory[standing], (COPIES, 1, 1, 1, 1)), pushed, self._search)
        )

    def _model(self, examples: Array) -> Student:
        return fitted(examples, np.ones(len(examples)), self._covariance, CAUTION)

    def log_density(self, now: Columns) -> Array:
        """(64, 3) log p(change seen | now empty, white, black).

        Args:
            now: Encoded columns.
        """
        seen = changes(self._memory, now, self._search)
        unforeseen = self._broad.log_density(seen)
        still = np.arange(64), self._states
        out = self._into(seen, unforeseen)
        changed = np.logaddexp.reduce(out, axis=1) - np.log(2)
        out[still] = hedged(self._unchanged(seen, changed), unforeseen)
        return out

    def _into(self, seen: Array, unforeseen: Array) -> Array:
        """(64, 3) as if every square had changed: minus infinity where it was before."""
        out = np.full((64, 3), -np.inf)
        for before, after in permutations(range(3), 2):
            for shade in (False, True):
                k = (self._states == before) & (self._dark == shade)
                out[k, after] = hedged(self._change(before, after, shade, seen[k]), unforeseen[k])
        return out

    def _change(self, before: int, after: int, shade: bool, seen: Array) -> Array:  # noqa: FBT001 - a key
        key = min(before, after), max(before, after), shade
        lit = self._changed.get(key, self._any).log_density(seen)
        dim = self._in_shade.get(key, self._any).log_density(seen)
        out: Array = np.logaddexp(lit + np.log(1 - self._share), dim + np.log(self._share))
        return out

    def _unchanged(self, seen: Array, changed: Array) -> Array:
        """(64,) by expectation maximisation: squares that changed have no say in what unchanged ones do."""
        weight, out = _first_guess(seen), changed
        pushed = self._nudged.log_density(seen) + np.log(NUDGED)
        for _ in range(ROUNDS):
            still = fitted(seen, weight, self._covariance, CAUTION).log_density(seen)
            out = np.where(self._states > 0, np.logaddexp(still + np.log(1 - NUDGED), pushed), still)
            weight = _probability(out - changed + np.log(1 / CHANGED - 1))
        return out


def _differing(
    memory: Columns,
    other_light: Columns,
    states: npt.NDArray[np.int64],
    dark: npt.NDArray[np.bool_],
    *,
    search: int,
    generator: np.random.Generator,
) -> dict[tuple[int, int, bool], Array]:
    """Changes between squares of one shade that hold different things, by what and by shade."""
    out = {}
    for one, other in ((0, 1), (0, 2), (1, 2)):
        for shade in (False, True):
            first = np.flatnonzero((states == one) & (dark == shade))
            second = np.flatnonzero((states == other) & (dark == shade))
            if len(first) and len(second):
                pairs = np.stack(np.meshgrid(first, second)).reshape(2, -1)
                pairs = pairs[:, generator.permutation(pairs.shape[1])[:PAIRS]]
                out[one, other, shade] = changes(memory[pairs[0]], other_light[pairs[1]], search)
    return out


def _first_guess(seen: Array) -> Array:
    """(64,) how ordinary each square's change is among all of them."""
    off = seen - np.median(seen, axis=0)
    scale = MAD_TO_SIGMA * np.median(np.abs(off), axis=0) + 1e-3
    out: Array = 1 / (1 + ((off / scale) ** 2).mean(axis=1) / HALF)
    return out


def _probability(log_odds: Array) -> Array:
    out: Array = 1 / (1 + np.exp(-np.clip(log_odds, -EXTREME, EXTREME)))
    return out
