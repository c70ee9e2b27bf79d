"""The true whitening: inner products a' C^-1 b under the noise of a run, in O(n).

C is that of states of first order beside white noise. States and samples form a banded Gaussian system::

    C = H P H' + R,    C^-1 v = R^-1 v - R^-1 H (P^-1 + H' R^-1 H)^-1 H' R^-1 v
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from fogml.blind.frame.record import FloatArray


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
