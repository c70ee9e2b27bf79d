"""Oscillations as samples hold them: the mean over each sample."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def mean_cosine(before: FloatArray, after: FloatArray) -> FloatArray:
    """Mean of cos(x) while x moves evenly from `before` to `after` [rad], shape (n,).

    ``(sin(after) - sin(before)) / (after - before)``, in a form that holds for equal ends.
    """
    return np.cos(0.5 * (before + after)) * np.sinc((after - before) / (2.0 * np.pi))
