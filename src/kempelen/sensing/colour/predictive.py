"""How likely a look is for a class of which few examples were seen.

Gaussians whose mean and covariance are themselves uncertain: with a normal-inverse-Wishart prior what is
predicted is a multivariate Student t (Murphy, "Conjugate Bayesian analysis of the Gaussian distribution",
2007, section 9), wide where examples are few, so that nothing is surer than it has reason to be.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import gammaln

from kempelen.core.geometry import Array

SHRINK = 0.1  # of covariances towards their diagonal
JITTER = 1e-4  # added to variances: features are logarithms, known to a percent at best
PRIOR_MEAN = 1.0  # examples that the prior mean is worth
INFLATED = 4.0  # variance of what no model foresaw, to that of all examples together
UNFORESEEN = 0.1  # share of squares that look like nothing learned: prints and stains come to light
PRIOR_SPREAD = 6.0  # examples that the prior covariance is worth


def shrunk(scatter: Array) -> Array:
    """A covariance that can be inverted."""
    diagonal = np.diag(scatter)
    return (1 - SHRINK) * scatter + np.diag(SHRINK * diagonal + JITTER)


@dataclass(frozen=True, slots=True, eq=False)
class Student:
    """A multivariate Student t.

    Attributes:
        mean: (d,).
        whitening: (d, d) inverse of the lower Cholesky factor of the scale matrix.
        freedom: Degrees of freedom.
    """

    mean: Array
    whitening: Array
    freedom: float

    @classmethod
    def of(cls, mean: Array, scale: Array, freedom: float) -> "Student":
        """From its scale matrix."""
        return cls(mean, np.linalg.inv(np.linalg.cholesky(scale)).astype(np.float64), freedom)

    @classmethod
    def predicted(
        cls, examples: Array, weight: Array, prior_mean: Array, prior_covariance: Array
    ) -> "Student":
        """Of the next example, after (n, d) examples of that weight."""
        d, n = len(prior_mean), float(weight.sum())
        spread = d + PRIOR_SPREAD + 2
        strength, freedom = PRIOR_MEAN + n, spread + n - d + 1
        mean = (PRIOR_MEAN * prior_mean + weight @ examples) / strength
        off = examples - (weight @ examples / n if n else prior_mean)
        scatter = prior_covariance * (spread - d - 1) + (off * weight[:, None]).T @ off
        return cls.of(mean, scatter * (strength + 1) / (strength * freedom), freedom)

    def log_density(self, x: Array) -> Array:
        """(n,) of (n, d)."""
        d, nu = len(self.mean), self.freedom
        off = (x - self.mean) @ self.whitening.T
        constant = gammaln((nu + d) / 2) - gammaln(nu / 2) - d / 2 * np.log(nu * np.pi)
        out: Array = (
            constant
            + np.log(np.diag(self.whitening)).sum()
            - (nu + d) / 2 * np.log1p((off * off).sum(axis=1) / nu)
        )
        return out


def fitted(examples: Array, weight: Array, towards: Array | None = None, share: float = 0.0) -> Student:
    """Student t of weighted examples, its covariance mixed with another one's.

    Args:
        examples: (n, d).
        weight: (n,).
        towards: (d, d) covariance.
        share: Of ``towards``.
    """
    n = float(weight.sum())
    mean = weight @ examples / n
    off = examples - mean
    covariance = shrunk((off * weight[:, None]).T @ off / n)
    if towards is not None:
        covariance = (1 - share) * covariance + share * towards
    return Student.of(mean, covariance, max(n / 4, 5.0))


def broad(examples: Array, weight: Array) -> Student:
    """Like any of the examples and what lies around them: the model of what no model foresaw."""
    model = fitted(examples, weight)
    return Student(model.mean, model.whitening / np.sqrt(INFLATED), 5.0)


def hedged(log_density: Array, unforeseen: Array) -> Array:
    """Mixed with what no model foresaw, so that a look far from all classes speaks for none of them."""
    out: Array = np.logaddexp(log_density + np.log(1 - UNFORESEEN), unforeseen + np.log(UNFORESEEN))
    return out


class ClassModels:
    """What squares look like that are empty, hold a white piece, hold a black piece; by their own colour.

    A piece on a light square borrows from pieces on dark squares what few examples leave open.

    Args:
        looks: (n, d) examples.
        states: (n,) EMPTY, WHITE or BLACK.
        dark: (n,) whether it is a dark square.
        weight: (n,) of each example.
    """

    def __init__(
        self, looks: Array, states: npt.NDArray[np.int64], dark: npt.NDArray[np.bool_], weight: Array
    ) -> None:
        within = _within(looks, states, dark, weight)
        self._models: dict[tuple[int, bool], Student] = {}
        self._unknown = fitted(looks, weight)
        self._broad = broad(looks, weight)
        for state in np.unique(states):
            same = states == state
            middle = np.average(looks[same], axis=0, weights=weight[same])
            for shade in (False, True):
                k = same & (dark == shade)
                self._models[int(state), shade] = Student.predicted(looks[k], weight[k], middle, within)

    def log_density(self, looks: Array, dark: npt.NDArray[np.bool_]) -> Array:
        """(n, 3) of (n, d) looks; a state never seen looks like anything that was."""
        out = np.empty((len(looks), 3))
        for state in range(3):
            for shade in (False, True):
                k = dark == shade
                out[k, state] = self._models.get((state, shade), self._unknown).log_density(looks[k])
        return hedged(out, self._broad.log_density(looks)[:, None])


def _within(looks: Array, states: npt.NDArray[np.int64], dark: npt.NDArray[np.bool_], weight: Array) -> Array:
    """(d, d) pooled covariance within the classes."""
    off = looks.copy()
    groups = 2 * states + dark
    for group in np.unique(groups):
        k = groups == group
        off[k] -= np.average(looks[k], axis=0, weights=weight[k])
    freedom = max(float(weight.sum()) * (1 - len(np.unique(groups)) / len(looks)), 1.0)
    return shrunk((off * weight[:, None]).T @ off / freedom)
