"""Oscillations as samples hold them: the mean over each sample."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
_SMALL = 0.05


def mean_cosine(before: FloatArray, after: FloatArray) -> FloatArray:
    """Mean of cos(x) while x moves evenly from `before` to `after` [rad], shape (n,).

    ``(sin(after) - sin(before)) / (after - before)``, in a form that holds for equal ends.
    """
    half = 0.5 * (after - before)
    return np.cos(before + half) * _sine_ratio(half)


def _sine_ratio(x: FloatArray) -> FloatArray:
    """sin(x) / x, shape (n,), exact to rounding."""
    if max(float(x.max(initial=0.0)), -float(x.min(initial=0.0))) > _SMALL:
        return np.sinc(x / np.pi)
    # Slow motion, the usual case, needs no sine.
    square = x * x
    return 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0))
