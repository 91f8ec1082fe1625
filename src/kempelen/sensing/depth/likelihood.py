"""From heights to likelihoods: what an empty square shows, what a piece shows, and what a hole says."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaln

from kempelen.core.geometry import Array
from kempelen.sensing.depth.geometry import Mask
from kempelen.sensing.depth.heights import Peaks
from kempelen.sensing.parameters import Parameter, Parameters

_MAD = 1.4826
_TAIL = 4.0  # degrees of freedom: depth noise has far outliers, one in some hundred squares
_STRAY = 1e-4  # of squares show anything between none and _HIGHEST, whatever stands there
_HIGHEST = 150.0  # mm
_PRIOR_SQUARES = 8.0  # that the prior of the pieces' heights counts for
_PRIOR_HOLES = 64.0  # squares that the priors of holes count for
_FEWEST_SHIFTED = 8  # pieces
_PRIOR_NULL = 16.0  # that the prior of the noise counts for
_STEPS = 8
_SURE = 0.95
_CLEAR = 2.0


def depth_parameters() -> Parameters:
    """As they are before anything was seen."""
    return Parameters(
        Parameter("depth.noise", 2.0, "mm", 0.1, 30, "scatter of the board's cells"),
        Parameter("depth.trust", 0.0, "", 0, 1, "share of the remembered empty board that shows again"),
        Parameter("depth.dark_step", 0.0, "mm", -20, 20, "how much higher dark squares read than light ones"),
        Parameter("depth.slope", 0.3, "", 0, 1, "share of its surroundings' level that a square has too"),
        Parameter("depth.empty_centre", 0.8, "noise", 0, 10, "what an empty square shows, in units of noise"),
        Parameter("depth.empty_scale", 0.5, "noise", 0.05, 10, "its scatter, in units of noise"),
        Parameter("depth.empty_floor", 0.7, "mm", 0.1, 10, "least scatter of an empty square"),
        Parameter("depth.piece_height", 28.0, "mm", 8, 120, "middle height that pieces show"),
        Parameter("depth.piece_spread", 0.5, "", 0.1, 1.5, "scatter of its logarithm"),
        Parameter("depth.ghost", 0.3, "", 0, 1, "share of empty squares behind a piece that seem occupied"),
        Parameter("depth.vanish", 0.02, "", 1e-4, 0.9, "share of pieces that show no height, only a hole"),
        Parameter("depth.empty_holes", 0.03, "", 1e-3, 0.9, "share of empty squares that show a hole"),
        Parameter("depth.shift_x", 0.0, "squares", -0.3, 0.3, "how far pieces appear towards the h file"),
        Parameter("depth.shift_y", 0.0, "squares", -0.3, 0.3, "how far pieces appear towards rank 8"),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Of one frame.

    Attributes:
        peaks: Of the squares.
        noise: (64,) mm about each square.
        missing: (64,) share of pixels without measurement in the middle of each square.
        shadowed: (64,) share of what stands out that lies where the camera cannot see: behind a piece.
    """

    peaks: Peaks
    noise: Array
    missing: Array
    shadowed: Array


def occupied_over_empty(
    evidence: Evidence, parameters: Parameters, *, ghosts: bool = True
) -> tuple[Array, Array]:
    """(64,) log p(seen | empty) and (64,) log p(seen | a piece), up to a constant of each square.

    Args:
        evidence: Of a frame.
        parameters: Of the densities.
        ghosts: Whether what is seen behind a piece may be a bridge to it; for learning what pieces look like
            that does not matter.
    """
    null = empty_density(evidence, parameters)
    piece = piece_density(evidence.peaks.scores, parameters)
    if not ghosts:
        evidence = replace(evidence, shadowed=np.zeros(len(null)))
    ghost = np.clip(parameters["depth.ghost"] * evidence.shadowed, _STRAY, 1 - _STRAY)
    null = np.logaddexp(np.log1p(-ghost) + null, np.log(ghost) + piece)
    blind = np.isnan(evidence.peaks.scores)
    null[blind] = piece[blind] = 0.0
    holes, vanish = parameters["depth.empty_holes"], parameters["depth.vanish"]
    hole = hole_density(evidence.missing)
    whole = whole_density(evidence.missing)
    empty = null + np.logaddexp(np.log1p(-holes) + whole, np.log(holes) + hole)
    shown = np.log1p(-vanish) + piece + np.logaddexp(np.log1p(-holes) + whole, np.log(holes) + hole)
    return empty, np.logaddexp(shown, np.log(vanish) + null + hole)


def empty_density(evidence: Evidence, parameters: Parameters) -> Array:
    """(64,) log density of the score on an empty square, per mm: Student's t about what noise does."""
    scale = np.hypot(parameters["depth.empty_scale"] * evidence.noise, parameters["depth.empty_floor"])
    scores = np.nan_to_num(evidence.peaks.scores, nan=0.0)
    away = (scores - parameters["depth.empty_centre"] * evidence.noise) / scale
    away = np.maximum(away, 0.0)  # a dip is as good a sign of an empty square as none
    core = (
        gammaln((_TAIL + 1) / 2) - gammaln(_TAIL / 2) - 0.5 * np.log(_TAIL * np.pi)
        - np.log(scale) - (_TAIL + 1) / 2 * np.log1p(away**2 / _TAIL)
    )  # fmt: skip
    return with_strays(core)


