"""What an output filter makes of a gyro's noise, with one free constant; the terms of a noise spectrum."""

from __future__ import annotations

from collections.abc import Callable
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


def term_shapes(
    frequency_hz: FloatArray, sample_s: float, terms: SpectrumTerms, stretch_s: float | FloatArray = np.inf
) -> FloatArray:
    """Sampled one-sided density of each term of coefficient 1, shape of frequencies and (terms,).

    Samples are means over the sample interval, as a gyro's are: what lies above half the sampling rate
    folds back, ``sum_j S(f + j/T) sinc^2`` in closed form (Hurwitz' zeta function). A drift, D, is smooth.

    Of quantisation, differences of white angles, the two angles at the ends of a stretch of length
    `stretch_s` [s] add ``8 cos^2(pi f T) / stretch_s`` to the squares of its cosine transform, which is white
    at low frequencies: it would count as angle random walk.
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
            square = np.pi**2 * sine
            columns.append(8.0 / sample_s * square + 8.0 / stretch_s * (1.0 - square))
        elif name == "D":
            columns.append((2.0 * np.pi * frequency_hz) ** -4.0)
        elif name == "E":
            columns.append((np.pi**2 * sine) ** -2.0)
        else:
            columns.append(_gauss_markov(np.pi**2 * sine, sample_s, float(terms.correlation_s or 0.0)))
    return np.stack(columns, axis=-1)


def _gauss_markov(square: FloatArray, sample_s: float, correlation_s: float) -> FloatArray:
    """Density of means of a Gauss-Markov process of variance 1, `square` being sin^2(pi f T).

    The Fourier sum of their covariances, ``2 phi_2(d)`` and ``phi_1(d)**2 exp(-d (k - 1))``, d = T/tau.
    """
    d = sample_s / correlation_s
    # sinh(d)/d - 1, whose closed form cancels for slow ones.
    series = d**2 / 6.0 * (1.0 + d**2 / 20.0 * (1.0 + d**2 / 42.0))
    beyond = series if d < 0.1 else np.sinh(d) / d - 1.0
    half = np.sinh(0.5 * d) ** 2
    return np.asarray(4.0 * correlation_s * (half - square * beyond) / (half + square))


# How a digital or an analogue filter sees a frequency, in cycles per sample.
_WARPS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "bilinear": lambda x: np.tan(np.pi * np.minimum(x, 0.5 - 1e-9)),
    "recursive": lambda x: np.sin(np.pi * x),
    "analogue": lambda x: np.pi * x,
}


@dataclass(frozen=True)
class OutputFilter:
    """A low pass by its power response, 1 at the frequency zero.

    Attributes
    ----------
    kind
        ``none``; ``butterworth`` or ``cascade`` (equal first-order stages); ``mean``, the running one.
    order
        Stages of the low pass, or samples of the running mean; 0 for none.
    warp
        ``bilinear`` and ``recursive`` (exponential smoothing) as a computer filters, ``analogue`` as a
        circuit does.
    """

    kind: str = "none"
    order: int = 0
    warp: str = "bilinear"

    @property
    def free(self) -> bool:
        """Whether it has a cut-off to be found."""
        return self.kind in ("butterworth", "cascade")

    def response(self, cycles: FloatArray, log_corner: float) -> tuple[FloatArray, FloatArray]:
        """Power response and its slope over the logarithm of the corner, at cycles per sample.

        The corner is in the warped frequency, `corner_cycles` tells it in plain ones.
        """
        if self.kind == "mean":
            sine = self.order * np.sin(np.pi * cycles)
            return (np.sin(np.pi * self.order * cycles) / sine) ** 2, np.zeros_like(cycles)
        if not self.free:
            return np.ones_like(cycles), np.zeros_like(cycles)
        ratio = _WARPS[self.warp](cycles) / np.exp(log_corner)
        if self.kind == "butterworth":
            power = ratio ** (2 * self.order)
            gain = 1.0 / (1.0 + power)
            return gain, 2.0 * self.order * power * gain**2
        gain = 1.0 / (1.0 + ratio**2)
        return gain**self.order, 2.0 * self.order * ratio**2 * gain ** (self.order + 1)

    def corner_cycles(self, log_corner: float) -> float | None:
        """Frequency of half power in cycles per sample; None where all that is sampled passes."""
        if self.kind == "mean":
            from scipy.optimize import brentq

            # Its first zero is at one over the order.
            first = np.array([1e-9, 1.0]) / self.order
            return float(brentq(lambda x: self.response(x, log_corner)[0] - 0.5, *first))
        if not self.free:
            return None
        corner = float(np.exp(log_corner))
        if self.kind == "cascade":
            corner *= float(np.sqrt(2.0 ** (1.0 / self.order) - 1.0))
        if self.warp == "bilinear":
            return float(np.arctan(corner) / np.pi)
        if self.warp == "recursive":
            return float(np.arcsin(corner) / np.pi) if corner < 1.0 else None
        return corner / np.pi if corner < 0.5 * np.pi else None

    def words(self) -> str:
        """What it is, for a reader."""
        if self.kind == "mean":
            return f"running mean of {self.order} samples"
        if not self.free:
            return "no output filter"
        number = {1: "first", 2: "second"}[self.order]
        return f"low pass of {number} order"


NO_FILTER = OutputFilter()
LOW_PASSES = tuple(
    OutputFilter(kind, order, warp)
    for kind, order in (("butterworth", 1), ("butterworth", 2), ("cascade", 2))
    for warp in _WARPS
)
"""The forms that compete."""
LONGEST_MEAN = 128
"""Samples of the longest running mean that is looked for."""
