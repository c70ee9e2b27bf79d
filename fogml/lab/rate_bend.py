"""How well a rate ladder tells nonlinearity: the interval that is left when the gyro's noise is taken off."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.intervals import LEVEL
from fogml.lab.rate_pieces import Plateaus, merged
from fogml.models.linear import LinearRegressor
from fogml.models.row_noise import MEANS_A_STAY, noise_covariance
from fogml.models.table import RunRows
from fogml.runs.run import Run
from fogml.signals.averages import window_means
from fogml.signals.distributions import normal_ppf
from fogml.validation.rate_ladder import LEAST_LEVELS


def nonlinearity_within(run: Run, plateaus: Plateaus, scale_factor: float) -> tuple[float, float] | None:
    """90 % interval of the greatest deviation from the line over the greatest output [ppm].

    It begins at 0 where noise alone may make as much. The noise is that of the outputs beside a level for
    each rate, white, flicker and random walk, weighed by what they speak for. An error of the table's
    that comes with a rate each time is in the interval as the gyro's own would be.

    Parameters
    ----------
    run
        That the plateaus are of.
    plateaus
        At rates that the output follows.
    scale_factor
        Of the line.

    Returns
    -------
    tuple of float or None
        None for fewer than four rates, or where the outputs hold too little noise to tell it.
    """
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
    off_line = (np.eye(len(rates)) - line @ np.linalg.pinv(line))[:, shown]
    errors = np.sqrt(np.maximum(np.diag(off_line @ covariance[shown, shown] @ off_line.T), 0.0))
    low, high = greatest_within(off_line @ fitted.coef_[: len(rates) - 1], errors)
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
