"""A gyro's noise in state space: white noise, flicker as a ladder of Gauss-Markov states, random walk.

Samples are means over an averaging time that ends at the sample's time. Values are rates in deg/h,
times are seconds; coefficients are those of IEEE Std 952.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.signals.noise_terms import FLICKER_FLOOR

WIDEST_STEP = 0.75 * math.log(10.0)
"""Widest step between the ladder's time constants, in the logarithm: ripple of 1.3 % about 1/f."""
_FASTER = 0.1
"""Flicker faster than this share of the averaging time counts as white: its averages are."""
_SLOWER = 3.0
"""The ladder goes on to this many run lengths: 1/f is short of 3.4 % at one over the run length."""
_HIDDEN = 0.002
"""Flicker faster than the time at which all that is faster makes this share of the white noise is
white too: no frequency's total density is off by more."""
ADJOINING = 1.5
"""Samples this many averaging times apart, or less, share the angle between them."""


@dataclass(frozen=True)
class Ladder:
    """Gauss-Markov states whose sum has a 1/f spectrum.

    Attributes
    ----------
    time_constants_s
        Evenly spaced in the logarithm, shape (m,) [s].
    step
        Natural logarithm of the ratio of two neighbours.
    """

    time_constants_s: FloatArray
    step: float

    @property
    def edge_s(self) -> float:
        """Time constant [s] below which flicker counts as white."""
        return float(self.time_constants_s[0]) * math.exp(-0.5 * self.step)


def flicker_ladder(averaging_s: float, longest_s: float, white_below_s: float = 0.0) -> Ladder:
    """The fewest states, ripple under 1.3 %, that make flicker of a series.

    Parameters
    ----------
    averaging_s
        What its samples are means over [s].
    longest_s
        Its length [s]. Slower flicker is constant over it.
    white_below_s
        Time constant [s] below which flicker may count as white.
    """
    fastest = max(_FASTER * averaging_s, min(white_below_s, longest_s))
    reach = math.log(_SLOWER * max(longest_s / fastest, 1.0))
    count = math.ceil(reach / WIDEST_STEP)
    step = reach / count
    return Ladder(fastest * np.exp(step * (np.arange(count) + 0.5)), step)


