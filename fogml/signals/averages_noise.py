"""What noise leaves in consecutive averages about their mean: of a term, and of a measured spectrum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.signals.noise_spectrum import Spectrum
from fogml.signals.output_filters import SpectrumTerms, term_shapes


@dataclass(frozen=True)
class FastNoise:
    """Noise too fast for a drift, as it was measured: no model of it has to hold.

    Attributes
    ----------
    from_hz
        Where it begins [Hz].
    frequency_hz, power, count
        Rows of a spectrum, as in `fogml.signals.noise_spectrum.Spectrum`.
    per_hz
        Coefficients in a hertz.
    sample_s
        Sample interval [s].
    """

    from_hz: float
    frequency_hz: FloatArray
    power: FloatArray
    count: FloatArray
    per_hz: float
    sample_s: float

    def averages_variance(self, averaging_s: float, windows: int) -> tuple[float, float]:
        """Its part of the variance of averages about their mean, and the variance of that."""
        if not len(self.power):
            return 0.0, 0.0
        cycles = np.minimum(self.frequency_hz * self.sample_s, 0.5)
        response = averages_response(cycles, max(averaging_s / self.sample_s, 1.0), windows).mean(axis=1)
        each = response * self.power / self.per_hz
        return float(each @ self.count), float(2.0 * each**2 @ self.count)


def fast_noise(spectrum: Spectrum, rows: BoolArray, from_hz: float, samples: int) -> FastNoise:
    """The rows of a spectrum of so many samples that are noise too fast for a drift."""
    per_hz = 2.0 * samples * spectrum.sample_s
    return FastNoise(
        from_hz,
        spectrum.frequency_hz[rows],
        spectrum.power[rows],
        spectrum.count[rows],
        per_hz,
        spectrum.sample_s,
    )


def averages_variance(
    name: str, sample_s: float, averaging_s: float, windows: int, up_to_hz: float | None = None
) -> float:
    """Expected variance about their mean of so many averages, of a term of coefficient 1.

    Parameters
    ----------
    name
        N, B, K or Q, as in `fogml.signals.spectrum_fit.Terms`.
    sample_s
        Interval of the samples that are averaged [s].
    averaging_s
        Averaging time [s].
    windows
        Consecutive averages.
    up_to_hz
        Where the noise ends [Hz]; at half the sampling rate if None.
    """
    m = max(averaging_s / sample_s, 1.0)
    lowest = 1.0 / (50.0 * m * windows)
    highest = 0.5 if up_to_hz is None else min(up_to_hz * sample_s, 0.5)
    cycles = np.geomspace(lowest, highest, int(64 * np.log2(highest / lowest)) + 1)
    density = term_shapes(cycles / sample_s, sample_s, SpectrumTerms((name,)))[..., 0]
    response = averages_response(cycles, m, windows)
    return float(np.trapezoid(density * response * cycles / sample_s, np.log(cycles)))


def averages_response(cycles: FloatArray, m: float, windows: int) -> FloatArray:
    """Share of a density that is in the variance of averages of m samples about their mean.

    ``cycles`` are cycles per sample. Where a grid no longer follows a square, its mean does.
    """
    sine = np.sin(np.pi * cycles)
    one = np.where(m * cycles < 8.0, np.sin(np.pi * m * cycles) ** 2, 0.5) / (m * sine) ** 2
    all_m = m * windows
    whole = np.where(all_m * cycles < 8.0, np.sin(np.pi * all_m * cycles) ** 2, 0.5) / (all_m * sine) ** 2
    return np.asarray(np.maximum(one - whole, 0.0))
