"""Allan deviation of evenly sampled data, over one stretch or several."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray, IntArray
from fogml.errors import InputError
from fogml.intervals import LEVEL
from fogml.signals import large
from fogml.signals.allan_confidence import degrees_of_freedom, noise_exponents, variance_interval

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

    Returns
    -------
    AllanResult

    Raises
    ------
    InputError
        If the sample interval, the level or a time is not positive, values are not finite, or
        no time has two second differences.
    """
    values = np.ascontiguousarray(x, dtype=np.float64)
    if values.ndim != 1:
        raise InputError(f"Allan deviation: one series was expected, found an array of shape {values.shape}")
    if not (np.isfinite(sample_s) and sample_s > 0):
        raise InputError(f"Allan deviation: a sample interval of {sample_s} s; it must be positive")
    if not 0 < level < 1:
        raise InputError(f"Allan deviation: a level of {level}; it must lie between 0 and 1")
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
