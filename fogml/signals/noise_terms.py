"""The noise terms of IEEE Std 952 from a spectrum: Q, N, B, K, R, with intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.intervals import LEVEL, check_level
from fogml.signals.allan import AllanResult, allan_deviation
from fogml.signals.clock import check_interval
from fogml.signals.noise_search import NoiseSearch, search_noise
from fogml.signals.noise_spectrum import Spectrum, spectrum_of
from fogml.signals.output_filters import AFTER, term_shapes
from fogml.signals.spectrum_fit import SpectrumFit
from fogml.signals.term_intervals import ramp, term_interval

TermName = Literal["Q", "N", "B", "K", "R"]

TERM_NAMES: tuple[TermName, ...] = ("Q", "N", "B", "K", "R")
"""Quantisation, angle random walk, bias instability, rate random walk, rate ramp."""
FLICKER_FLOOR = float(np.sqrt(2 * np.log(2) / np.pi))
"""Allan deviation of flicker noise over B: 0.664."""
_TRUSTED = 5.0
"""Degrees of freedom from which a point may be the minimum; below, low ones are chance."""
_BENT = 0.1
"""Share of an Allan variance that a filter may take away where the terms are said to hold."""

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
    """The noise terms of a gyro, and the model that they are of.

    Attributes
    ----------
    terms
        Q, N, B, K and R.
    minimum_adev, minimum_tau_s
        The lowest Allan deviation [deg/h] with at least 5 degrees of freedom, where the terms hold, and its
        time.
    misfit
        Relative standard deviation of the root of the density about the model's, beyond what chance
        explains: 0 where the model describes the data.
    fit_p_value
        Chance of a misfit as large under the model.
    level
        Coverage of the intervals.
    holds_from_s
        Averaging time from which the terms alone make the Allan deviation; below, an output filter bends it.
    search
        The models and their weights; None where there was no noise at all.
    """

    terms: Mapping[TermName, NoiseTerm]
    minimum_adev: float
    minimum_tau_s: float
    misfit: float
    fit_p_value: float
    level: float
    holds_from_s: float
    search: NoiseSearch | None

    def deviation(self, taus_s: ArrayLike, *, filtered: bool = True) -> FloatArray:
        """Allan deviation of the fitted model [deg/h] at times [s], behind its filter or without."""
        taus = np.atleast_1d(np.asarray(taus_s, dtype=np.float64))
        if self.search is None:
            return np.zeros_like(taus)
        slope = self.terms["R"].fitted / _SCALES["R"]
        variance = _allan_variance(self.search.best, self.search.spectrum, taus, filtered=filtered)
        return np.asarray(np.sqrt(variance + 0.5 * (slope * taus) ** 2))


def noise_terms(
    spectrum: Spectrum,
    allan: AllanResult,
    level: float = LEVEL,
    *,
    least_tau_s: float = 0.0,
    ramps: int | None = None,
    drifts: bool = False,
) -> NoiseTerms:
    """Noise terms from the spectrum of a rate in deg/h.

    The density of quantisation, white noise, flicker and random walk (IEEE Std 952, annex C) behind an
    output filter if the data show one, of greatest likelihood with coefficients that are not negative; the
    ramp is the constant of the spectrum's first columns, straight lines. Intervals are those of the profile
    likelihood, with models weighed by their evidence, as far as bounds of the other terms let them reach
    (`fogml.signals.term_intervals`); where rows scatter more than they should, the excess counts as error of
    every row.

    B is the minimum of the Allan deviation over 0.664, the value that data sheets give, and its interval
    covers both that and the flicker of the model. A term whose interval reaches 0 is not supported by
    the data; B has no value then if the curve has no minimum within its times. Where the values drift, the
    minimum is the drift's, and B the flicker of the model.

    Parameters
    ----------
    spectrum
        Of values in deg/h, with the lines that the ramp of each run makes [s] as columns, and behind them
        what else is kept out.
    allan
        Overlapping Allan deviation of the same values.
    level
        Coverage of the intervals.
    least_tau_s
        Averaging time below which the Allan deviation says nothing, as values are repeated [s].
    ramps
        Number of columns that are straight lines; all if None.
    drifts
        Whether the deviation holds drift that the spectrum keeps out.

    Raises
    ------
    InputError
        If windows do not overlap, or the level is no share.
    """
    check_level(level, "noise terms")
    if not allan.overlapping:
        raise InputError("noise terms are read from overlapping windows: take overlapping=True")
    if not np.any(spectrum.power > 0.0) or not np.any(allan.adev > 0.0):
        nothing = {name: NoiseTerm(None, 0.0, 0.0, _UNITS[name], 0.0) for name in TERM_NAMES}
        return NoiseTerms(nothing, 0.0, float(allan.taus_s[-1]), 0.0, 1.0, level, 0.0, None)
    search = search_noise(spectrum)
    terms: dict[TermName, NoiseTerm] = {}
    for name in TERM_NAMES[:-1]:
        low, high = term_interval(search, name, level)
        fitted, lower, upper = (_SCALES[name] * float(np.sqrt(v)) for v in (search.best[name], low, high))
        terms[name] = NoiseTerm(fitted if fitted > 0 else None, lower, upper, _UNITS[name], fitted)
    lines = spectrum.columns.shape[1] if ramps is None else ramps  # the search appends what sinusoids make
    terms["R"] = _ramp(search, terms["K"], level, lines)
    taus = allan.taus_s
    holds = _holds_from(search, taus)
    seen = (allan.adev > 0) & (taus >= max(holds, least_tau_s) * (1.0 - 1e-9))
    if not np.any(seen):
        seen = allan.adev > 0
    trusted = seen & (allan.edf >= _TRUSTED) if np.any(seen & (allan.edf >= _TRUSTED)) else seen
    lowest = np.flatnonzero(trusted)[np.argmin(allan.adev[trusted])]
    falling = lowest == np.flatnonzero(trusted)[-1]
    if not drifts:
        terms["B"] = _bias_instability(terms["B"], allan, int(lowest), still_falling=bool(falling))
    elif not terms["B"].lower > 0.0:
        terms["B"] = replace(terms["B"], value=None)
    return NoiseTerms(
        terms,
        float(allan.adev[lowest]),
        float(taus[lowest]),
        0.5 * float(np.sqrt(search.excess)),
        search.fit_p_value,
        level,
        holds,
        search,
    )


def noise_terms_of(values: FloatArray, sample_s: float, level: float = LEVEL) -> NoiseTerms:
    """As `noise_terms`, of evenly sampled values [deg/h] without gaps, shape (n,)."""
    series = np.asarray(values, dtype=np.float64)
    check_interval(sample_s, "noise terms")
    ramp = sample_s * np.arange(len(series), dtype=np.float64)[:, None]
    return noise_terms(spectrum_of([series], sample_s, [ramp]), allan_deviation(series, sample_s), level)


def _holds_from(search: NoiseSearch, taus: FloatArray) -> float:
    """Shortest of the times at which no filter bends the Allan deviation, and no row left out counts [s]."""
    spectrum, fit = search.spectrum, search.best
    plain = _allan_variance(fit, spectrum, taus, filtered=False)
    bent = np.flatnonzero(np.abs(_allan_variance(fit, spectrum, taus) - plain) > _BENT * plain)
    first = float(taus[min(bent[-1] + 1, len(taus) - 1)]) if len(bent) else spectrum.sample_s
    if fit.filter.kind == "none" and not np.all(fit.used):
        first = max(first, 1.0 / float(spectrum.frequency_hz[fit.used].max()))
    return first


def _ramp(search: NoiseSearch, walk: NoiseTerm, level: float, ramps: int) -> NoiseTerm:
    """The ramp, where it is told from none and from a random walk."""
    from scipy.special import ndtri

    off = float(ndtri(0.5 + 0.5 * level))
    found = ramp(search, walk.upper / _SCALES["K"], search.spectrum.removed, ramps, off)
    if found is None:
        return NoiseTerm(None, 0.0, 0.0, _UNITS["R"], 0.0)
    size, lower, upper = (_SCALES["R"] * value for value in found)
    return NoiseTerm(size if lower > 0.0 else None, lower, upper, _UNITS["R"], size if lower > 0.0 else 0.0)


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


def _allan_variance(
    fit: SpectrumFit, spectrum: Spectrum, taus: FloatArray, *, filtered: bool = True
) -> FloatArray:
    """Allan variance of a fitted model [(deg/h)^2]: its density through the response of the variance.

    The response of m samples is ``2 sin^4(pi m x) / (m sin(pi x))^2``, x in cycles per sample. Where a form
    that is not known leaves rows out of the fit, the density behind it is the measured one.
    """
    sample_s = spectrum.sample_s
    factors = np.maximum(taus / sample_s, 1.0)
    lowest = 1.0 / (100.0 * float(factors.max()))
    points = int(64 * np.log2(0.5 / lowest)) + 1
    cycles = np.geomspace(lowest, 0.5, points)
    shapes = term_shapes(cycles[:, None] / sample_s, sample_s, fit.terms)[:, 0]
    gain = fit.filter.response(cycles, fit.log_corner)[0]
    density = np.zeros(points)
    for coefficient, name, shape in zip(fit.coefficients, fit.terms.names, shapes.T):
        if name != "E":
            density += coefficient * shape * (gain if filtered and name not in AFTER else 1.0)
    if filtered and fit.filter.kind == "none" and not np.all(fit.used):
        middles = spectrum.frequency_hz.mean(axis=1)
        order = np.argsort(middles)
        measured = np.interp(cycles / sample_s, middles[order], spectrum.power[order])
        density = np.where(cycles > spectrum.frequency_hz[fit.used].max() * sample_s, measured, density)
    variance = np.empty(len(factors))
    for place, m in enumerate(factors):
        # Where the grid no longer follows the fourth power, its mean does.
        power = np.where(m * cycles < 8.0, np.sin(np.pi * m * cycles) ** 4, 0.375)
        response = 2.0 * power / (m * np.sin(np.pi * cycles)) ** 2
        each = density * response * cycles / sample_s
        # Below the grid a random walk's is even in frequency, and that of the others next to nothing.
        variance[place] = np.trapezoid(each, np.log(cycles)) + each[0]
    return variance
