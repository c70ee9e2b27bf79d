"""Single samples of the gyro that stand out from their neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fogml.runs.run import FloatArray

OUTLIER_SIGMA = 8.0
"""Robust standard deviations off its neighbours from which on a sample is an outlier."""
_HALF = 2
_QUANTILE = 0.9
_GAUSSIAN_QUANTILE = 1.6174
"""90 % of white noise of unit standard deviation lies this near to the median of five (simulated)."""
_SPREAD_SAMPLES = 1 << 17
_CHUNK = 1 << 15


def find_outliers(gyro: FloatArray, rate_deg_s: FloatArray | None = None) -> tuple[NDArray[np.intp], float]:
    """Samples over 8 robust sigma off the median of the five samples about them, in O(n).

    That median follows drift, ramps and steps: where samples only rise or only fall it is the
    sample itself. Up to two samples in a row stand out from it. Sigma is that of white noise
    of which as much lies within the 90 % quantile of the deviations, so that a coarse output, whose
    deviations are mostly 0, is judged by those that are not.

    Parameters
    ----------
    gyro
        Output, shape (n,).
    rate_deg_s
        Table rate [deg/s], shape (n,), if recorded; where it stands out too, a sample is none.

    Returns
    -------
    indices, sigma
        In the unit of `gyro`; none and 0 if there are fewer than five samples.
    """
    if len(gyro) <= 2 * _HALF:
        return np.empty(0, dtype=np.intp), 0.0
    size = np.abs(_off_neighbours(gyro))
    sigma = float(np.quantile(size[:: max(len(size) // _SPREAD_SAMPLES, 1)], _QUANTILE)) / _GAUSSIAN_QUANTILE
    if sigma == 0.0:
        # Quiet as coarse: one step of the output stands for its noise.
        steps = np.abs(np.diff(gyro))
        sigma = float(np.median(steps[steps > 0.0])) if steps.any() else 0.0
    found = np.flatnonzero(size > OUTLIER_SIGMA * sigma)
    if len(found) and rate_deg_s is not None:
        moved = np.abs(_off_neighbours(rate_deg_s)[found])
        # The output may be in counts: stand-outs are compared with each column's own span.
        shares = moved / (np.ptp(rate_deg_s) or 1.0), size[found] / np.ptp(gyro)
        found = found[shares[0] < 0.5 * shares[1]]
    return found, sigma


def _off_neighbours(values: FloatArray) -> FloatArray:
    """Each value less the median of the five about it, mirrored at the ends; shape (n,)."""
    padded = np.pad(values, _HALF, mode="reflect")
    off = np.empty(len(values))
    # Chunks stay in the processor's cache.
    for start in range(0, len(values), _CHUNK):
        part = padded[start : start + _CHUNK + 2 * _HALF]
        n = len(part) - 2 * _HALF
        a, b, c, d, e = (part[i : i + n] for i in (0, 1, 3, 4, 2))
        low = np.maximum(np.minimum(a, b), np.minimum(c, d))
        high = np.minimum(np.maximum(a, b), np.maximum(c, d))
        median = np.maximum(np.minimum(low, high), np.minimum(e, np.maximum(low, high)))
        np.subtract(e, median, out=off[start : start + n])
    return off
