"""The trend of a figure over the runs of a unit that may wander between them."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np

from fogml.arrays import FloatArray
from fogml.intervals import LEVEL, TAILS
from fogml.monitor.evidence import ChangePrior, flicker_covariance
from fogml.signals.distributions import student_ppf, students_ppf
from fogml.signals.restricted import absent_or_not, weighed_models

_RATIOS = np.concatenate(([0.0], 8.0 ** np.arange(-3.0, 4.0)))
"""Variance of flicker in a factor e of time, or of a walk from run to run, in that of the white part."""


def trend_interval(
    age: FloatArray, values: FloatArray, *, wanders: bool = True
) -> tuple[float, tuple[float, float]]:
    """Slope of a line through the values, in their unit per unit of age, and its interval at `LEVEL`.

    Between the runs there may be flicker and a random walk beside white noise, of any size. A few runs hardly
    tell a trend from a walk, and an average over what they may be would hold too seldom where they do walk.
    So the interval is that of the profile likelihood, restricted as the line's constants are unknown: every
    slope that some noise makes likely enough. How likely that is, is told by the noise that makes a true
    slope the least likely, a walk alone, by lines drawn over it; under noise that is known it is Student's t.

    Parameters
    ----------
    age
        Age at each run, not all the same, shape (n,), n over 2.
    values
        The figure, shape (n,).
    wanders
        Whether it may wander between the runs; without, noise between them is white.

    Returns
    -------
    slope, ci90
        Median over the noises by their likelihoods, either part being as likely there as not; and the
        interval.
    """
    n = len(age)
    t = (age - age[0]) * ((n - 1) / float(np.ptp(age)))
    ratios, covariances = _noises(t, wanders)
    before = absent_or_not(ratios)
    line = np.column_stack((np.ones(n), age - age.mean()))
    models = weighed_models(covariances, line, values - values.mean(), before)
    slopes, scales, freedom = models.constants, models.scales, models.freedom
    median = float(students_ppf(0.5, models.weights, slopes, scales, freedom))
    with np.errstate(divide="ignore"):
        likelihood = np.log(models.weights) - before
    # Student's t at its own quantile is so much less likely than in its middle.
    allowed = 0.5 * (freedom + 1.0) * np.log1p(student_ppf(TAILS[1], freedom) ** 2 / freedom)
    if wanders:
        allowed = max(allowed, _of_a_walk(tuple(t.tolist())))
    left = likelihood - likelihood.max() + allowed
    reach = np.sqrt(freedom * np.expm1(2.0 * np.maximum(left, 0.0) / (freedom + 1.0))) * scales
    low, high = (
        float(end) for end in ((slopes - reach)[left >= 0.0].min(), (slopes + reach)[left >= 0.0].max())
    )
    return median, (low, high)


def _noises(t: FloatArray, wanders: bool) -> tuple[FloatArray, FloatArray]:
    """Variances of flicker and walk in that of the white part, shape (m, 2), and covariances (m, n, n)."""
    ratios = np.array(list(product(_RATIOS if wanders else _RATIOS[:1], repeat=2)))
    parts = np.stack((flicker_covariance(t, ChangePrior().longest_wander), np.minimum(t[:, None], t)))
    return ratios, np.eye(len(t)) + np.tensordot(ratios, parts, 1)


@lru_cache(maxsize=64)
def _of_a_walk(ages: tuple[float, ...], values: int = 200_000) -> float:
    """What the likelihood of the true slope of a walk alone lacks to the greatest at most, with `LEVEL`.

    By drawn walks of so many `values` in all, 100 to 2000 of them: these tell that level to 0.7 %.
    """
    t = np.array(ages)
    draws = max(100, min(2000, values // len(t)))
    line = np.column_stack((np.ones(len(t)), t - t.mean()))
    free = len(t) - 2
    rng = np.random.default_rng(0)
    steps = np.sqrt(np.diff(t, prepend=t[0]))[:, None] * rng.standard_normal((len(t), draws))
    walks = np.cumsum(steps, axis=0)
    greatest, of_truth = np.full((2, draws), -np.inf)
    for covariance in _noises(t, True)[1]:
        root = np.linalg.cholesky(covariance)
        white = np.linalg.solve(root, np.column_stack((line, walks)))
        basis, upper = np.linalg.qr(white[:, :2])
        along = basis.T @ white[:, 2:]
        square = np.sum(white[:, 2:] ** 2, axis=0) - np.sum(along**2, axis=0)
        volume = np.log(np.diagonal(root)).sum() + np.log(np.abs(np.diagonal(upper))).sum()
        likelihood = -volume - 0.5 * free * np.log(square / free)
        greatest = np.maximum(greatest, likelihood)
        less = 0.5 * (free + 1.0) * np.log1p(along[1] ** 2 / square)
        of_truth = np.maximum(of_truth, likelihood - less)
    return float(np.quantile(greatest - of_truth, LEVEL))
