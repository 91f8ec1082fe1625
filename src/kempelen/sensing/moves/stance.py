"""Whether a piece stands upright and in the middle of its square.

Sensors read heights low by an amount of their own (the top of a piece is a few pixels wide, and black
reflects little), so that a height is compared with those of the other pieces of its kind and colour, or,
where there are not enough of them, with its nominal height times the median over its colour of measured over
nominal. The spread about that says how far a height can be trusted.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import chess
import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from kempelen.core.geometry import Array
from kempelen.core.pieces import PieceSet, piece_name
from kempelen.core.senses import Observation
from kempelen.sensing.moves.parameters import Rate, log_odds

MAD_TO_SIGMA = 1.4826  # of a normal distribution
UNCALIBRATED = 0.1  # of the tallest piece: the noise that is assumed then
WITNESSES_OF_A_KIND = 2
_ALL_PIECES = tuple(chess.Piece(kind, colour) for kind in chess.PIECE_TYPES for colour in chess.COLORS)
WITNESSES = 4  # fewer standing pieces do not tell how the sensor reads heights


class StanceParameters(BaseModel):
    """What counts as standing well.

    Attributes:
        centred: A foot may be that far from the middle of its square, mm.
        height_noise: Heights are never trusted more than this, mm, one sigma.
        fallen: Probability that a piece that was set down has fallen over.
        sure: Below this probability of the opposite a piece is said to stand, or to lie.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    centred: Annotated[float, Field(gt=0, le=50)] = 8.0
    height_noise: Annotated[float, Field(gt=0, le=50)] = 2.0
    fallen: Rate = 0.01
    sure: Rate = 1e-3


@dataclass(frozen=True, slots=True)
class _Reading:
    """How a sensor reads heights: measured over nominal of each piece, and the spread, mm."""

    scales: Mapping[chess.Piece, float]
    noise: float


class Stance:
    """Heights and offsets of the newest clear frames.

    Args:
        frames: How many are kept.
    """

    def __init__(self, frames: int) -> None:
        self._heights: deque[Array] = deque(maxlen=frames)
        self._offsets: deque[Array] = deque(maxlen=frames)

    def add(self, observation: Observation) -> None:
        """Take in a clear frame."""
        if observation.heights is not None:
            self._heights.append(observation.heights)
        if observation.offsets is not None:
            self._offsets.append(observation.offsets)

    def clear(self) -> None:
        """Forget everything."""
        self._heights.clear()
        self._offsets.clear()

    @property
    def heights(self) -> Array:
        """(64,) mm, medians; NaN where not measured."""
        return _median(self._heights, (64,))

    @property
    def offsets(self) -> Array:
        """(64, 2) mm, medians; NaN where not measured."""
        return _median(self._offsets, (64, 2))


def _median(rows: Sequence[Array] | deque[Array], shape: tuple[int, ...]) -> Array:
    """Median over frames; NaN where fewer than half of them measured anything."""
    if not rows:
        return np.full(shape, np.nan)
    stacked = np.asarray(rows, dtype=np.float64)
    enough = 2 * np.isfinite(stacked).sum(axis=0) >= len(stacked)
    known = np.where(enough, stacked, 0.0)
    return np.where(enough, np.nanmedian(known, axis=0), np.nan)


def faults(
    stance: Stance,
    expected: Mapping[chess.Square, chess.Piece],
    targets: Sequence[chess.Square],
    pieces: PieceSet | None,
    parameters: StanceParameters,
) -> tuple[list[str], list[str]]:
    """What does not stand well, and what cannot be told; sentences.

    Args:
        stance: What was measured.
        expected: What stands where.
        targets: Squares to judge; all of them occupied.
        pieces: Sizes; None: heights are not judged.
        parameters: Tolerances.
    """
    bad, vague = [], []
    heights, offsets = stance.heights, stance.offsets
    for square in targets:
        name = f"The {piece_name(expected[square])} on {chess.square_name(square)}"
        if pieces is not None:
            reading = _reading(heights, expected, targets, pieces, parameters)
            lying = _lies(heights[square], expected[square], pieces, reading) - log_odds(parameters.fallen)
            if lying > 0:
                bad.append(f"{name} has fallen over: stand it up.")
            elif lying > -log_odds(parameters.sure):
                vague.append(f"{name} may have fallen over.")
        distance = float(np.hypot(*offsets[square]))
        if distance > parameters.centred:
            bad.append(
                f"{name} stands {distance:.0f} mm off the middle of its square, more than the "
                f"{parameters.centred:.0f} mm allowed: put it in the middle."
            )
    return bad, vague


def _reading(
    heights: Array,
    expected: Mapping[chess.Square, chess.Piece],
    targets: Sequence[chess.Square],
    pieces: PieceSet,
    parameters: StanceParameters,
) -> _Reading:
    """How this sensor reads heights, from the pieces that nobody has moved."""
    standing = [s for s in expected if s not in targets and np.isfinite(heights[s])]
    if len(standing) < WITNESSES:
        noise = max(parameters.height_noise, UNCALIBRATED * pieces.tallest)
        return _Reading(dict.fromkeys(_ALL_PIECES, 1.0), noise)
    seen = [expected[s] for s in standing]
    nominal = np.array([pieces[piece.piece_type].height for piece in seen])
    ratios = heights[standing] / nominal
    scales = {piece: _scale(ratios, piece, seen) for piece in _ALL_PIECES}
    residuals = np.abs(ratios - [scales[piece] for piece in seen]) * nominal
    return _Reading(scales, max(parameters.height_noise, MAD_TO_SIGMA * float(np.median(residuals))))


def _scale(ratios: Array, piece: chess.Piece, seen: Sequence[chess.Piece]) -> float:
    """Measured over nominal of one piece: the median of its like, of its colour, or of all."""
    like = np.array([other == piece for other in seen])
    of_colour = np.array([other.color == piece.color for other in seen])
    for alike in (like, of_colour):
        if alike.sum() >= WITNESSES_OF_A_KIND:
            return float(np.median(ratios[alike]))
    return float(np.median(ratios))


def _lies(height: float, piece: chess.Piece, pieces: PieceSet, reading: _Reading) -> float:
    """Log-likelihood ratio that the piece lies, as tall as it is thick; minus infinity without a height."""
    if not np.isfinite(height):
        return -np.inf
    shape, scale = pieces[piece.piece_type], reading.scales[piece]
    upright, lying = scale * shape.height, scale * max(shape.base_diameter, shape.head_diameter)
    if height >= upright:
        return -np.inf
    return float((height - upright) ** 2 - (height - lying) ** 2) / (2 * reading.noise**2)
