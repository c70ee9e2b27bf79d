"""Allan deviation of evenly sampled data, over one stretch or several, and how far it can be trusted.

Sources: W. J. Riley, *Handbook of Frequency Stability Analysis*, NIST SP 1065 (2008), 5.2-5.5; C. A.
Greenhall and W. J. Riley, "Uncertainty of stability variances based on finite differences", 35th PTTI (2003);
both, "Power law noise identification using the lag 1 autocorrelation", 18th EFTF (2004).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray, IntArray, unmasked
from fogml.errors import InputError
from fogml.intervals import LEVEL, check_level
from fogml.signals import large
from fogml.signals.clock import check_interval
from fogml.signals.distributions import chi2_ppf

Segments = Iterable[slice | tuple[int, int]]


@dataclass(frozen=True)
class AllanResult:
    """An Allan deviation with its intervals; every array has shape (k,).

    Attributes
    ----------
    taus_s
        Averaging times [s], rising.
    adev
        Allan deviation, in the unit of the data.
    lower, upper
        Interval of the deviation at `level`, chi-square with `edf` degrees of freedom.
    n
        Second differences averaged at each time.
    factors
        Averaging times in samples.
    edf
        Equivalent degrees of freedom.
    exponent
        Power law of the noise that the degrees of freedom stand on: 2 quantisation, 0 white,
        -1 flicker, -2 random walk.
    level
        Coverage of the intervals.
    overlapping
        Whether windows overlap.
    """

    taus_s: FloatArray
    adev: FloatArray
    lower: FloatArray
    upper: FloatArray
    n: IntArray
    factors: IntArray
    edf: FloatArray
    exponent: IntArray
    level: float
    overlapping: bool


def allan_deviation(
    x: ArrayLike,
    sample_s: float,
    taus: ArrayLike | Literal["octave"] | None = None,
    overlapping: bool = True,
    *,
    segments: Segments | None = None,
    level: float = LEVEL,
) -> AllanResult:
    """Allan deviation of a rate.

    ``sigma^2(tau) = 1 / (2 tau^2 n) * sum (theta[i + 2m] - 2 theta[i + m] + theta[i])^2`` with
    theta the running integral of x and tau = m samples; i runs over every sample, or over
    every m-th where windows do not overlap (NIST SP 1065, equations 7 and 11). Segments are
    never joined: the sums and the counts of all are added, then divided.

    Parameters
    ----------
    x
        Evenly sampled values, shape (n,), in any unit.
    sample_s
        Sample interval [s].
    taus
        Averaging times [s], brought to whole samples, in any order; or ``"octave"``, the
        default: 1, 2, 4, ... samples. Times with fewer than two second differences are left
        out.
    overlapping
        Whether windows overlap.
    segments
        Parts of x between gaps, as slices or (start, stop); by default all of x is one.
    level
        Coverage of the intervals.

    Raises
    ------
    InputError
        If the sample interval, the level or a time is not positive, values are not finite, or
        no time has two second differences.
    """
    values = np.ascontiguousarray(unmasked(x), dtype=np.float64)
    if values.ndim != 1:
        raise InputError(f"Allan deviation: one series was expected, found an array of shape {values.shape}")
    check_interval(sample_s, "Allan deviation")
    check_level(level, "Allan deviation")
    starts, stops = segment_bounds(len(values), segments)
    lengths = stops - starts
    factors = _factors(taus, sample_s, lengths, overlapping)
    if len(factors) == 0:
        longest = int(lengths.max(initial=0))
        raise InputError(
            f"Allan deviation: no averaging time fits twice; the longest stretch has {longest} samples "
            f"of {sample_s:g} s, at least 3 are needed"
        )

    from fogml.signals import allan_kernel as kernel

    # Values that are not finite are told below, by what they make of the sums.
    with np.errstate(invalid="ignore", over="ignore"):
        phases, edges = kernel.phase(values, starts, stops)
    large.release()
    squares = kernel.second_difference_squares if overlapping else kernel.stepped_second_difference_squares
    sums, counts = squares(phases, edges, factors)
    if not np.all(np.isfinite(sums)):
        raise InputError("Allan deviation: values that are not finite; leave them out first")
    # In floating point: 2 m^2 n passes the largest integer at 1e7 samples.
    adev = np.sqrt(sums / (2.0 * counts)) / factors
    from_one = np.union1d([1], factors)
    averages = (lengths[None, :] // from_one[:, None]).sum(axis=1)
    exponent = noise_exponents(kernel.lag_sums(phases, edges, from_one), averages)
    large.release()
    exponent = exponent[np.searchsorted(from_one, factors)]
    edf = np.array(
        [
            degrees_of_freedom(int(kind), int(m), lengths + 1, overlapping=overlapping)
            for kind, m in zip(exponent, factors)
        ]
    )
    low, high = variance_interval(edf, level)
    return AllanResult(
        taus_s=np.asarray(factors * float(sample_s)),
        adev=adev,
        lower=adev * np.sqrt(low),
        upper=adev * np.sqrt(high),
        n=counts,
        factors=factors,
        edf=edf,
        exponent=exponent,
        level=level,
        overlapping=overlapping,
    )


def segment_bounds(samples: int, segments: Segments | None) -> tuple[IntArray, IntArray]:
    """First and past-the-last samples of segments of a series; all of it where None."""
    if segments is None:
        return np.array([0], dtype=np.int64), np.array([samples], dtype=np.int64)
    pairs = [s.indices(samples)[:2] if isinstance(s, slice) else s for s in segments]
    bounds = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    if len(bounds) and (bounds.min() < 0 or bounds.max() > samples or np.any(bounds[:, 1] < bounds[:, 0])):
        raise InputError(f"segments reach beyond the {samples} samples of the series")
    return np.ascontiguousarray(bounds[:, 0]), np.ascontiguousarray(bounds[:, 1])


def _factors(taus: ArrayLike | str | None, sample_s: float, lengths: IntArray, overlapping: bool) -> IntArray:
    longest = int(lengths.max(initial=0))
    if taus is None or isinstance(taus, str):
        if taus not in (None, "octave"):
            raise InputError(f"Allan deviation: taus {taus!r}; give times in seconds, or 'octave'")
        factors = 2 ** np.arange(max(longest, 1).bit_length(), dtype=np.int64)
    else:
        times = np.atleast_1d(np.asarray(taus, dtype=np.float64))
        if not np.all(np.isfinite(times) & (times > 0)):
            raise InputError("Allan deviation: averaging times must be positive, in seconds")
        # Beyond the longest stretch there is nothing, and huge times would overflow.
        samples = np.minimum(np.round(times / sample_s), longest + 1)
        factors = np.unique(samples[samples >= 1].astype(np.int64))
    terms = np.maximum(lengths[None, :] + 1 - 2 * factors[:, None], 0)
    if not overlapping:
        terms = -(-terms // factors[:, None])
    return np.asarray(factors[terms.sum(axis=1) >= 2])


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
    tail = 0.5 * (1.0 - level)
    return np.asarray(edf / chi2_ppf(1.0 - tail, edf)), np.asarray(edf / chi2_ppf(tail, edf))
