"""Random series with a stated Allan deviation: white, flicker, random walk, Gauss-Markov, quantisation.

Samples are means over the sample interval, so that the Allan deviation is that of the continuous
process from the first averaging time on. Coefficients are in the series' unit x and seconds.

`Flicker` is of any length, sample after sample, from one white series. The power law ``(1 - x)**(-1/2)``, x a
delay of one sample (N. J. Kasdin, Proc. IEEE 83 (1995) 802), is a sum of first-order lags with positive
weights::

    (1 - x)**(-1/2) = (1 / pi) * integral of  1 / (1 - a x) / sqrt(a (1 - a))  over a from 0 to 1

With ``a = 1 / (1 + exp(-v))`` equal steps of v converge exponentially, so that two lags a decade are
good to a thousandth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.signals.bases import sine
from fogml.signals.compiled import kernel
from fogml.signals.modes import phi_functions

Float32Array = NDArray[np.float32]

# Steps of a random walk's means over neighbouring samples have variance 2/3 and covariance 1/6.
_NEWEST = 0.5 * (1.0 + 3.0**-0.5)
_DEGREE = 10


def white_noise(rng: np.random.Generator, count: int, sample_s: float, coefficient: float) -> FloatArray:
    """White noise with Allan deviation N / sqrt(tau), shape (count,).

    `coefficient` is N [x sqrt(s)].
    """
    series = rng.standard_normal(count)
    series *= coefficient / math.sqrt(sample_s)
    return series


def flicker_noise(rng: np.random.Generator, count: int, coefficient: float) -> FloatArray:
    """Flicker noise with Allan deviation sqrt(2 ln 2 / pi) B = 0.664 B, shape (count,).

    Parameters
    ----------
    rng
        Where the noise comes from.
    count
        Number of samples.
    coefficient
        B [x]; the one-sided density is B**2 / (pi f).

    Notes
    -----
    One inverse FFT over twice the record (J. Timmer and M. Koenig, Astronomy and Astrophysics 300 (1995)
    707), so that its ends know nothing of each other: 1/f from half of one over the record on. The
    density is that of means over a sample, folded back at the Nyquist frequency. Spectrum and
    transform are in single precision, seven digits below the noise itself.
    """
    from scipy.fft import irfft, next_fast_len

    if count == 0:
        return np.empty(0)
    length = int(next_fast_len(2 * count, real=True))
    spectrum = rng.standard_normal((length // 2 + 1, 2), dtype=np.float32)
    _shape_flicker(spectrum, coefficient, 1.0 / length, _folded_root())
    series = irfft(spectrum.view(np.complex64)[:, 0], n=length, norm="forward", overwrite_x=True)
    return series[:count].astype(np.float64)


def random_walk(rng: np.random.Generator, count: int, sample_s: float, coefficient: float) -> FloatArray:
    """Random walk with Allan deviation K sqrt(tau / 3), shape (count,), from 0 on.

    `coefficient` is K [x / sqrt(s)].
    """
    steps = rng.standard_normal(count)
    steps *= coefficient * math.sqrt(sample_s)
    walked = np.cumsum(steps)
    # Means over the samples: of the walk's value before and after, and of the bridge between.
    steps *= 1.0 - _NEWEST
    walked -= steps
    return walked


def gauss_markov(
    rng: np.random.Generator, count: int, sample_s: float, deviation: float, time_constant_s: float
) -> FloatArray:
    """First-order Gauss-Markov process, shape (count,), at rest in the statistical sense from the start.

    Parameters
    ----------
    rng
        Where the noise comes from.
    count
        Number of samples.
    sample_s
        Sample interval [s].
    deviation
        Standard deviation of the process itself [x]; that of the samples, its means, is lower.
    time_constant_s
        Of its exponential correlation [s].

    Notes
    -----
    Means over the samples have correlations ``phi_1(d)**2 exp(-d (k - 1))`` at k >= 1 samples, d the sample
    interval over the time constant, and ``2 phi_2(d)`` at 0: one first-order recursion with two
    taps of white noise.
    """
    decay, first, second = phi_functions(sample_s / time_constant_s)
    variance, covariance = 2.0 * second, first * first
    # The two taps' squares add to `both`, their product is `mixed`.
    both = variance * (1.0 + decay * decay) - 2.0 * decay * covariance
    mixed = covariance - decay * variance
    total, apart = math.sqrt(both + 2.0 * mixed), math.sqrt(max(both - 2.0 * mixed, 0.0))
    newest, before = 0.5 * (total + apart), 0.5 * (total - apart)
    kept = decay * newest + before
    # 1 - decay**2 without cancellation.
    spread = math.sqrt(first * (1.0 + decay) * sample_s / time_constant_s)
    series = rng.standard_normal(count)
    _gauss_markov_kernel(series, decay, newest, kept, float(rng.standard_normal()) * kept / spread)
    series *= deviation
    return series


def quantisation_noise(
    rng: np.random.Generator, count: int, sample_s: float, coefficient: float
) -> FloatArray:
    """Rate of an angle that is read in whole steps, with Allan deviation sqrt(3) Q / tau, shape (count,).

    `coefficient` is Q [x s]; the step is sqrt(12) Q. What rounding leaves over is uniform and, for a
    signal that passes several steps a sample, white.
    """
    left = rng.uniform(-0.5, 0.5, count + 1)
    left *= math.sqrt(12.0) * coefficient / sample_s
    return np.diff(left)


def sinusoid(
    count: int, sample_s: float, amplitude: float, frequency_hz: float, phase_rad: float
) -> FloatArray:
    """A line as means over the samples hold it, sinc and alias included, shape (count,)."""
    turned = frequency_hz * sample_s
    turns = np.arange(0.5, count) * turned
    turns += phase_rad / (2.0 * math.pi)
    line = sine(turns)
    line *= amplitude * float(np.sinc(turned))
    return line


def bursts(
    rng: np.random.Generator, count: int, deviation: float, probability: float, mean_length: float
) -> FloatArray:
    """Rare bursts of a normal size, zeros between, shape (count,).

    Parameters
    ----------
    rng
        Where they come from.
    count
        Number of samples.
    deviation
        Standard deviation of their size [x], which holds over a burst.
    probability
        That a burst begins at a sample.
    mean_length
        Mean length in samples, at least 1; lengths are geometric.
    """
    series = np.zeros(count)
    number = int(rng.binomial(count, min(probability, 1.0)))
    starts = np.sort(rng.integers(0, max(count, 1), number))
    # Of a burst that outlasts the series only what lies within is worked out.
    lengths = np.minimum(rng.geometric(1.0 / max(mean_length, 1.0), number), count - starts)
    sizes = deviation * rng.standard_normal(number)
    which = np.repeat(np.arange(number), lengths)
    within = np.arange(len(which)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    np.add.at(series, starts[which] + within, sizes[which])
    return series


@kernel()
def _shape_flicker(spectrum: Float32Array, coefficient: float, step: float, root: FloatArray) -> None:
    """Give white Fourier coefficients, shape (m, 2), the deviation of flicker noise; none at frequency 0."""
    spectrum[0, 0] = 0.0
    spectrum[0, 1] = 0.0
    scale = coefficient / math.sqrt(4.0 * math.pi)
    for k in range(1, len(spectrum)):
        x = k * step
        folded = root[-1]
        for j in range(len(root) - 2, -1, -1):
            folded = folded * x + root[j]
        size = scale * folded / math.sqrt(k)
        spectrum[k, 0] *= size
        spectrum[k, 1] *= size


@cache
def _folded_root() -> FloatArray:
    """Root of the density of means over a sample over that of 1/f, as a polynomial in frequency times sample.

    ``sinc(x)**2 (1 + x**3 (zeta(3, 1 + x) + zeta(3, 1 - x)))``, zeta Hurwitz's: means lose the fast part
    and fold back what is beyond the Nyquist frequency, x = 1/2.
    """
    from scipy.special import zeta

    x = 0.25 + 0.25 * np.cos(np.pi * (np.arange(64) + 0.5) / 64.0)
    folded = np.sinc(x) ** 2 * (1.0 + x**3 * (zeta(3.0, 1.0 + x) + zeta(3.0, 1.0 - x)))
    fitted = np.polynomial.Chebyshev.fit(x, np.sqrt(folded), _DEGREE, domain=[0.0, 0.5])
    return np.ascontiguousarray(fitted.convert(kind=np.polynomial.Polynomial).coef)


@kernel()
def _gauss_markov_kernel(series: FloatArray, decay: float, newest: float, kept: float, state: float) -> None:
    """Turn white noise into means of a Gauss-Markov process of variance 1, in place."""
    for k in range(len(series)):
        white = series[k]
        series[k] = state + newest * white
        state = decay * state + kept * white


LONGEST_S = 1e7
"""Time constant of the slowest lag [s]: the spectrum is flat below its corner."""
_STEP = 1.15
_FASTEST = -9.0
# A mean of two neighbours that gives samples the Allan deviation of averages over the sample.
_BLEND = 0.1533


@kernel()
def flicker_kernel(
    white: FloatArray, decay: FloatArray, weight: FloatArray, states: FloatArray, last: float, blend: float
) -> float:
    """Turn white noise into flicker noise in place; `states` (m,) are overwritten; the last raw value."""
    m = len(decay)
    for k in range(len(white)):
        w = white[k]
        value = 0.0
        for i in range(m):
            states[i] = decay[i] * states[i] + w
            value += weight[i] * states[i]
        white[k] = (value + blend * last) / (1.0 + blend)
        last = value
    return last


@dataclass
class Flicker:
    """Flicker noise with one-sided density ``B**2 / (pi f)``, in the unit of B.

    Its Allan deviation is ``sqrt(2 ln 2 / pi) B = 0.664 B`` at any averaging time.

    Parameters
    ----------
    coefficient
        B.
    sample_s
        Sample interval [s].
    rng
        Where the noise comes from.
    """

    coefficient: float
    sample_s: float
    rng: np.random.Generator

    def __post_init__(self) -> None:
        slowest = max(math.log(LONGEST_S / self.sample_s), _FASTEST + _STEP)
        v = np.arange(_FASTEST, slowest + _STEP, _STEP)
        self._decay = 1.0 / (1.0 + np.exp(-v))
        left = 1.0 / (1.0 + np.exp(v))
        self._weight = _STEP / math.pi * np.sqrt(self._decay * left)
        # The weights of all lags add to 1; those that are still faster act as the fastest one.
        self._weight[0] += 1.0 - self._weight.sum()
        # At rest in the statistical sense: the states' covariance, all driven by one series.
        apart = left[:, None] + left[None, :] - np.outer(left, left)
        root = np.sqrt(left * (2.0 - left))
        values, vectors = np.linalg.eigh(np.outer(root, root) / apart)
        drawn = self.rng.standard_normal(len(v)) * np.sqrt(np.maximum(values, 0.0))
        self._states = np.ascontiguousarray(self.coefficient * (vectors @ drawn) / root)
        self._last = float(self._weight @ self._states)

    def block(self, count: int) -> FloatArray:
        """The next `count` samples, shape (count,)."""
        white = self.rng.standard_normal(count)
        white *= self.coefficient
        self._last = float(flicker_kernel(white, self._decay, self._weight, self._states, self._last, _BLEND))
        return white
