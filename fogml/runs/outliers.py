"""Single samples of the gyro that stand out from their neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fogml.runs.run import FloatArray

OUTLIER_SIGMA = 8.0
"""Robust standard deviations off its neighbours from which on a sample is an outlier."""
_HALF = 2
_WITHIN = 1.6174
"""90 % of white noise of unit standard deviation lies this near to the median of five (simulated)."""
_BEND_WITHIN = 0.6744897501960817 * 6.0**0.5
"""Half of its second differences, of variance 1 + 4 + 1, are as small."""
_BLOCK = 1024
_CHUNK = 1 << 15


def find_outliers(
    gyro: FloatArray, rate_deg_s: FloatArray | None = None
) -> tuple[NDArray[np.intp], FloatArray]:
    """Samples over 8 robust sigma off the median of the five samples about them, in O(n).

    That median follows drift, ramps and steps: where samples only rise or only fall it is the
    sample itself. Up to two samples in a row stand out from it. Sigma is that of 1024 samples
    about, or of most such blocks where that is greater: while a table turns, noise of the scale
    factor adds to that at rest, and a quiet rest does not make outliers of a turn.

    Parameters
    ----------
    gyro
        Output, shape (n,).
    rate_deg_s
        Table rate [deg/s], shape (n,), if recorded; where it stands out too, a sample is none.

    Returns
    -------
    indices, sigma
        Samples, and sigma at each of them in the unit of `gyro`; none if there are fewer than
        five samples.
    """
    if len(gyro) <= 2 * _HALF:
        return np.empty(0, dtype=np.intp), np.empty(0)
    size = np.abs(_off_neighbours(gyro))
    # The first and the last sample lie on one side of all others: a line through four goes on there.
    for end, (a, b, d) in ((0, gyro[[1, 2, 4]]), (-1, gyro[[-2, -3, -5]])):
        size[end] = min(size[end], abs(gyro[end] - (a + 0.5 * (b - d))))
    sigma = _sigma(size, gyro)
    found = np.flatnonzero(size > OUTLIER_SIGMA * sigma)
    if len(found) and rate_deg_s is not None:
        moved = np.abs(_off_neighbours(rate_deg_s)[found])
        # The output may be in counts: stand-outs are compared with each column's own span.
        shares = moved / (np.ptp(rate_deg_s) or 1.0), size[found] / np.ptp(gyro)
        found = found[shares[0] < 0.5 * shares[1]]
    return found, sigma[found]


def _sigma(size: FloatArray, values: FloatArray) -> FloatArray:
    """Robust standard deviation of the noise about each sample, shape (n,).

    That of white noise of which 90 % deviates as little from the median of five, or of which half
    has second differences as small, whichever is greater: the first knows slow noise and coarse
    steps, the second noise on a ramp. Where both are 0, a step of the output stands for its noise.
    """
    bends = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
    sigma = np.maximum(_of_blocks(size, 0.9) / _WITHIN, _of_blocks(np.pad(bends, 1), 0.5) / _BEND_WITHIN)
    usual = float(np.median(sigma))
    if usual == 0.0:
        steps = np.abs(np.diff(values))
        usual = float(np.median(steps[steps > 0.0])) if steps.any() else 0.0
    return np.repeat(np.maximum(sigma, usual), _BLOCK)[: len(size)]


def _of_blocks(size: FloatArray, share: float) -> FloatArray:
    """Quantile of each block of samples; the last block ends at the end."""
    whole = len(size) // _BLOCK * _BLOCK
    quantiles: FloatArray = np.quantile(size[:whole].reshape(-1, _BLOCK), share, axis=1)
    if whole < len(size):
        quantiles = np.append(quantiles, np.quantile(size[-_BLOCK:], share))
    return quantiles


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
