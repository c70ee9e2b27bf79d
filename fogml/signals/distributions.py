"""Quantiles and tails of normal values, chi-square, Student's t and F, to the bit those of `scipy.stats`.

That package takes longer to load than most commands need for all else; `scipy.special` is loaded by use, too.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

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
    probability: ArrayLike,
    weights: FloatArray,
    centres: FloatArray,
    scales: FloatArray,
    freedom: FloatArray | float,
) -> Any:
    """Value under which a mixture of Student's t about `centres` lies with a probability, by halving.

    Weights and centres are of shape (m,), and so are degrees of freedom, if not one of all, and scales, none
    of which is 0, or of the probability's shape and m.
    """
    asked = np.asarray(probability)
    ends = centres + scales * student_ppf(asked[..., None], freedom)
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


def variances_isf(probability: float, above: int, below: float) -> float:
    """Value over which a ratio of two mean squares lies with a probability (F)."""
    from scipy.special import fdtri

    return float(fdtri(above, below, 1.0 - probability))


def root_of(covariance: FloatArray) -> FloatArray:
    """A matrix R with R R' the covariance, (k, k), of parameters whose units may differ by any factor.

    In units of deviations, where rounding of the large ones does not outdo the small, it is the symmetric
    one, which moves with the covariance: eigenvectors alone turn with the last digit, and draws with them.
    """
    scale = np.sqrt(np.maximum(np.diag(covariance), np.finfo(np.float64).tiny))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * (vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T))
