"""The gyro's noise: white, true 1/f by spectral synthesis, and random walk.

One-sided densities over f [1/h]: N**2 * 2, B**2 / (pi f), K**2 / (2 pi**2 f**2); the Allan variance is
N**2 / tau + (2 ln 2 / pi) B**2 + K**2 tau / 3 (IEEE Std 952).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from fogml.gap.blind.reality.recurrences import FloatArray

BASE = {"N": 0.005, "B": 0.01, "K": 0.005}
"""Middles of the log-normal draws: deg/sqrt(h), deg/h, deg/h/sqrt(h)."""
UNITS = {"N": "deg/sqrt(h)", "B": "deg/h", "K": "deg/h/sqrt(h)"}
_RECORDS = 8
"""The flicker is cut from a record this many times longer than the run, at least."""


@dataclass(frozen=True)
class NoiseConstants:
    """``N`` deg/sqrt(h), ``B`` deg/h, ``K`` deg/h/sqrt(h)."""

    N: float
    B: float
    K: float

    def scaled(self, rng: np.random.Generator, factor: float) -> NoiseConstants:
        """Each constant times a log-normal draw whose standard deviation is `factor`, cut at two."""
        draws = np.clip(rng.standard_normal(3), -2.0, 2.0) * np.log(factor)
        return NoiseConstants(*(float(v * np.exp(d)) for v, d in zip(asdict(self).values(), draws)))


def draw_noise(rng: np.random.Generator) -> NoiseConstants:
    """A unit's noise: log-normal about `BASE` by a factor of 3, as the nominal twin's priors have it."""
    return NoiseConstants(**BASE).scaled(rng, 3.0)


def record_length(count: int) -> int:
    """Samples of the record that the flicker of a run of `count` samples is cut from."""
    return 1 << int(np.ceil(np.log2(_RECORDS * max(count, 2))))


def flicker(rng: np.random.Generator, count: int, coefficient: float) -> FloatArray:
    """Flicker noise with one-sided density B**2 / (pi f) up to the Nyquist frequency, shape (count,).

    Fourier components are independent normal draws of just that density; the mean of the long
    record is zero, that of the part taken from it is not.
    """
    length = record_length(count)
    k = np.arange(1, length // 2 + 1)
    # Density times the spacing of frequencies is the variance of a component: B^2 / (pi k).
    sigma = coefficient / np.sqrt(np.pi * k)
    parts = np.zeros(length // 2 + 1, dtype=np.complex128)
    parts[1:] = sigma * (rng.standard_normal(len(k)) + 1j * rng.standard_normal(len(k)))
    parts[-1] = parts[-1].real
    return np.fft.irfft(0.5 * length * parts, length)[:count]


def draw_series(
    rng: np.random.Generator, count: int, sample_s: float, constants: NoiseConstants
) -> FloatArray:
    """One realisation of all terms [deg/h], shape (count,); the walk starts at zero with the run."""
    hours = sample_s / 3600.0
    white = constants.N / np.sqrt(hours) * rng.standard_normal(count)
    walk = np.cumsum(constants.K * np.sqrt(hours) * rng.standard_normal(count))
    return white + walk + flicker(rng, count, constants.B)
