"""Fit of a sum of non-negative terms to variances with chi-square errors, and its intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Correlation = Callable[[FloatArray], FloatArray]

_ITERATIONS = 100
_TOLERANCE = 1e-9


@dataclass(frozen=True)
class VarianceFit:
    """A fitted sum of terms, with what its intervals need.

    Attributes
    ----------
    shapes
        Terms of coefficient 1 at each point, shape (k, p).
    variances, edf
        Variances and their degrees of freedom, reduced by `excess`, shape (k,).
    coefficients
        Not negative, shape (p,).
    correlation
        Correlation of the points' errors, shape (k, k).
    excess
        Variance of the points' relative errors beyond ``2 / edf``.
    """

    shapes: FloatArray
    variances: FloatArray
    edf: FloatArray
    coefficients: FloatArray
    correlation: FloatArray
    excess: float


def fit_variances(
    shapes: FloatArray, variances: FloatArray, edf: FloatArray, correlation: Correlation
) -> VarianceFit:
    """Fit ``variances ~ shapes @ coefficients``, each point ``chi2(edf) / edf`` about the sum.

    Greatest likelihood of the points taken one by one, which correlation leaves unbiased. Where
    the squared relative errors exceed their expectation, every point's relative error gets
    the excess variance that explains them (Mandel and Paule, 1970), as an error of its own.

    Parameters
    ----------
    shapes
        Terms of coefficient 1, shape (k, p).
    variances
        Positive, shape (k,).
    edf
        Degrees of freedom, shape (k,).
    correlation
        Gives the correlation of the points' errors, shape (k, k), for coefficients.
    """
    own = np.asarray(edf, dtype=np.float64)

    def at(excess: float) -> tuple[FloatArray, FloatArray, float]:
        reduced = own / (1.0 + 0.5 * own * excess)
        coefficients = greatest_likelihood(shapes, variances, reduced)
        relative = variances / (shapes @ coefficients) - 1.0
        # An unexplained point says no more than one that is off by its own size.
        squares = 0.5 * reduced @ np.minimum(relative**2, 1.0)
        free = len(variances) - np.count_nonzero(coefficients)
        return reduced, coefficients, float(squares - free)

    excess = 0.0
    reduced, coefficients, surplus = at(excess)
    if surplus > 0 and len(variances) > np.count_nonzero(coefficients):
        low, high = 0.0, 4.0
        for _ in range(30):
            excess = 0.5 * (low + high)
            reduced, coefficients, surplus = at(excess)
            low, high = (excess, high) if surplus > 0 else (low, excess)
            if high - low < 1e-3 * high:
                break
    # The excess is an error of each point, which the others do not share.
    shared = np.sqrt(reduced / own)
    correlated = correlation(coefficients) * np.outer(shared, shared)
    np.fill_diagonal(correlated, 1.0)
    return VarianceFit(shapes, variances, reduced, coefficients, correlated, excess)


def interval(fit: VarianceFit, column: int, level: float) -> tuple[float, float]:
    """Interval of one coefficient at `level`: profile likelihood, widened for correlation.

    The likelihood of correlated points overstates what they tell; its loss is reduced by the
    ratio of the variance that it implies for the coefficient to the one that follows from the
    points' correlation (Chandler and Bate, 2007). The lower end is 0 where a curve without
    the term fits within the interval.
    """
    from scipy.optimize import brentq
    from scipy.special import ndtri

    best = deviance(fit.variances, fit.shapes @ fit.coefficients, fit.edf)
    allowed = float(ndtri(0.5 + 0.5 * level)) ** 2 / _information_ratio(fit, column)
    others = np.delete(fit.shapes, column, axis=1)

    def loss(coefficient: float) -> float:
        fixed = coefficient * fit.shapes[:, column]
        rest = greatest_likelihood(others, fit.variances, fit.edf, fixed)
        return deviance(fit.variances, fixed + others @ rest, fit.edf) - best - allowed

    value = float(fit.coefficients[column])
    # Scale on which the term alone would make the whole of some point.
    scale = float(np.min(fit.variances / fit.shapes[:, column]))
    top = max(value, 1e-3 * scale)
    while loss(top) < 0:
        top *= 2.0
    upper = float(brentq(loss, value, top, xtol=1e-9 * top, rtol=1e-4)) if loss(value) < 0 else value
    if value == 0 or loss(0.0) <= 0:
        return 0.0, upper
    return float(brentq(loss, 0.0, value, xtol=1e-9 * value, rtol=1e-4)), upper


def _information_ratio(fit: VarianceFit, column: int) -> float:
    """Variance of a coefficient by the likelihood alone over that with correlated points."""
    free = fit.coefficients > 0
    free[column] = True
    position = int(np.count_nonzero(free[:column]))
    weighted = (
        np.sqrt(0.5 * fit.edf)[:, None] * fit.shapes[:, free] / (fit.shapes @ fit.coefficients)[:, None]
    )
    weighted = weighted / np.linalg.norm(weighted, axis=0)
    inverse = np.linalg.pinv(weighted.T @ weighted)
    spread = inverse @ (weighted.T @ fit.correlation @ weighted) @ inverse
    return float(np.clip(inverse[position, position] / spread[position, position], 1e-3, 1.0))


def greatest_likelihood(
    shapes: FloatArray, variances: FloatArray, edf: FloatArray, fixed: FloatArray | None = None
) -> FloatArray:
    """Coefficients of greatest likelihood, by non-negative least squares with new weights each turn."""
    from scipy.optimize import nnls

    offset = np.zeros_like(variances) if fixed is None else fixed
    weight = np.sqrt(0.5 * edf)
    model = np.maximum(variances, offset)
    coefficients = np.zeros(shapes.shape[1])
    previous = np.inf
    for turn in range(_ITERATIONS):
        rows = weight / model
        scaled = shapes * rows[:, None]
        norms = np.linalg.norm(scaled, axis=0)
        target = (variances - offset) * rows
        proposed = nnls(scaled / norms, target)[0] / norms
        step = 1.0
        lost = deviance(variances, offset + shapes @ proposed, edf)
        while turn > 0 and lost > previous and step > 1e-3:
            step *= 0.5
            mixed = coefficients + step * (proposed - coefficients)
            lost = deviance(variances, offset + shapes @ mixed, edf)
        if turn > 0 and lost > previous:
            break
        coefficients = coefficients + step * (proposed - coefficients)
        model = offset + shapes @ coefficients
        if abs(previous - lost) <= _TOLERANCE * (1.0 + abs(lost)):
            break
        previous = lost
    return coefficients


def deviance(variances: FloatArray, model: FloatArray, edf: FloatArray) -> float:
    """Twice the log likelihood lost by `model` against the variances themselves."""
    if np.any(model <= 0):
        return float("inf")
    ratio = variances / model
    return float(edf @ (ratio - 1.0 - np.log(ratio)))
