"""The reader: learns from a known position, then says how likely empty, white and black are."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from kempelen.core.camera import Frame
from kempelen.core.errors import SensorError
from kempelen.core.geometry import Array
from kempelen.core.senses import BLACK, EMPTY, WHITE
from kempelen.sensing.colour.change import ChangeModel
from kempelen.sensing.colour.columns import (
    Columns,
    Plane,
    board_of,
    camera_over_board,
    cut,
    plane,
    tiles,
    without_margin,
)
from kempelen.sensing.colour.light import LightChange, encoded
from kempelen.sensing.colour.looks import looks, shadowed
from kempelen.sensing.colour.parameters import ColourParameters
from kempelen.sensing.colour.predictive import ClassModels
from kempelen.sensing.colour.register import registered
from kempelen.sensing.sighting import DARK, BoardSighting

States = npt.NDArray[np.int64]

SEED = 1  # of invented shadows: the same pictures are read the same way every time
EXTREME = 30.0  # nats of the looks or the change alone; more is beyond what a Student t is fitted for
DOUBT = 1e-3  # weight of a square that probably changed, when the light is fitted


@dataclass(frozen=True, slots=True, eq=False)
class _Memory:
    """How the learned position looked: encoded, from above and cut into columns."""

    plane: Plane
    columns: Columns


@dataclass(frozen=True, slots=True, eq=False)
class _Example:
    """One learned position."""

    states: States
    lit: Array
    shaded: Array  # (64 * copies, features)


@dataclass(frozen=True, slots=True, eq=False)
class ColourReading:
    """What a picture says.

    Attributes:
        log_likelihood: (64, 3) log p(seen | empty, white, black); the likeliest of a row is 0, none is
            below the limit.
        unchanged: (64,) log-likelihood ratio that the square looks as in the learned position, nats.
    """

    log_likelihood: Array
    unchanged: Array


class ColourReader:
    """Reads squares from colour alone, once it has seen a position that is known.

    Args:
        parameters: All that is not estimated; may be replaced at any time.
    """

    def __init__(self, parameters: ColourParameters | None = None) -> None:
        self.parameters = parameters or ColourParameters()
        self._examples: list[_Example] = []
        self._memory: _Memory | None = None
        self._states: States = np.zeros(64, dtype=np.int64)
        self._trust = np.ones(64)

    @property
    def ready(self) -> bool:
        """Whether a position has been learned."""
        return self._memory is not None

    def forget(self) -> None:
        """Start from nothing: another set, another board, another camera."""
        self._examples.clear()
        self._memory = None

    def learn(self, frame: Frame, sighting: BoardSighting, position: npt.ArrayLike) -> None:
        """Take in what a known position looks like; call it at the start and whenever a move is confirmed.

        Args:
            frame: With a colour picture.
            sighting: Where the board is in it.
            position: (64,) EMPTY, WHITE or BLACK.

        Raises:
            SensorError: no colour picture, the board too small in it, or a position that teaches nothing.
        """
        states = _checked(position)
        now, camera = self._seen(frame, sighting)
        if self._memory is not None:
            trust = self._trust * (states == self._states)
            now = registered(self._memory.plane, now)
            now = LightChange.between(self._memory.plane, now, trust + DOUBT).removed(now)
        self._memory = _Memory(now, cut(now, camera, self.parameters.heights))
        self._states, self._trust = states, np.ones(64)
        self._remember(states, self._memory.columns)
        self._refit()

    def read(self, frame: Frame, sighting: BoardSighting) -> Array:
        """(64, 3) log p(what is seen | empty, white, black); only differences within a row mean anything.

        Raises:
            SensorError: nothing learned yet, no colour picture, or the board too small in it.
        """
        return self.examine(frame, sighting).log_likelihood

    def examine(self, frame: Frame, sighting: BoardSighting) -> ColourReading:
        """As `read`, with what it was concluded from.

        Raises:
            SensorError: as `read`.
        """
        if self._memory is None:
            raise SensorError(
                "The colour reader has not seen a known position yet.",
                hint="Set up the position of the game and let it be confirmed once.",
            )
        p = self.parameters
        plain, camera = self._seen(frame, sighting)
        plain = registered(self._memory.plane, plain)
        light = LightChange.between(self._memory.plane, plain, self._trust)
        smooth = cut(plain - light.smooth, camera, p.heights)
        lit = light.removed(plain)
        now = _Memory(lit, cut(lit, camera, p.heights))
        change = _bounded(self._change.log_density(now.columns), EXTREME)
        out = _bounded(p.weight * (self._classes(smooth) + change), p.limit)
        self._adapt(self._memory, now, out)
        return ColourReading(out, _advantage(p.weight * change, self._states))

    def _seen(self, frame: Frame, sighting: BoardSighting) -> tuple[Plane, Array]:
        """The board from above, encoded, and where the camera is."""
        p = self.parameters
        return encoded(plane(frame, sighting, p.pixels)), camera_over_board(frame, sighting, p.focal)

    def _remember(self, states: States, columns: Columns) -> None:
        p = self.parameters
        generator = np.random.default_rng(SEED)
        copies = [looks(shadowed(columns, p.depth, generator), p.radii) for _ in range(p.shadows)]
        example = _Example(states, looks(columns, p.radii), np.concatenate(copies))
        if self._examples and np.array_equal(self._examples[-1].states, states):
            self._examples.pop()
        self._examples = [*self._examples, example][-p.memory :]

    def _refit(self) -> None:
        p = self.parameters
        states = np.concatenate([e.states for e in self._examples])
        count = np.array([(states.reshape(-1, 64)[:, s % 64] == v).sum() for s, v in enumerate(states)])
        weight = 1 / count  # the same piece on the same square teaches nothing new
        self._lit = ClassModels(
            np.concatenate([e.lit for e in self._examples]), states, _dark(states), weight
        )
        many = np.concatenate([np.tile(e.states, p.shadows) for e in self._examples])
        self._shaded = ClassModels(
            np.concatenate([e.shaded for e in self._examples]), many, _dark(many),
            np.concatenate([np.tile(w, p.shadows) for w in weight.reshape(-1, 64)]),
        )  # fmt: skip
        if self._memory is not None:
            generator = np.random.default_rng(SEED)
            self._change = ChangeModel(self._memory.columns, self._states, DARK, p, generator)

    def _classes(self, now: Columns) -> Array:
        """(64, 3) what the squares look like, whatever they were; the likeliest of a row 0."""
        p = self.parameters
        seen = looks(now, p.radii)
        lit, shaded = self._lit.log_density(seen, DARK), self._shaded.log_density(seen, DARK)
        return _bounded(np.logaddexp(lit + np.log(1 - p.shaded), shaded + np.log(p.shaded)), EXTREME)

    def _adapt(self, memory: _Memory, now: _Memory, log_likelihood: Array) -> None:
        """Squares that surely stand as they were are remembered a little more as they look now."""
        sure = _advantage(log_likelihood, self._states) > self.parameters.limit / 2
        self._trust = np.where(sure, 1.0, DOUBT)
        share = self.parameters.adaptation * sure.astype(np.float32)[:, None, None, None]
        memory.columns[...] += share[:, None] * (now.columns - memory.columns)
        old = tiles(without_margin(memory.plane))
        old += share * (tiles(without_margin(now.plane)) - old)
        without_margin(memory.plane)[...] = board_of(old)


def _bounded(log_likelihood: Array, limit: float) -> Array:
    """The likeliest of each row 0, none below -``limit``."""
    out: Array = np.maximum(log_likelihood - log_likelihood.max(axis=1, keepdims=True), -limit)
    return out


def _advantage(log_likelihood: Array, states: States) -> Array:
    """(64,) how much likelier each square's own state is than the best other one, nats."""
    others = log_likelihood.copy()
    others[np.arange(64), states] = -np.inf
    out: Array = log_likelihood[np.arange(64), states] - others.max(axis=1)
    return out


def _dark(states: States) -> npt.NDArray[np.bool_]:
    return np.tile(DARK, len(states) // 64)


def _checked(position: npt.ArrayLike) -> States:
    states = np.asarray(position, dtype=np.int64)
    if states.shape != (64,) or not np.isin(states, (EMPTY, WHITE, BLACK)).all():
        raise SensorError(
            f"A position is 64 squares that are empty (0), white (1) or black (2), not {states.shape}.",
            hint="Give the occupancy in python-chess order, a1 first.",
        )
    empty = int((states == EMPTY).sum())
    if empty in {0, 64}:
        raise SensorError(
            f"A position with {empty} empty squares teaches no difference between empty and occupied.",
            hint="Let the colour reader learn a position with pieces and empty squares.",
        )
    return states
