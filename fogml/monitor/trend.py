"""The trend of a unit's figure over its age, where what differs between runs need not be white."""

from __future__ import annotations

from itertools import product

import numpy as np

from fogml.arrays import FloatArray
from fogml.monitor.evidence import ChangePrior, flicker_covariance
from fogml.signals.distributions import students_ppf

_RATIOS = np.concatenate(([0.0], 4.0 ** np.arange(-3.0, 4.0)))
"""Variance of flicker in a factor e of time, or of a walk from run to run, in that of the white part."""


def trend_quantiles(age: FloatArray, values: FloatArray, probabilities: tuple[float, ...]) -> list[float]:
    """Quantiles of the slope of a line through the values, in their unit per unit of age.

    White noise, flicker and a random walk between the runs are averaged over by restricted likelihood, either
    of the latter being as likely there as not. A few runs hardly tell a trend from a walk, and the interval
    says so.

    Parameters
    ----------
    age
        Age at each run, not all the same, shape (n,), n over 2.
    values
        The figure, shape (n,).
    probabilities
        Of the quantiles.
    """
    n = len(age)
    t = (age - age[0]) * ((n - 1) / float(np.ptp(age)))
    flicker = flicker_covariance(t, ChangePrior().longest_wander)
    walk = np.minimum(t[:, None], t)
    table = np.column_stack((np.ones(n), age - age.mean(), values - values.mean()))
    logs, slopes, scales = [], [], []
    for q, r in product(_RATIOS, _RATIOS):
        root = np.linalg.cholesky(np.eye(n) + q * flicker + r * walk)
        white = np.linalg.solve(root, table)
        basis, upper = np.linalg.qr(white[:, :2])
        along = basis.T @ white[:, 2]
        left = white[:, 2] - basis @ along
        variance = max(float(left @ left) / (n - 2), 1e-300)
        dets = np.log(np.abs(np.diag(root))).sum() + np.log(np.abs(np.diag(upper))).sum()
        prior = -np.log(len(_RATIOS) - 1) * np.count_nonzero((q, r))
        logs.append(float(prior - dets - 0.5 * (n - 2) * np.log(variance)))
        slopes.append(float(along[1] / upper[1, 1]))
        scales.append(float(np.sqrt(variance) / abs(upper[1, 1])))
    weights = np.exp(np.array(logs) - max(logs))
    weights /= weights.sum()
    centres, widths = np.array(slopes), np.array(scales)
    return [students_ppf(probability, weights, centres, widths, n - 2) for probability in probabilities]
