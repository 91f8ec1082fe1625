"""Observations of boards that nobody filmed: positions, noise, misread squares, hands; all of it seeded."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import chess
import numpy as np

from kempelen.core.geometry import Array
from kempelen.core.senses import BLACK, EMPTY, WHITE, Observation, Sight

COLUMNS: Mapping[str, int] = {"empty": EMPTY, "white": WHITE, "black": BLACK}


def looks(board: chess.BaseBoard) -> Array:
    """(64,) EMPTY, WHITE, BLACK."""
    colours = [board.color_at(square) for square in chess.SQUARES]
    return np.array([EMPTY if c is None else WHITE if c else BLACK for c in colours])


@dataclass
class Sensor:
    """A made-up board sensor: each square's look is a point in the plane of three states, with noise.

    Attributes:
        seed: Of the noise.
        separation: Distance of two states' looks, in standard deviations of the noise of a frame: 8 is a
            good sensor, 3 a poor one.
        shared: Share of the noise's variance that stays the same from frame to frame until the square
            changes.
        stuck: Squares that always look like one state.
        vague: Squares that are seen, and say nothing.
        glitches: Probability that a square of a frame looks like a state at random.
        colour_blind: White and black look alike.
        rate: Frames per second.
    """

    seed: int = 0
    separation: float = 8.0
    shared: float = 0.3
    stuck: Mapping[str, str] = field(default_factory=dict)
    vague: frozenset[str] = frozenset()
    glitches: float = 0.0
    colour_blind: bool = False
    rate: float = 30.0
    time: float = 0.0

    def __post_init__(self) -> None:
        self._random = np.random.default_rng(self.seed)
        self._bias = self._random.normal(size=(64, 3))
        self._last: Array | None = None

    def see(self, position: chess.BaseBoard | Array, kinds: Array | None = None) -> Observation:
        """One clear frame."""
        states = np.array(looks(position) if isinstance(position, chess.BaseBoard) else position)
        self._renew(states)
        shown = self._shown(states)
        noise = np.sqrt(self.shared) * self._bias
        noise = noise + np.sqrt(1 - self.shared) * self._random.normal(size=(64, 3))
        centres = np.eye(3) * self.separation / np.sqrt(2)
        points = centres[shown] + noise
        log_likelihood = -0.5 * ((points[:, None, :] - centres[None]) ** 2).sum(axis=2)
        if self.colour_blind:
            log_likelihood[:, 1:] = log_likelihood[:, 1:].max(axis=1, keepdims=True)
        log_likelihood[[chess.parse_square(s) for s in self.vague]] = 0.0
        return Observation(log_likelihood, self._tick(), kinds=kinds)

    def _renew(self, states: Array) -> None:
        if self._last is not None:
            changed = states != self._last
            self._bias[changed] = self._random.normal(size=(int(changed.sum()), 3))
        self._last = states

    def _shown(self, states: Array) -> Array:
        shown = states.copy()
        glitched = self._random.random(64) < self.glitches
        shown[glitched] = self._random.integers(0, 3, int(glitched.sum()))
        for name, look in self.stuck.items():
            shown[chess.parse_square(name)] = COLUMNS[look]
        return shown

    def _tick(self) -> float:
        self.time += 1 / self.rate
        return self.time

    def watch(self, position: chess.BaseBoard | Array, seconds: float = 1.0) -> Iterator[Observation]:
        """Clear frames of one position."""
        for _ in range(max(1, round(seconds * self.rate))):
            yield self.see(position)

    def hand(self, seconds: float = 0.5) -> Iterator[Observation]:
        """Frames with a hand over the board."""
        yield from self.blind(Sight.HAND, seconds)

    def blind(self, sight: Sight, seconds: float = 0.5) -> Iterator[Observation]:
        """Frames in which nothing can be seen."""
        for _ in range(max(1, round(seconds * self.rate))):
            yield Observation.blind(self._tick(), sight, f"Not to be seen: {sight.value}.")


def with_changes(board: chess.BaseBoard, changes: Mapping[str, str]) -> Array:
    """(64,) the looks of a board with some squares otherwise: ``{"e2": "empty", "e4": "white"}``."""
    states = looks(board)
    for name, look in changes.items():
        states[chess.parse_square(name)] = COLUMNS[look]
    return states


def kinds_of(board: chess.BaseBoard, sure: float = 8.0, noise: float = 0.0, seed: int = 0) -> Array:
    """(64, 13) log-likelihoods of a piece classifier: the right kind ``sure`` above the others, and noise."""
    out = np.random.default_rng(seed).normal(scale=noise, size=(64, 13)) if noise else np.zeros((64, 13))
    for square in chess.SQUARES:
        piece = board.piece_at(square)
        column = 0 if piece is None else piece.piece_type + (0 if piece.color else 6)
        out[square, column] += sure
    return out


def with_kinds(observations: Iterable[Observation], kinds: Array) -> Iterator[Observation]:
    """The same observations with the pieces' kinds read."""
    for observation in observations:
        yield replace(observation, kinds=kinds)
