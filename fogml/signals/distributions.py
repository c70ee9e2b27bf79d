"""Quantiles and tails of normal values, chi-square, Student's t and F, to the bit those of `scipy.stats`.

That package takes longer to load than most commands need for all else; `scipy.special` is loaded by use, too.

Random effects: the mean of several units' values, each with its standard error, and how far they differ.

Values are normal about the mean with a variance between units and each one's own, both by restricted
likelihood (R. R. Corbeil & S. R. Searle, Technometrics 18, 1976).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from fogml.arrays import FloatArray
from fogml.intervals import LEVEL


def chi2_ppf(probability: ArrayLike, freedom: ArrayLike) -> Any:
    """Value under which a chi-square lies with a probability."""
    from scipy.special import gammaincinv

    return 2.0 * gammaincinv(np.asarray(freedom) / 2.0, probability)


def chi2_isf(probability: ArrayLike, freedom: ArrayLike) -> Any:
    """Value over which a chi-square lies with a probability."""
    from scipy.special import chdtri

    return chdtri(freedom, probability)


def chi2_cdf(value: ArrayLike, freedom: ArrayLike) -> Any:
    """Probability of a chi-square under a value, which is not negative."""
    from scipy.special import chdtr

    return chdtr(freedom, value)


def chi2_sf(value: ArrayLike, freedom: ArrayLike) -> Any:
    """Probability of a chi-square over a value, which is not negative."""
    from scipy.special import chdtrc

    return chdtrc(freedom, value)


def deviation_within(value: float, freedom: float, level: float = LEVEL) -> tuple[float, float]:
    """Interval of a standard deviation that normal values show with so many degrees of freedom."""
    outside = 0.5 * (1.0 - level)
    low, high = (value * float(np.sqrt(freedom / chi2_ppf(p, freedom))) for p in (1.0 - outside, outside))
    return low, high


def student_ppf(probability: ArrayLike, freedom: ArrayLike) -> Any:
    """Value under which Student's t lies with a probability between 0 and 1."""
    from scipy.special import stdtrit

    return stdtrit(freedom, probability)


def student_sf(value: ArrayLike, freedom: ArrayLike) -> Any:
    """Probability of Student's t over a value."""
    from scipy.special import stdtr

    return stdtr(freedom, -np.asarray(value))


def students_ppf(
    probability: ArrayLike, weights: FloatArray, centres: FloatArray, scales: FloatArray, freedom: float
) -> Any:
    """Value under which a mixture of Student's t about `centres` lies with a probability, by halving.

    Weights and centres are of shape (m,), and so are scales, none of which is 0, or of the probability's
    shape and m.
    """
    asked = np.asarray(probability)
    ends = centres + scales * student_ppf(asked, freedom)[..., None]
    low, high = ends.min(axis=-1), ends.max(axis=-1)
    while np.any(high - low > 1e-12 * np.maximum(np.abs(low), np.abs(high))):
        middle = 0.5 * (low + high)
        if not np.any((low < middle) & (middle < high)):
            break
        beyond = student_sf((middle[..., None] - centres) / scales, freedom) @ weights < 1.0 - asked
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return 0.5 * (low + high)


def normal_ppf(probability: ArrayLike) -> Any:
    """Value under which a standard normal one lies with a probability."""
    from scipy.special import ndtri

    return ndtri(probability)


def variances_sf(ratio: float, above: int, below: float) -> float:
    """Probability of a ratio of two mean squares, of so many degrees of freedom each, over a value (F).

    The lower one is known where it has infinitely many.
    """
    from scipy.special import fdtrc

    return float(chi2_sf(ratio * above, above) if np.isinf(below) else fdtrc(above, below, ratio))


def variances_isf(probability: float, above: int, below: int) -> float:
    """Value over which a ratio of two mean squares lies with a probability (F)."""
    from scipy.special import fdtri

    return float(fdtri(above, below, 1.0 - probability))


@dataclass(frozen=True)
class RandomEffects:
    """Mean of n values with its standard error, and their standard deviation `between` units; NaN of one."""

    mean: float
    se: float
    between: float
    count: int

    def interval(self, level: float = 0.9) -> tuple[float, float]:
        """Where the mean lies with a probability; by Student's t of as many units, of one by its error."""
        tail = 0.5 + 0.5 * level
        reach = float(student_ppf(tail, self.count - 1) if self.count > 1 else normal_ppf(tail)) * self.se
        return self.mean - reach, self.mean + reach

    def next_value(self, level: float = LEVEL) -> tuple[float, float]:
        """Where the next unit's true value lies with a probability; by Student's t of as many units."""
        reach = float(student_ppf(0.5 + 0.5 * level, self.count - 1)) * float(np.hypot(self.se, self.between))
        return self.mean - reach, self.mean + reach


def random_effects(values: ArrayLike, errors: ArrayLike) -> RandomEffects:
    """Mean and deviation between units of n values with standard errors, by restricted likelihood."""
    x, se = np.asarray(values, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if len(x) == 1:
        return RandomEffects(float(x[0]), float(se[0]), float("nan"), 1)
    if not np.all(se > 0.0):
        # One that is told exactly: the values' own deviation is all there is.
        deviation = float(x.std(ddof=1))
        return RandomEffects(float(x.mean()), deviation / np.sqrt(len(x)), deviation, len(x))

    def mean_of(variance: float) -> tuple[float, float]:
        weights = 1.0 / (variance + se**2)
        return float(weights @ x / weights.sum()), float(weights.sum())

    def negative(variance: float) -> float:
        mean, total = mean_of(variance)
        spread = variance + se**2
        return 0.5 * float(np.sum(np.log(spread) + (x - mean) ** 2 / spread)) + 0.5 * np.log(total)

    # No deviation is larger than that of the values themselves, by a margin for few.
    top = 10.0 * float(np.var(x, ddof=1)) + 1e-300
    found = minimize_scalar(lambda root: negative(root**2), bounds=(0.0, np.sqrt(top)), method="bounded")
    variance = float(found.x**2) if found.fun < negative(0.0) else 0.0
    mean, total = mean_of(variance)
    return RandomEffects(mean, float(1.0 / np.sqrt(total)), float(np.sqrt(variance)), len(x))
