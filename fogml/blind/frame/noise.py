"""A run's true noise as states of first order beside white noise, and its whitening in O(n).

The inner products are a' C^-1 b. States and samples form a banded Gaussian system::

    C = H P H' + R,    C^-1 v = R^-1 v - R^-1 H (P^-1 + H' R^-1 H)^-1 H' R^-1 v
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.signal import lfilter

from fogml.arrays import FloatArray


@dataclass(frozen=True)
class States:
    """Noise as independent states of first order and white noise, sampled.

    Attributes
    ----------
    decay
        Factor from one sample to the next; 1 of a random walk; shape (m,).
    step
        Variance of what each sample adds [(deg/h)^2], shape (m,).
    first
        Variance at the first sample [(deg/h)^2], shape (m,).
    white
        Variance of the white noise in a sample [(deg/h)^2].
    """

    decay: FloatArray
    step: FloatArray
    first: FloatArray
    white: float


class NoiseLaw(Protocol):
    """The law of a unit's noise."""

    def states(self, count: int, sample_s: float, before: int) -> States:
        """Of a run's rows from number `before` on, `count` of them."""

    def mean_square_of_means(self, count: int, sample_s: float, before: int, width: int) -> float:
        """Expected mean square of means over `width` of those rows, over all whole blocks [(deg/h)^2]."""

    def amounts(self) -> dict[str, tuple[float, str]]:
        """The nearest ``N``, ``B`` and ``K``, each with its unit."""


class Whitening:
    """The noise of one run of `count` samples at `sample_s`, as its inverse covariance.

    The noise began `before` samples before the first of them. `reading` is the variance that
    the noise of temperature sensors adds to each sample of the gap [(deg/h)^2], shape (count,).
    """

    def __init__(
        self,
        law: NoiseLaw,
        count: int,
        sample_s: float,
        before: int = 0,
        reading: FloatArray | None = None,
    ) -> None:
        self.law, self.count = law, count
        self._sample_s, self._before = sample_s, before
        states = law.states(count, sample_s, before)
        self._decay = states.decay
        self._step, self._first = np.maximum(states.step, 1e-18), np.maximum(states.first, 1e-18)
        self.white = states.white
        self._each = np.full(count, self.white) + (0.0 if reading is None else reading)

    @cached_property
    def _factor(self) -> FloatArray:
        m, n = len(self._decay), self.count
        # Diagonal of the states' precision; upper band form, states of a sample side by side.
        own = np.empty((n, m))
        own[:] = (1.0 + self._decay**2) / self._step
        own[0] = 1.0 / self._first + self._decay**2 / self._step
        own[-1] = (1.0 / self._step) if n > 1 else 1.0 / self._first
        band = np.zeros((m + 1, n * m))
        band[m] = (own + 1.0 / self._each[:, None]).ravel()
        next_ = band[0].reshape(n, m)
        next_[1:] = -self._decay / self._step
        for offset in range(1, m):
            # All states of a sample add up in it, so that each pair of them is coupled.
            row = band[m - offset].reshape(n, m)
            row[:, offset:] += 1.0 / self._each[:, None]
        return np.asarray(cholesky_banded(band, lower=False, check_finite=False, overwrite_ab=True))

    def solve(self, vectors: FloatArray) -> FloatArray:
        """C^-1 times columns, shape (n, k)."""
        m, n = len(self._decay), self.count
        right = np.repeat(vectors / self._each[:, None], m, axis=0)
        states = cho_solve_banded((self._factor, False), right, check_finite=False)
        total = states.reshape(n, m, -1).sum(axis=1)
        return np.asarray((vectors - total) / self._each[:, None])

    def mean_square_of_means(self, width: int) -> float:
        """Expected mean square of means over `width` samples, over all whole blocks [(deg/h)^2]."""
        return self.law.mean_square_of_means(self.count, self._sample_s, self._before, width)


