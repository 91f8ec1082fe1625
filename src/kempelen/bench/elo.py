"""How much stronger one player is, from pairs of games."""

import math
from collections.abc import Sequence

_Z = 1.959964  # of the normal distribution, for 95 %
_ALMOST = 1e-3  # a share nearer to 0 or 1 than this says no more than 1200 Elo


def elo_of(share: float) -> float:
    """The difference that a share of the points stands for (logistic, 400 points for 10 to 1)."""
    share = min(max(share, _ALMOST), 1.0 - _ALMOST)
    return -400.0 * math.log10(1.0 / share - 1.0)


def elo_interval(pairs: Sequence[float]) -> tuple[float, float, float]:
    """The difference and its 95 % interval: ``(elo, low, high)``.

    The two games of a pair begin with the same opening and are not independent: the spread is that of the
        pairs.

    Args:
        pairs: Points of each pair of games, 0..2.

    Raises:
        ValueError: There are fewer than two pairs.
    """
    n = len(pairs)
    if n < 2:  # noqa: PLR2004 - a spread needs two
        raise ValueError("an interval needs at least two pairs of games")
    shares = [points / 2.0 for points in pairs]
    mean = sum(shares) / n
    error = _Z * math.sqrt(sum((share - mean) ** 2 for share in shares) / (n - 1) / n)
    return elo_of(mean), elo_of(mean - error), elo_of(mean + error)
