"""How well constants of a line are known whose values scatter by two parts of unknown size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.distributions import student_ppf, students_ppf

LEVEL = 0.9
ONE_SIGMA = 0.682689492137
"""What a standard error on either side of a normal value holds."""
_RATIOS = np.concatenate(([0.0], 2.0 ** np.arange(-2.0, 13.0)))
"""What the second part's deviation may be of the first's: nothing, or as likely in any octave."""


@dataclass(frozen=True)
class Spread:
    """Standard error, and half-width of the 90 % interval, in the values' unit.

    The standard error is that of one ratio whose interval of 68.3 % is as wide as that over all of them: a
    root mean square would be that of the few large ratios that are hardly likely.
    """

    se: float
    half_width: float


def spread_of(
    gain: FloatArray,
    matrix: FloatArray,
    values: FloatArray,
    parts: tuple[FloatArray, FloatArray],
    *,
    squares: float = 0.0,
    freedom: int = 0,
    least: float = 0.0,
) -> Spread | None:
    """Spread of ``gain @ values`` whose variances are ``s**2 (parts[0] + u**2 parts[1])``, s and u unknown.

    Ratios u are averaged over by their restricted likelihood, the first being as likely as all others; given
    one, the constant is off as Student's t. None where nothing is left over.

    Parameters
    ----------
    gain
        What the values are multiplied with, shape (n,).
    matrix
        Columns that explain the values, shape (n, k).
    values
        Values, shape (n,).
    parts
        Variances of the values by each part, in units of s**2, each of shape (n,).
    squares, freedom
        Squares over s**2 that others than these values leave, and their degrees of freedom.
    least
        Least variance s**2.
    """
    free = len(values) - np.linalg.matrix_rank(matrix) + freedom
    if free < 1:
        return None
    logs, sizes = np.empty(len(_RATIOS)), np.empty(len(_RATIOS))
    for place, ratio in enumerate(_RATIOS):
        variance = parts[0] + ratio**2 * parts[1]
        q, r = np.linalg.qr(matrix / np.sqrt(variance)[:, None])
        white = values / np.sqrt(variance)
        left = white - q @ (q.T @ white)
        s2 = max((float(left @ left) + squares) / free, least, 1e-300)
        logs[place] = -0.5 * (np.log(variance).sum() + free * np.log(s2))
        logs[place] -= float(np.log(np.abs(np.diag(r))).sum())
        sizes[place] = np.sqrt(s2 * (variance @ gain**2))
    logs[1:] -= np.log(len(_RATIOS) - 1)
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    largest = float(sizes.max())
    if not largest > 0.0:
        return Spread(0.0, 0.0)
    # Of a ratio without scatter nothing is off: a scale of 0 has no quantile.
    scales = np.maximum(sizes, 1e-12 * largest)
    middle = np.zeros(len(sizes))
    inner, outer = (
        students_ppf(0.5 * (1.0 + level), weights, middle, scales, free) for level in (ONE_SIGMA, LEVEL)
    )
    return Spread(inner / float(student_ppf(0.5 * (1.0 + ONE_SIGMA), free)), outer)
