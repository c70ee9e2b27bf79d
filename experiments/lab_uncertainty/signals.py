"""Signals of a laboratory in plain NumPy, without the package's simulator: noise, thermometers, loggers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from fogml.arrays import BoolArray, FloatArray

_PERIODS = 4
"""Flicker is drawn over so many lengths of the series: what is slower is a constant of it."""


@dataclass(frozen=True)
class Noise:
    """N [deg/sqrt(h)], B [deg/h], K [deg/h/sqrt(h)] and the angle of a count [arcsec], 0 for none."""

    N: float
    B: float = 0.0
    K: float = 0.0
    count_arcsec: float = 0.0

    def draw(self, rng: np.random.Generator, count: int, step_s: float) -> FloatArray:
        """Noise without counts [deg/h], shape (count,)."""
        noise = 60.0 * self.N / np.sqrt(step_s) * rng.standard_normal(count)
        if self.B > 0.0:
            noise += self.B * flicker(rng, count)
        if self.K > 0.0:
            noise += np.cumsum(self.K * np.sqrt(step_s / 3600.0) * rng.standard_normal(count))
        return noise

    def counted(self, rate_deg_h: FloatArray, step_s: float) -> FloatArray:
        """A rate as whole counts of its angle make it [deg/h], shape (n,)."""
        if self.count_arcsec == 0.0:
            return rate_deg_h
        angle = np.concatenate(([0.0], np.cumsum(rate_deg_h * step_s)))
        return np.asarray(np.diff(np.floor(angle / self.count_arcsec)) * self.count_arcsec / step_s)


TACTICAL, NAVIGATION = Noise(0.02, 0.05, 0.05), Noise(0.001, 0.002, 0.005)


def flicker(rng: np.random.Generator, count: int) -> FloatArray:
    """Noise of one-sided density 1 / (pi f), shape (count,): Allan deviation sqrt(2 ln 2 / pi)."""
    period = 1 << int(np.ceil(np.log2(_PERIODS * count)))
    lines = np.arange(1.0, period // 2 + 1)
    # A line of density S has the variance S / period; both parts of its amplitude hold half of it.
    size = np.sqrt(1.0 / (np.pi * lines)) * period / 2.0
    parts = rng.standard_normal((2, len(lines)))
    spectrum = np.concatenate(([0.0], size * (parts[0] + 1j * parts[1])))
    return np.asarray(np.fft.irfft(spectrum, period)[:count])


def thermometer(
    rng: np.random.Generator, temperature: FloatArray, step_s: float, lag_s: float, resolution: float
) -> FloatArray:
    """What a sensor with a first-order lag, noise and whole steps reads [degC], shape (n,)."""
    noisy = lagged(temperature, step_s, lag_s) + 0.5 * resolution * rng.standard_normal(len(temperature))
    return np.asarray(np.round(noisy / resolution) * resolution)


def lagged(values: FloatArray, step_s: float, lag_s: float) -> FloatArray:
    """A first-order lag behind values, at rest with the first, shape (n,)."""
    keep = np.exp(-step_s / lag_s)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])[0])


def kept_rows(rng: np.random.Generator, count: int, share: float) -> BoolArray:
    """Rows that a logger did not drop, shape (count,)."""
    kept = rng.random(count) >= share
    kept[[0, -1]] = True
    return np.asarray(kept)
