"""How well constants of a line are known whose values scatter by two parts of unknown size, and a bend."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.intervals import LEVEL
from fogml.lab.rate_pieces import Plateaus, merged
from fogml.models.linear import LinearRegressor
from fogml.models.row_noise import MEANS_A_STAY, noise_covariance
from fogml.models.table import RunRows
from fogml.runs.run import Run
from fogml.signals.averages import window_means
from fogml.signals.distributions import normal_ppf, student_ppf, students_ppf
from fogml.signals.restricted import absent_or_not, weighed_models
from fogml.validation.scale_factor import LEAST_LEVELS

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
    freedom: float = 0.0,
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


def nonlinearity_within(run: Run, plateaus: Plateaus, scale_factor: float) -> tuple[float, float] | None:
    """90 % interval of the greatest deviation from the line over the greatest output [ppm].

    It begins at 0 where noise alone may make as much. The noise is that of the outputs beside a level for
    each rate, white, flicker and random walk, weighed by what they speak for, and that of a measured rate. An
    error of the table's that comes with a rate each time is in the interval as the gyro's own would be.

    Returns
    -------
    tuple of float or None
        None for fewer than four rates, or where the outputs hold too little noise to tell it.
    """
    if len(plateaus.rate) < LEAST_LEVELS:
        return None
    rates, level = np.unique(merged(plateaus.rate, plateaus.rate_error), return_inverse=True)
    if len(rates) < LEAST_LEVELS:
        return None
    time, output, of = _means(run, plateaus)
    columns = (level[of][:, None] == np.arange(1, len(rates))).astype(np.float64)
    if (np.bincount(level) > 1).any():
        # Rates that come again tell a steady drift.
        columns = np.column_stack([columns, (time - time.mean()) / max(np.ptp(time), 1.0)])
    left = output - scale_factor * rates[level[of]]
    fitted = LinearRegressor().fit(columns, left)
    covariance = noise_covariance([RunRows(columns, left, time)], lambda every: every, fitted, 0.0)
    if covariance is None:
        return None
    shown = slice(1, len(rates))
    line = np.column_stack([np.ones(len(rates)), rates])
    off_line = np.eye(len(rates)) - line @ np.linalg.pinv(line)
    # A rate that was measured is known as well as its plateaus' means tell it.
    of_rates = np.bincount(level, (scale_factor * plateaus.rate_error) ** 2) / np.bincount(level) ** 2
    variances = np.diag(off_line[:, shown] @ covariance[shown, shown] @ off_line[:, shown].T)
    errors = np.sqrt(np.maximum(variances, 0.0) + off_line**2 @ of_rates)
    low, high = greatest_within(off_line[:, shown] @ fitted.coef_[: len(rates) - 1], errors)
    ppm = 1e6 / (abs(scale_factor) * float(np.abs(rates).max()))
    return ppm * low, ppm * high


def greatest_within(values: FloatArray, errors: FloatArray) -> tuple[float, float]:
    """90 % interval of the greatest true size among values with normal errors, alike or not, shape (m,).

    All true values lie within their bands at once with that probability (Z. Sidak, J. Am. Stat. Assoc. 62
    (1967) 626), so the greatest lies between the greatest of the bands' lower ends and that of their upper.
    """
    half = errors * float(normal_ppf(0.5 * (1.0 + LEVEL ** (1.0 / len(values)))))
    size = np.abs(values)
    return max(float((size - half).max()), 0.0), float((size + half).max())


def _means(run: Run, plateaus: Plateaus) -> tuple[FloatArray, FloatArray, IndexArray]:
    """Times [s] and outputs [deg/h] of means over equal parts of plateaus, and whose each is."""
    rows = max(int(np.median(plateaus.stop - plateaus.start)) // MEANS_A_STAY, 1)
    starts = [np.arange(a, b - rows + 1, rows) for a, b in zip(plateaus.start, plateaus.stop, strict=True)]
    of = np.repeat(np.arange(len(plateaus)), [len(part) for part in starts])
    first = np.concatenate(starts)
    time, output = (window_means(values, first, first + rows) for values in (run.time, run.gyro_deg_h))
    return time, output, of
