"""Noise as a sum of processes of first order: white, any number of Ornstein-Uhlenbeck ones, and a walk."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from fogml.blind.frame.record import FloatArray
from fogml.blind.frame.whitening import States


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
