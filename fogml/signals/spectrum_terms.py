"""Terms of a noise spectrum, and their densities as samples show them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray

AFTER = ("Q", "W", "E")
"""Terms that a filter does not act on."""


@dataclass(frozen=True)
class SpectrumTerms:
    """Which terms a model has.

    Attributes
    ----------
    names
        N, B, K, G (Gauss-Markov), D (of the fourth power, a drift's), filtered; after the filter Q, W (white
        rounding) and E (what a smooth series' ends add to its cosine transform, of no meaning).
    correlation_s
        Correlation time of G [s].
    """

    names: tuple[str, ...] = ("N", "B", "K", "Q")
    correlation_s: float | None = None


def term_shapes(frequency_hz: FloatArray, sample_s: float, terms: SpectrumTerms) -> FloatArray:
    """Sampled one-sided density of each term of coefficient 1, shape of frequencies and (terms,).

    Samples are means over the sample interval, as a gyro's are: what lies above half the sampling rate
    folds back, ``sum_j S(f + j/T) sinc^2`` in closed form (Hurwitz' zeta function).
    """
    from scipy.special import zeta

    x = frequency_hz * sample_s
    sine = np.sin(np.pi * x) ** 2 / np.pi**2
    columns = []
    for name in terms.names:
        if name in ("N", "W"):
            columns.append(np.full_like(x, 2.0))
        elif name == "B":
            columns.append(sine * sample_s / np.pi * (zeta(3.0, x) + zeta(3.0, 1.0 - x)))
        elif name == "K":
            folded = zeta(4.0, x) + zeta(4.0, 1.0 - x)
            columns.append(sine * sample_s**2 / (2.0 * np.pi**2) * folded)
        elif name == "Q":
            columns.append(8.0 / sample_s * np.pi**2 * sine)
        elif name == "D":
            columns.append((2.0 * np.pi * frequency_hz) ** -4.0)
        elif name == "E":
            columns.append((np.pi**2 * sine) ** -2.0)
        else:
            tau = float(terms.correlation_s or 0.0)
            columns.append(4.0 * tau / (1.0 + (2.0 * np.pi * frequency_hz * tau) ** 2))
    return np.stack(columns, axis=-1)
