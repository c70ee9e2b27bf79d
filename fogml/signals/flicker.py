"""Flicker (1/f) noise of any length, sample after sample, from one white series.

The power law ``(1 - x)**(-1/2)``, x a delay of one sample (N. J. Kasdin, Proc. IEEE 83 (1995) 802), is
a sum of first-order lags with positive weights::

    (1 - x)**(-1/2) = (1 / pi) * integral of  1 / (1 - a x) / sqrt(a (1 - a))  over a from 0 to 1

With ``a = 1 / (1 + exp(-v))`` equal steps of v converge exponentially, so that two lags a decade are
good to a thousandth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.compiled import kernel

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