@dataclass
class Projected:
    """Nominal columns of all fit runs, ready to be projected out.

    Parameters
    ----------
    whitenings
        One per run.
    columns
        Nominal columns per run, shape (n, p); constants are shared by the runs.
    """

    whitenings: list[Whitening]
    columns: list[FloatArray]

    def __post_init__(self) -> None:
        self._solved = [w.solve(x) for w, x in zip(self.whitenings, self.columns)]
        gram = sum(x.T @ s for x, s in zip(self.columns, self._solved))
        self.scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
        self._gram = np.asarray(gram) * np.outer(self.scale, self.scale)

    def constants(self, series: list[FloatArray], prior_sd: FloatArray | None = None) -> FloatArray:
        """Constants that fit a series per run best, with normal priors about 0 where given; shape (p,)."""
        right = sum(s.T @ y for s, y in zip(self._solved, series)) * self.scale
        gram = self._gram
        if prior_sd is not None:
            gram = gram + np.diag((self.scale / prior_sd) ** 2)
        return np.asarray(np.linalg.lstsq(gram, right, rcond=1e-11)[0]) * self.scale

    def length(self, series: list[FloatArray]) -> float:
        """d' = ||W (I - P) s|| of a series per run [-]."""
        theta = self.constants(series)
        left = [s - x @ theta for s, x in zip(series, self.columns)]
        total = sum(float(r @ w.solve(r[:, None])[:, 0]) for r, w in zip(left, self.whitenings))
        return float(np.sqrt(max(total, 0.0)))

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the constants, shape (p, p)."""
        inverse = np.linalg.pinv(self._gram, rcond=1e-11, hermitian=True)
        return np.asarray(inverse * np.outer(self.scale, self.scale))


@dataclass(frozen=True, eq=False)
class StateNoise:
    """One unit's noise.

    Attributes
    ----------
    N
        White, deg/sqrt(h).
    variances
        Of the processes with the time constants `taus_s` [(deg/h)^2], shape (m,).
    K
        Of the walk, deg/h/sqrt(h).
    """

    N: float
    variances: FloatArray
    taus_s: FloatArray
    K: float

    def of_another_day(self, rng: np.random.Generator, factor: float) -> StateNoise:
        """White and slow noise each times a log-normal draw of that standard deviation."""
        white, slow, walk = np.exp(np.log(factor) * np.clip(rng.standard_normal(3), -2.0, 2.0)).tolist()
        return replace(self, N=self.N * white, variances=self.variances * slow**2, K=self.K * walk)

    def states(self, count: int, sample_s: float, before: int) -> States:
        """The processes and the walk of a run's rows from number `before` on."""
        hours = sample_s / 3600.0
        decay = np.exp(-sample_s / self.taus_s)
        return States(
            decay=np.append(decay, 1.0),
            step=np.append(self.variances * (1.0 - decay**2), self.K**2 * hours),
            first=np.append(self.variances, self.K**2 * hours * (before + 1)),
            white=self.N**2 / hours,
        )

    def mean_square_of_means(self, count: int, sample_s: float, before: int, width: int) -> float:
        """Expected mean square of means over `width` rows, over all whole blocks [(deg/h)^2]."""
        hours = sample_s / 3600.0
        lags = np.arange(width)
        pairs = np.where(lags == 0, width, 2.0 * (width - lags)) / width**2
        slow = float(self.variances @ (np.exp(-lags * sample_s / self.taus_s[:, None]) @ pairs))
        first = before + width * np.arange(count // width)
        inside = np.minimum.outer(np.arange(1, width + 1), np.arange(1, width + 1)).mean()
        walk = self.K**2 * hours * float(np.mean(first + inside))
        return self.N**2 / hours / width + slow + walk

    def amounts(self) -> dict[str, tuple[float, str]]:
        """N, K, and the B of the 1/f noise that is as strong between 100 s and 5000 s."""
        f = np.geomspace(1.0 / 5000.0, 1.0 / 100.0, 30)
        turn = (2.0 * np.pi * f[:, None] * self.taus_s) ** 2
        density = (4.0 * self.variances * self.taus_s / (1.0 + turn)).sum(axis=1)
        flicker = float(np.exp(0.5 * np.mean(np.log(np.pi * f * density))))
        return {
            "N": (self.N, "deg/sqrt(h)"),
            "B": (flicker, "deg/h"),
            "K": (self.K, "deg/h/sqrt(h)"),
        }

    def series(self, rng: np.random.Generator, count: int, sample_s: float) -> FloatArray:
        """One realisation of all of it [deg/h], shape (count,)."""
        states = self.states(count, sample_s, 0)
        total = np.sqrt(states.white) * rng.standard_normal(count)
        for decay, step, first in zip(states.decay, states.step, states.first):
            drive = np.sqrt(step) * rng.standard_normal(count)
            drive[0] = np.sqrt(first) * rng.standard_normal()
            total = total + lfilter([1.0], [1.0, -decay], drive)
        return np.asarray(total)
