"""How well constants of a line are known whose values scatter by two parts of unknown size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.intervals import LEVEL
from fogml.signals.distributions import student_ppf, students_ppf
from fogml.signals.restricted import absent_or_not, weighed_models

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
        Independent columns that explain the values, shape (n, k).
    values
        Values, shape (n,).
    parts
        Variances of the values by each part, in units of s**2, each of shape (n,).
    squares, freedom
        Squares over s**2 that others than these values leave, and their degrees of freedom.
    least
        Least variance s**2.
    """
    if len(values) + freedom <= matrix.shape[1]:
        return None
    covariances = parts[0] + _RATIOS[:, None] ** 2 * parts[1]
    models = weighed_models(
        covariances,
        matrix,
        values,
        absent_or_not(_RATIOS[:, None]),
        squares=squares,
        freedom=freedom,
        least=least,
    )
    sizes = np.sqrt(models.variances * (covariances @ gain**2))
    largest = float(sizes.max())
    if not largest > 0.0:
        return Spread(0.0, 0.0)
    # Of a ratio without scatter nothing is off: a scale of 0 has no quantile.
    scales = np.maximum(sizes, 1e-12 * largest)
    middle = np.zeros(len(sizes))
    places = 0.5 * (1.0 + np.array([ONE_SIGMA, LEVEL]))
    inner, outer = students_ppf(places, models.weights, middle, scales, models.freedom).tolist()
    return Spread(inner / float(student_ppf(0.5 * (1.0 + ONE_SIGMA), models.freedom)), outer)