@dataclass(frozen=True)
class NoiseModel:
    """Noise coefficients of a gyro.

    Attributes
    ----------
    N
        Angle random walk [deg/sqrt(h)], positive: Allan deviation ``N / sqrt(tau)``.
    B
        Flicker [deg/h]: Allan deviation 0.664 B at any averaging time, one-sided density
        ``B**2 / (pi f)``.
    K
        Rate random walk [deg/h/sqrt(h)]: Allan deviation ``K sqrt(tau / 3)``; 0 at a run's start.
    Q
        Quantisation of the angle [deg]: Allan deviation ``sqrt(3) Q / tau``.

    Raises
    ------
    InputError
        If a coefficient is negative or not finite, or N is zero.
    """

    N: float
    B: float = 0.0
    K: float = 0.0
    Q: float = 0.0

    def __post_init__(self) -> None:
        for name in ("N", "B", "K", "Q"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise InputError(f"noise model: {name} is {value}, zero or a positive number was expected")
        if self.N == 0.0:
            raise InputError("noise model: N is 0, but every sample of a gyro has some white noise")

    @property
    def white_density(self) -> float:
        """Variance of a mean over 1 s of the white noise alone [(deg/h)^2 s]."""
        return 3600.0 * self.N**2

    @property
    def walk_rate(self) -> float:
        """Growth of the random walk's variance [(deg/h)^2 / s]."""
        return self.K**2 / 3600.0

    def quantisation_variance(self, averaging_s: float) -> float:
        """Variance of one angle's rounding over the averaging time [(deg/h)^2]; a sample holds two."""
        return (3600.0 * self.Q / averaging_s) ** 2

    def ladder(self, averaging_s: float, longest_s: float) -> Ladder:
        """The flicker states that a series needs beside this white noise; as `flicker_ladder`."""
        if self.B == 0.0:
            return flicker_ladder(averaging_s, longest_s)
        hidden = _HIDDEN * self.white_density * math.pi / (2.0 * self.B**2)
        return flicker_ladder(averaging_s, longest_s, hidden)

    def state_variance(self, ladder: Ladder) -> float:
        """Variance of each of the ladder's states [(deg/h)^2]."""
        return self.B**2 * ladder.step / math.pi

    def fast_density(self, ladder: Ladder) -> float:
        """White noise with the flicker that is faster than the ladder [(deg/h)^2 s]."""
        return self.white_density + 2.0 * self.B**2 * ladder.edge_s / math.pi

    def density(self, frequency_hz: ArrayLike, ladder: Ladder | None = None) -> FloatArray:
        """One-sided spectral density before averaging [(deg/h)^2/Hz], without quantisation.

        With a ladder that of the states, without one that of the power laws.
        """
        f = np.asarray(frequency_hz, dtype=np.float64)
        walk = self.walk_rate / (2.0 * np.pi**2 * f**2)
        if ladder is None:
            return np.asarray(2.0 * self.white_density + self.B**2 / (np.pi * f) + walk)
        tau = ladder.time_constants_s
        lags = 4.0 * tau / (1.0 + (2.0 * np.pi * np.multiply.outer(f, tau)) ** 2)
        flicker = self.state_variance(ladder) * lags.sum(axis=-1)
        return np.asarray(2.0 * self.fast_density(ladder) + flicker + walk)

    def allan_variance(self, averaging_s: ArrayLike) -> FloatArray:
        """Allan variance of means over times [s], of the power laws [(deg/h)^2]."""
        tau = np.asarray(averaging_s, dtype=np.float64)
        quantisation = 3.0 * (3600.0 * self.Q / tau) ** 2
        flicker = (FLICKER_FLOOR * self.B) ** 2
        return np.asarray(quantisation + self.white_density / tau + flicker + self.walk_rate * tau / 3.0)

    def variances(self, time: ArrayLike, averaging_s: ArrayLike, ladder: Ladder) -> FloatArray:
        """Variance of each mean over `averaging_s` that ends at `time` [s], shape (n,) [(deg/h)^2].

        The random walk starts where the first mean begins.
        """
        end = np.asarray(time, dtype=np.float64)
        a = np.broadcast_to(np.asarray(averaging_s, dtype=np.float64), end.shape)
        x = np.multiply.outer(a, 1.0 / ladder.time_constants_s)
        shares = 2.0 * _phi_2(x)
        since = end - a - (end[0] - a[0])
        return np.asarray(
            self.fast_density(ladder) / a
            + self.state_variance(ladder) * shares.sum(axis=-1)
            + self.walk_rate * (since + a / 3.0)
            + 2.0 * (3600.0 * self.Q / a) ** 2
        )

    def covariance(self, time: ArrayLike, averaging_s: float, ladder: Ladder) -> FloatArray:
        """Covariance of samples, shape (n, n) [(deg/h)^2]: for short series and for checks.

        A sample closer to the one before than `averaging_s` sees the slow noise since that one.
        """
        end = np.asarray(time, dtype=np.float64)
        a = np.concatenate(([averaging_s], np.minimum(np.diff(end), averaging_s)))
        begin = end - a
        apart = np.maximum(begin[:, None] - end[None, :], 0.0)
        after = np.tril(np.ones((len(end), len(end)), dtype=bool), -1)
        covariance = np.zeros((len(end), len(end)))
        for tau in ladder.time_constants_s:
            seen = _phi_1(a / tau)
            covariance += self.state_variance(ladder) * np.outer(seen, seen) * np.exp(-apart / tau)
        # The mean of the walk so far over the earlier of two samples.
        covariance += self.walk_rate * (0.5 * (begin + end) - begin[0])[None, :]
        adjoining = np.concatenate(([False], np.diff(end) <= ADJOINING * averaging_s))
        rounding = self.quantisation_variance(averaging_s)
        rows = np.flatnonzero(adjoining)
        covariance[rows, rows - 1] -= rounding
        covariance = np.where(after, covariance, 0.0)
        covariance += covariance.T
        slow = NoiseModel(self.N, self.B, self.K).variances(end, a, ladder)
        fast = self.fast_density(ladder)
        np.fill_diagonal(covariance, slow - fast / a + fast / averaging_s + 2.0 * rounding)
        return covariance


def _phi_1(x: FloatArray) -> FloatArray:
    return np.asarray(-np.expm1(-x) / x)


def _phi_2(x: FloatArray) -> FloatArray:
    """(1 - phi_1(x)) / x without cancellation."""
    series = 0.5 - x / 6.0 + x**2 / 24.0 - x**3 / 120.0 + x**4 / 720.0
    return np.where(x < 0.01, series, (1.0 - _phi_1(x)) / x)