def piece_density(scores: Array, parameters: Parameters) -> Array:
    """(64,) log density of the score where a piece stands, per mm: log-normal."""
    spread = parameters["depth.piece_spread"]
    logs = np.log(np.maximum(np.nan_to_num(scores, nan=0.0), 0.5))
    away = (logs - np.log(parameters["depth.piece_height"])) / spread
    return with_strays(-0.5 * away**2 - np.log(spread) - 0.5 * np.log(2 * np.pi) - logs)


def with_strays(log_density: Array) -> Array:
    """The same with a floor: no single height proves anything beyond the rate of strays."""
    out: Array = np.logaddexp(np.log1p(-_STRAY) + log_density, np.log(_STRAY / _HIGHEST))
    return out


def whole_density(missing: Array) -> Array:
    """(64,) log density of the missing share where the surface reflects well: Beta(1, 12)."""
    out: Array = np.log(12.0) + 11.0 * np.log1p(-np.minimum(missing, 0.98))
    return out


def hole_density(missing: Array) -> Array:
    """(64,) log density of the missing share where it does not: Beta(2, 1)."""
    out: Array = np.log(2.0) + np.log(np.maximum(missing, 1e-3))
    return out


def estimate(evidence: Evidence, parameters: Parameters, position: Mask | None) -> None:
    """Take the noise from the mirrored scores, and the pieces' heights from what stands out.

    Args:
        evidence: Of a frame.
        parameters: Changed in place.
        position: (64,) whether a piece stands on each square; None when unknown: by expectation and
            maximisation, then.
    """
    occupied = ~surely_empty(evidence, parameters) if position is None else position
    _estimate_noise(evidence, parameters, ~occupied)
    for _ in range(_STEPS if position is None else 1):
        _estimate_pieces(evidence, parameters, position)
    if position is not None:
        _estimate_holes(evidence, parameters, occupied)
    _estimate_shift(
        evidence, parameters, _surely_occupied(evidence, parameters) if position is None else position
    )


def surely_empty(evidence: Evidence, parameters: Parameters) -> Mask:
    """(64,) squares that are at least e^2 times likelier empty than not."""
    empty, piece = occupied_over_empty(evidence, parameters, ghosts=False)
    out: Mask = empty - piece > _CLEAR
    return out


def _surely_occupied(evidence: Evidence, parameters: Parameters) -> Mask:
    empty, piece = occupied_over_empty(evidence, parameters, ghosts=False)
    out: Mask = piece - empty > _CLEAR
    return out


def _estimate_noise(evidence: Evidence, parameters: Parameters, empty: Mask) -> None:
    ratio = evidence.peaks.mirror[empty] / evidence.noise[empty]
    ratio = ratio[np.isfinite(ratio)]
    if not len(ratio):
        return
    share = len(ratio) / (len(ratio) + _PRIOR_NULL)
    centre = float(np.median(ratio))
    scale = _MAD * float(np.median(np.abs(ratio - centre)))
    source = f"lower side of {len(ratio)} squares"
    parameters.estimate("depth.empty_centre", share * centre + (1 - share) * 0.8, source)
    parameters.estimate("depth.empty_scale", share * scale + (1 - share) * 0.5, source)


def _estimate_pieces(evidence: Evidence, parameters: Parameters, position: Mask | None) -> None:
    scores = evidence.peaks.scores
    if position is None:
        empty, piece = occupied_over_empty(evidence, parameters, ghosts=False)
        sure = 1 / (1 + np.exp(np.clip(empty - piece, -50, 50)))
        weights = np.where(sure > _SURE, sure, 0.0)
    else:
        weights = np.asarray(position, dtype=np.float64).copy()
    weights[~(scores > 2 * parameters["depth.empty_centre"] * evidence.noise)] = 0.0
    amount = weights.sum() + _PRIOR_SQUARES
    logs = np.log(np.where(weights > 0, scores, 1.0))
    middle = (weights @ logs + _PRIOR_SQUARES * np.log(28.0)) / amount
    variance = (weights @ (logs - middle) ** 2 + _PRIOR_SQUARES * 0.25) / amount
    source = f"{weights.sum():.0f} pieces"
    parameters.estimate("depth.piece_height", float(np.exp(middle)), source)
    if position is not None:  # otherwise the low ones are missing among those that are sure
        parameters.estimate("depth.piece_spread", float(np.sqrt(variance)), source)


def _estimate_holes(evidence: Evidence, parameters: Parameters, occupied: Mask) -> None:
    """How often pieces vanish and empty squares have holes, in frames of a known position."""
    hole = hole_density(evidence.missing) > whole_density(evidence.missing)
    flat = ~(evidence.peaks.scores > 0.4 * parameters["depth.piece_height"])
    for name, prior, counted, all_of in (
        ("depth.vanish", 0.02, hole & flat & occupied, occupied),
        ("depth.empty_holes", 0.03, hole & ~occupied, ~occupied),
    ):
        share = (counted.sum() + _PRIOR_HOLES * prior) / (all_of.sum() + _PRIOR_HOLES)
        parameters.estimate(name, float(share), f"{counted.sum()} of {all_of.sum()} squares")


def _estimate_shift(evidence: Evidence, parameters: Parameters, occupied: Mask) -> None:
    """Registration of depth to colour: where known pieces appear in their squares, on average."""
    seen = occupied & np.isfinite(evidence.peaks.offsets[:, 0])
    if seen.sum() < _FEWEST_SHIFTED:
        return
    for axis, name in enumerate(("depth.shift_x", "depth.shift_y")):
        middle = float(np.median(evidence.peaks.offsets[seen, axis]))
        parameters.estimate(name, middle, f"{seen.sum()} known pieces")
