"""Sinusoids of a few cycles: rows of a spectrum that stand out of the noise model fitted to all of them.

Among the lowest coefficients of a stretch no row has enough neighbours to tell its noise by them alone
(`fogml.signals.spectral_lines`); a model of the whole spectrum does.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.cosine import cosine_transform
from fogml.signals.distributions import chi2_sf
from fogml.signals.noise_spectrum import Resolution, Spectrum
from fogml.signals.spectral_lines import SpectralLine
from fogml.signals.spectrum_fit import SpectrumFit

_POINTS = 64
"""Points of a sinusoid for each coefficient that is told of it."""


def without_slow_line(
    spectrum: Spectrum, fit: SpectrumFit, excess: float, resolution: Resolution | None = None
) -> Spectrum | None:
    """The spectrum with the sinusoid that stands out most among its columns, and told among its lines.

    Parameters
    ----------
    spectrum
        The data.
    fit
        The model fitted to it.
    excess
        Variance of the rows' relative errors that the model does not explain.
    resolution
        How lines are told.

    Returns
    -------
    Spectrum or None
        None where none stands out, as of noise in all but one of a thousand spectra, or where it has fewer
        cycles than tell it from a drift.
    """
    fine = resolution or Resolution()
    single = slice(len(spectrum.values))
    frequency, length = spectrum.frequency_hz[single].mean(axis=1), spectrum.stretch_s[single]
    if not len(frequency) or not np.all(fit.used[single]):
        return None
    left = spectrum.values - spectrum.columns @ fit.constants
    white = left / np.sqrt(fit.density[single] * (1.0 + 0.5 * excess))
    order = np.argsort(frequency, kind="stable")
    sums = np.concatenate(([0.0], np.cumsum(white[order] ** 2)))
    least, low, high = fine.line_chance / (fine.line_widest * len(order)), 0, 0
    for width in range(1, min(fine.line_widest, len(order)) + 1):
        chances = chi2_sf(sums[width:] - sums[:-width], width)
        place = int(np.argmin(chances))
        if chances[place] < least:
            least, low, high = float(chances[place]), place, place + width
    if high == low or np.min((frequency * length)[order[low:high]]) < fine.line_cycles:
        return None
    near = float(np.average(frequency[order[low:high]], weights=white[order[low:high]] ** 2))
    at, columns, amplitude = _sinusoid(spectrum, fit, near)
    lines = (*spectrum.lines, SpectralLine(at, amplitude))
    return replace(
        spectrum,
        columns=np.column_stack((spectrum.columns, columns)),
        removed=np.append(spectrum.removed, np.zeros(columns.shape[1])),
        lines=tuple(sorted(lines, key=lambda line: -line.amplitude)),
    )


def _sinusoid(spectrum: Spectrum, fit: SpectrumFit, near_hz: float) -> tuple[float, FloatArray, float]:
    """Frequency [Hz] that explains most near one, its columns, and its amplitude."""
    from scipy.optimize import minimize_scalar

    single = slice(len(spectrum.values))
    root = np.sqrt(fit.density[single])
    known = np.linalg.qr(spectrum.basis[0] / root[:, None])[0]
    white = spectrum.values / root
    white -= known @ (known.T @ white)
    longest = float(spectrum.stretch_s[single].max())

    def solved(frequency_hz: float) -> tuple[FloatArray, FloatArray, float]:
        columns = _columns(spectrum, frequency_hz)
        beside = columns / root[:, None]
        beside = beside - known @ (known.T @ beside)
        sizes = np.linalg.lstsq(beside, white, rcond=None)[0]
        return columns, np.asarray(sizes, dtype=np.float64), float(np.sum((white - beside @ sizes) ** 2))

    half = 0.5 / longest
    found = minimize_scalar(
        lambda at: solved(at)[2], bounds=(max(near_hz - half, half), near_hz + half), method="bounded"
    )
    columns, sizes, _ = solved(float(found.x))
    share = spectrum.stretch_s[single][[int(np.flatnonzero(c)[0]) for c in columns.T]]
    return float(found.x), columns, float(np.sqrt(2.0 * np.average(sizes**2, weights=share)))


def _columns(spectrum: Spectrum, frequency_hz: float) -> FloatArray:
    """Cosine and sine in the coefficients of each stretch of a cycle or more, shape (single, columns)."""
    frequency = spectrum.frequency_hz[: len(spectrum.values)].mean(axis=1)
    length = spectrum.stretch_s[: len(spectrum.values)]
    number = np.rint(2.0 * frequency * length).astype(np.intp)
    starts = [*np.flatnonzero(number == 1).tolist(), len(number)]
    columns = []
    for first, stop in pairwise(starts):
        long_s = float(length[first])
        if frequency_hz * long_s < 1.0:
            continue
        points = _POINTS * (stop - first)
        phase = 2.0 * np.pi * frequency_hz * long_s / points * (np.arange(points) + 0.5)
        for wave in (np.cos(phase), np.sin(phase)):
            column = np.zeros(len(number))
            scaled = np.sqrt(2.0 * long_s / points) * cosine_transform(wave)
            column[first:stop] = scaled[number[first:stop]]
            columns.append(column)
    return np.array(columns).T
