"""How far an estimated Allan deviation can be trusted: kind of noise, degrees of freedom, intervals.

Sources: W. J. Riley, *Handbook of Frequency Stability Analysis*, NIST SP 1065 (2008), sections
5.2-5.5; C. A. Greenhall and W. J. Riley, "Uncertainty of stability variances based on finite
differences", 35th PTTI (2003); W. J. Riley and C. A. Greenhall, "Power law noise
identification using the lag 1 autocorrelation", 18th EFTF (2004).
"""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray, IntArray

QUANTISATION, WHITE, FLICKER, RANDOM_WALK = 2, 0, -1, -2
"""Exponents of the rate's power spectral density: quantisation of the angle, white (angle
random walk), flicker (bias instability), rate random walk."""
_ENOUGH = 30
"""Averages needed to tell the kind of noise (SP 1065, section 5.5.6)."""
_OVERLAP = 32
"""Overlaps of a window beyond which more add nothing to the degrees of freedom."""


def noise_exponents(lag_sums: FloatArray, averages: IntArray) -> IntArray:
    """Exponent of the dominant power law at each averaging factor.

    From the lag-1 autocorrelation r of the averages, differenced once if
    ``r / (1 + r) >= 1/4``; the exponent is ``-2 (r / (1 + r) + differences)``, rounded to one
    of quantisation 2, white 0, flicker -1, random walk -2. Flicker of the angle (1), which is
    no term of gyro noise, counts as white and so gets the fewer degrees of freedom. So does
    quantisation at a factor above one where another noise prevails, as its share can only
    fall. Factors with under 30 averages take the exponent of the factor before them.

    Parameters
    ----------
    lag_sums
        Sums of squares and of neighbours' products of the averages, then of their first
        differences, at rising factors from 1, shape (k, 4).
    averages
        Averages behind each row, shape (k,).

    Returns
    -------
    exponents
        Shape (k,).
    """
    exponents = np.zeros(len(lag_sums), dtype=np.int64)
    if len(averages) == 0 or averages[0] < _ENOUGH:
        return exponents
    last = QUANTISATION
    for row, (squares, products, step_squares, step_products) in enumerate(lag_sums):
        if averages[row] >= _ENOUGH and squares > 0 and step_squares > 0:
            told = _exponent(products / squares, step_products / step_squares)
            last = WHITE if told == QUANTISATION and last != QUANTISATION else told
        exponents[row] = last
    return exponents


def _exponent(correlation: float, step_correlation: float) -> int:
    share = correlation / (1.0 + max(correlation, -0.9))
    differences = 0
    if share >= 0.25:
        share = step_correlation / (1.0 + max(step_correlation, -0.9))
        differences = 1
    exponent = int(np.clip(np.round(-2.0 * (share + differences)), RANDOM_WALK, QUANTISATION))
    return WHITE if exponent == 1 else exponent


def degrees_of_freedom(exponent: int, factor: int, phases: IntArray, *, overlapping: bool) -> float:
    """Equivalent degrees of freedom of an Allan variance from several segments.

    ``1 / edf`` of a segment is the mean square correlation of its second differences, as in
    Greenhall and Riley (2003) with d = 2; segments count as independent and are weighted by
    the number of their second differences.

    Parameters
    ----------
    exponent
        Power law of the noise: 2, 0, -1 or -2.
    factor
        Averaging factor m.
    phases
        Phases in each segment, one more than its samples.
    overlapping
        Whether second differences are taken at every sample or at every m-th.

    Returns
    -------
    edf
        At least 1; 0 where no segment is long enough.
    """
    terms = np.maximum(np.asarray(phases, dtype=np.float64) - 2 * factor, 0.0)
    terms = terms[terms > 0]
    if len(terms) == 0:
        return 0.0
    if overlapping:
        per_window = float(factor if exponent == QUANTISATION else min(factor, _OVERLAP))
        effective = np.maximum(terms * per_window / factor, 1.0)
        weights = terms
    else:
        per_window = 1.0
        effective = np.ceil(terms / factor)
        weights = effective
    if exponent == QUANTISATION:
        # White angle noise: second differences correlate at one and two windows only.
        correlated = (4 / 9) * np.maximum(1 - per_window / effective, 0)
        correlated += (1 / 36) * np.maximum(1 - 2 * per_window / effective, 0)
    else:
        lags = np.arange(1, 3 * int(per_window))
        squares = _correlation(lags / per_window, exponent) ** 2
        sums = np.concatenate(([0.0], np.cumsum(squares)))
        lagged = np.concatenate(([0.0], np.cumsum(squares * lags)))
        reach = np.minimum(np.floor(effective).astype(np.int64) - 1, len(lags)).clip(min=0)
        correlated = sums[reach] - lagged[reach] / effective
    each = np.maximum(effective / (1.0 + 2.0 * correlated), 1.0)
    shares = weights / weights.sum()
    return float(1.0 / np.sum(shares**2 / each))


def _correlation(windows: FloatArray, exponent: int) -> FloatArray:
    """Correlation of second differences of the angle, `windows` averaging times apart.

    The angle is the integral of a rate, sampled: the limit of a narrow sampling filter in
    Greenhall and Riley (2003).
    """
    generalised = {WHITE: _linear, FLICKER: _square_logarithm, RANDOM_WALK: _cubic}[exponent]

    def differenced(lag: FloatArray) -> FloatArray:
        near = generalised(np.abs(lag - 1)) + generalised(np.abs(lag + 1))
        far = generalised(np.abs(lag - 2)) + generalised(np.abs(lag + 2))
        return np.asarray(6 * generalised(np.abs(lag)) - 4 * near + far)

    return np.asarray(differenced(windows) / differenced(np.zeros(1)))


# Generalised autocovariances of the angle, but for a factor.
def _linear(lag: FloatArray) -> FloatArray:
    return lag


def _square_logarithm(lag: FloatArray) -> FloatArray:
    return np.asarray(lag**2 * np.log(np.where(lag > 0, lag, 1.0)))


def _cubic(lag: FloatArray) -> FloatArray:
    return np.asarray(lag**3)


def variance_interval(edf: FloatArray, level: float) -> tuple[FloatArray, FloatArray]:
    """Factors on an estimated variance for its interval at `level` (SP 1065, equation 45).

    ``edf / chi2(1/2 + level/2)`` and ``edf / chi2(1/2 - level/2)``, shape of `edf`.
    """
    from scipy.special import gammaincinv

    tail = 0.5 * (1.0 - level)
    low = edf / (2.0 * gammaincinv(edf / 2.0, 1.0 - tail))
    high = edf / (2.0 * gammaincinv(edf / 2.0, tail))
    return np.asarray(low), np.asarray(high)
