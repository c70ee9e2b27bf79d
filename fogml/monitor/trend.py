"""The trend of a unit's figure over its age, where what differs between runs need not be white."""

from __future__ import annotations

from itertools import product

import numpy as np

from fogml.arrays import FloatArray
from fogml.monitor.evidence import ChangePrior, flicker_covariance
from fogml.signals.distributions import students_ppf
from fogml.signals.restricted import absent_or_not, weighed_models

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
    t = (age - age[0]) * ((len(age) - 1) / float(np.ptp(age)))
    ratios = np.array(list(product(_RATIOS, repeat=2)))
    parts = np.stack((flicker_covariance(t, ChangePrior().longest_wander), np.minimum(t[:, None], t)))
    models = weighed_models(
        np.eye(len(age)) + np.tensordot(ratios, parts, 1),
        np.column_stack((np.ones(len(age)), age - age.mean())),
        values - values.mean(),
        absent_or_not(ratios),
    )
    found = students_ppf(probabilities, models.weights, models.constants, models.scales, models.freedom)
    return [float(value) for value in found]
