"""Noise models weighed by restricted likelihood: what the constants of columns absorb is accounted for.

Of each model the covariance is known up to a factor, which is integrated out (H. Patterson & R. Thompson,
Biometrika 58 (1971) 545); given a model, a constant is off as Student's t. Few values tell little of their
noise: so no model is chosen, all are averaged over.

Random effects: the mean of several units' values, each with its standard error, and how far they differ.
Values are normal about the mean with a variance between units and each one's own, both by restricted
likelihood (R. R. Corbeil & S. R. Searle, Technometrics 18, 1976).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.intervals import LEVEL, check_level
from fogml.signals.distributions import normal_ppf, student_ppf, students_ppf

_AT_ONCE = 16
"""Models weighed together."""
_WIDEST, _SIZES = 5.0, 101
"""Widest deviation between units that is thought possible, in the values' own, and how many up to it."""


@dataclass(frozen=True)
class WeighedModels:
    """Noise models, each by its place among those asked for.

    Attributes
    ----------
    weights
        Posterior probabilities, shape (m,).
    variances
        Factor of each covariance, shape (m,).
    constants, scales
        Constant of the last column by generalised least squares, and its standard error, shape (m,) each.
    freedom
        Degrees of freedom.
    """

    weights: FloatArray
    variances: FloatArray
    constants: FloatArray
    scales: FloatArray
    freedom: float


def weighed_models(
    covariances: FloatArray,
    columns: FloatArray,
    values: FloatArray,
    beforehand: FloatArray,
    *,
    squares: FloatArray | float = 0.0,
    log_determinants: FloatArray | float = 0.0,
    freedom: float = 0.0,
    least: float = 0.0,
) -> WeighedModels:
    """Noise models by what columns leave of values.

    Parameters
    ----------
    covariances
        Of the values up to a factor, shape (m, n, n), or the variances of independent values, shape (m, n).
    columns
        Independent columns that explain the values, shape (n, k).
    values
        Values, shape (n,).
    beforehand
        Logarithms of the models' prior probabilities, shape (m,), up to a constant.
    squares, log_determinants, freedom
        Of values beside these, independent of them and explained by no column: their whitened squares and
        the logarithm of their covariance's determinant under each model, shape (m,) or alike under all, and
        their degrees of freedom.
    least
        Least factor.
    """
    count, (n, k) = len(covariances), columns.shape
    free = n - k + freedom
    table = np.column_stack((columns, values))
    likelihood, square = -0.5 * np.broadcast_to(log_determinants, count), np.zeros(count)
    constants, scales = np.zeros((2, count))
    for first in range(0, count, _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        if covariances.ndim == 2:
            roots = np.sqrt(covariances[some])
            white = table / roots[..., None]
        else:
            triangles = np.linalg.cholesky(covariances[some])
            roots, white = np.diagonal(triangles, axis1=1, axis2=2), np.linalg.solve(triangles, table)
        upper = np.asarray(np.linalg.qr(white, mode="r"))
        sizes = np.abs(np.diagonal(upper, axis1=1, axis2=2))
        likelihood[some] -= np.log(roots).sum(axis=1) + np.log(sizes[:, :k]).sum(axis=1)
        square[some] = np.sum(sizes[:, k:] ** 2, axis=1)
        if k:
            constants[some] = upper[:, k - 1, -1] / upper[:, k - 1, k - 1]
            scales[some] = 1.0 / sizes[:, k - 1]
    variances = np.maximum((square + squares) / free, max(least, 1e-300))
    likelihood += beforehand - 0.5 * free * np.log(variances)
    weights = np.exp(likelihood - likelihood.max())
    return WeighedModels(weights / weights.sum(), variances, constants, np.sqrt(variances) * scales, free)


def absent_or_not(ratios: FloatArray) -> FloatArray:
    """Log prior of models in which a part is as likely absent as there, and then of any of its sizes alike.

    Parameters
    ----------
    ratios
        Size of each part in each model, 0 where it is absent, shape (m, parts).
    """
    sizes = [np.count_nonzero(np.unique(part)) for part in ratios.T]
    return -np.asarray((ratios != 0.0) @ np.log(np.maximum(sizes, 1)))


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


def random_effects(values: ArrayLike, errors: ArrayLike) -> RandomEffects:
    """Mean and deviation between units of n values with standard errors, by restricted likelihood."""
    x, se = _told(values, errors, 1)
    if len(x) == 1:
        return RandomEffects(float(x[0]), float(se[0]), float("nan"), 1)
    if not np.all(se > 0.0):
        # One that is told exactly: the values' own deviation is all there is.
        deviation = float(x.std(ddof=1))
        return RandomEffects(float(x.mean()), deviation / np.sqrt(len(x)), deviation, len(x))

    def negative(root: float) -> float:
        return -float(_between(x, se, np.array([root]))[0][0])

    # No deviation is larger than that of the values themselves, by a margin for few.
    top = np.sqrt(10.0 * float(np.var(x, ddof=1)) + 1e-300)
    found = minimize_scalar(negative, bounds=(0.0, top), method="bounded")
    between = float(found.x) if found.fun < negative(0.0) else 0.0
    _, mean, error = _between(x, se, np.array([between]))
    return RandomEffects(float(mean[0]), float(error[0]), between, len(x))


def next_value(values: ArrayLike, errors: ArrayLike, level: float = LEVEL) -> tuple[float, float]:
    """Where the next unit's true value lies with a probability, from two units' values or more.

    Deviations between units are weighed by their restricted likelihood: the likeliest alone is none, often,
    where units differ by no more than their errors.
    """
    check_level(level, "next value")
    x, se = _told(values, errors, 2)
    tails = np.array([0.5 - 0.5 * level, 0.5 + 0.5 * level])
    own = float(x.std(ddof=1))
    if own == 0.0 or not np.all(se > 0.0):
        ends = x.mean() + own * np.sqrt(1.0 + 1.0 / len(x)) * student_ppf(tails, len(x) - 1)
    else:
        between = own * np.linspace(0.0, _WIDEST, _SIZES)
        likelihood, means, deviations = _between(x, se, between)
        weights = np.exp(likelihood - likelihood.max())
        spreads = np.hypot(between, deviations)
        ends = students_ppf(tails, weights / weights.sum(), means, spreads, np.inf)
    return float(ends[0]), float(ends[1])


def _told(values: ArrayLike, errors: ArrayLike, least: int) -> tuple[FloatArray, FloatArray]:
    x, se = np.asarray(values, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if x.shape != se.shape or len(x) < least or not (np.isfinite(x).all() and np.all(se >= 0.0)):
        raise InputError(f"values of units: {least} or more, finite, with an error each, were expected")
    return x, se


def _between(x: FloatArray, se: FloatArray, deviations: FloatArray) -> tuple[FloatArray, ...]:
    """Restricted log likelihood of deviations between units, the mean and its error by each, shape (m,)."""
    variances = deviations[:, None] ** 2 + se**2
    total = np.sum(1.0 / variances, axis=1)
    means = np.sum(x / variances, axis=1) / total
    square = np.sum((x - means[:, None]) ** 2 / variances, axis=1)
    likelihood = -0.5 * (np.sum(np.log(variances), axis=1) + square + np.log(total))
    return likelihood, means, 1.0 / np.sqrt(total)
