"""The noise terms of IEEE Std 952 from an Allan deviation: Q, N, B, K, R, with intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.errors import InputError
from fogml.signals.allan import AllanResult
from fogml.signals.allan_fit import fit_variances, interval

FloatArray = NDArray[np.float64]
TermName = Literal["Q", "N", "B", "K", "R"]

TERM_NAMES: tuple[TermName, ...] = ("Q", "N", "B", "K", "R")
"""Quantisation, angle random walk, bias instability, rate random walk, rate ramp."""
FLICKER_FLOOR = float(np.sqrt(2 * np.log(2) / np.pi))
"""Allan deviation of flicker noise over B: 0.664."""
_TRUSTED = 5.0
"""Degrees of freedom from which a point may be the minimum; below, low ones are chance."""

_UNITS: dict[TermName, str] = {
    "Q": "urad",
    "N": "deg/sqrt(h)",
    "B": "deg/h",
    "K": "deg/h/sqrt(h)",
    "R": "deg/h/h",
}
# From coefficients in deg/h and s to the units above: Q deg/h*s, N deg/h*sqrt(s), K deg/h/sqrt(s), R deg/h/s.
_SCALES: dict[TermName, float] = {
    "Q": np.pi / 180 / 3600 * 1e6,
    "N": 1 / 60,
    "B": 1.0,
    "K": 60.0,
    "R": 3600.0,
}


@dataclass(frozen=True)
class NoiseTerm:
    """One noise term.

    Attributes
    ----------
    value
        Coefficient in `unit`; None where the data show none of it, or no more than a bound.
    lower, upper
        Interval at the stated level; `lower` is 0 where the data do not support the term.
    unit
        Unit of the three.
    fitted
        The coefficient of the fitted curve, which for B lies below the minimum over 0.664
        where other terms take part in the minimum.
    """

    value: float | None
    lower: float
    upper: float
    unit: str
    fitted: float


@dataclass(frozen=True)
class NoiseTerms:
    """The noise terms of a gyro, and the curve that they make.

    Attributes
    ----------
    terms
        Q, N, B, K and R.
    minimum_adev, minimum_tau_s
        The lowest Allan deviation [deg/h] with at least 5 degrees of freedom, and its time.
    misfit
        Relative standard deviation of the Allan deviation about the fitted curve, beyond what
        its degrees of freedom explain: 0 where the five terms describe the data.
    level
        Coverage of the intervals.
    """

    terms: Mapping[TermName, NoiseTerm]
    minimum_adev: float
    minimum_tau_s: float
    misfit: float
    level: float

    def deviation(self, taus_s: ArrayLike) -> FloatArray:
        """Allan deviation of the fitted terms [deg/h] at times [s]."""
        shapes = _shapes(np.asarray(taus_s, dtype=np.float64))
        variances = np.array([(self.terms[name].fitted / _SCALES[name]) ** 2 for name in TERM_NAMES])
        return np.asarray(np.sqrt(shapes @ variances))


def noise_terms(allan: AllanResult, level: float = 0.9) -> NoiseTerms:
    """Noise terms from an overlapping Allan deviation of a rate in deg/h.

    The curve ``sigma^2 = 3 Q^2/tau^2 + N^2/tau + (2 ln 2/pi) B^2 + K^2 tau/3 + R^2 tau^2/2``
    (IEEE Std 952, annex C) with coefficients that are not negative, of greatest likelihood
    for chi-square variances with their degrees of freedom. Intervals are those of the profile
    likelihood, widened for the correlation between averaging times, which follows from the
    spectrum of the fitted terms; where the points scatter more than they should, the excess
    counts as error of every point.

    B is the minimum over 0.664, the value that data sheets give, and its interval covers
    both that and the flicker of the fitted curve. A term whose interval reaches 0 is not
    supported by the data; B has no value then if the curve has no minimum within its times.

    Parameters
    ----------
    allan
        Overlapping Allan deviation of values in deg/h.
    level
        Coverage of the intervals.

    Returns
    -------
    NoiseTerms

    Raises
    ------
    InputError
        If windows do not overlap.
    """
    if not allan.overlapping:
        raise InputError("noise terms are read from overlapping windows: take overlapping=True")
    seen = allan.adev > 0
    trusted = seen & (allan.edf >= _TRUSTED) if np.any(seen & (allan.edf >= _TRUSTED)) else seen
    if not np.any(seen):
        nothing = {name: NoiseTerm(None, 0.0, 0.0, _UNITS[name], 0.0) for name in TERM_NAMES}
        return NoiseTerms(nothing, 0.0, float(allan.taus_s[-1]), 0.0, level)
    lowest = np.flatnonzero(trusted)[np.argmin(allan.adev[trusted])]
    taus, variances = allan.taus_s[seen], allan.adev[seen] ** 2
    sample_s = float(allan.taus_s[0] / allan.factors[0])
    fit = fit_variances(
        _shapes(taus),
        variances,
        allan.edf[seen],
        lambda coefficients: _correlation(coefficients, allan.factors[seen], sample_s),
    )
    terms: dict[TermName, NoiseTerm] = {}
    for column, name in enumerate(TERM_NAMES):
        low, high = interval(fit, column, level)
        fitted, lower, upper = (
            _SCALES[name] * float(np.sqrt(v)) for v in (fit.coefficients[column], low, high)
        )
        terms[name] = NoiseTerm(fitted if fitted > 0 else None, lower, upper, _UNITS[name], fitted)
    falling = lowest == np.flatnonzero(trusted)[-1]
    terms["B"] = _bias_instability(terms["B"], allan, int(lowest), still_falling=bool(falling))
    return NoiseTerms(
        terms, float(allan.adev[lowest]), float(allan.taus_s[lowest]), 0.5 * float(np.sqrt(fit.excess)), level
    )


def _bias_instability(
    flicker: NoiseTerm, allan: AllanResult, lowest: int, *, still_falling: bool
) -> NoiseTerm:
    supported = flicker.lower > 0
    at_minimum = float(allan.adev[lowest]) / FLICKER_FLOOR
    if not supported and (still_falling or flicker.fitted == 0):
        return NoiseTerm(None, 0.0, flicker.upper, flicker.unit, flicker.fitted)
    lower = min(flicker.lower, float(allan.lower[lowest]) / FLICKER_FLOOR)
    upper = max(flicker.upper, float(allan.upper[lowest]) / FLICKER_FLOOR)
    return NoiseTerm(at_minimum, lower, upper, flicker.unit, flicker.fitted)


def _shapes(taus: FloatArray) -> FloatArray:
    """Allan variance of each term of coefficient 1, shape (k, 5)."""
    one = np.ones_like(taus)
    return np.column_stack((3 / taus**2, 1 / taus, FLICKER_FLOOR**2 * one, taus / 3, taus**2 / 2))


def _correlation(coefficients: FloatArray, factors: NDArray[np.int64], sample_s: float) -> FloatArray:
    """Correlation of overlapping Allan variances of one run at several averaging factors.

    The covariance is the integral of ``S^2 H_i H_j``, S the spectral density of the terms and
    ``H = 2 sin^4(pi m f) / (m sin(pi f))^2`` the response of the Allan variance, for a run
    much longer than the averaging times. A ramp is no noise and has no spectrum.
    """
    lowest = 1 / (50.0 * float(factors.max()))
    points = int(200 * np.log10(0.5 / lowest)) + 1
    frequency = np.geomspace(lowest, 0.5, points)  # cycles per sample
    quantisation, white, flicker, walk = coefficients[:4]
    hertz = frequency / sample_s
    sine = np.sin(np.pi * frequency)
    density = (
        8 * quantisation / sample_s * sine**2
        + 2 * white
        + flicker / (np.pi * hertz)
        + walk / (2 * np.pi**2 * hertz**2)
    )
    response = 2 * np.sin(np.pi * np.outer(frequency, factors)) ** 4 / (factors * sine[:, None]) ** 2
    weighted = response * density[:, None]
    # A logarithmic grid: df = f d(ln f).
    covariance = weighted.T @ (weighted * frequency[:, None])
    spread = np.sqrt(np.diag(covariance))
    if not np.all(spread > 0):
        return np.eye(len(factors))
    return np.asarray(covariance / np.outer(spread, spread))
