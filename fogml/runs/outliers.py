"""Single samples of the gyro that stand out from their neighbours."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.intervals import Z50
from fogml.signals import large

OUTLIER_SIGMA = 8.0
"""Robust standard deviations off its neighbours from which on a sample is an outlier."""
_HALF = 2
_SHARE = 0.9
_WITHIN = 1.6174
"""90 % of white noise of unit standard deviation lies this near to the median of five (simulated)."""
_BEND_WITHIN = Z50 * 6.0**0.5
"""Half of its second differences, of variance 1 + 4 + 1, are as small."""
_BLOCK = 1024
_CHUNK = 1 << 14


def find_outliers(gyro: FloatArray, rate_deg_s: FloatArray | None = None) -> tuple[IndexArray, FloatArray]:
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
    none = np.empty(0, dtype=np.intp), np.empty(0)
    if len(gyro) <= 2 * _HALF or _none_stands_out(gyro):
        return none
    sigma = _sigma(gyro)
    found, sizes, moved = [], [], []
    for part in large.pieces(gyro):
        size = _off_neighbours(gyro, part)
        # Values of one block share their sigma.
        limit = OUTLIER_SIGMA * sigma[np.arange(part.start, part.stop) // _BLOCK]
        places = np.flatnonzero(size > limit)
        found.append(part.start + places)
        sizes.append(size[places])
        if rate_deg_s is not None and len(places):
            moved.append(np.abs(_less_median(rate_deg_s, part))[places])
    outliers = np.concatenate(found)
    if rate_deg_s is not None and moved:
        # The output may be in counts: stand-outs are compared with each column's own span.
        share = np.concatenate(moved) / (np.ptp(rate_deg_s) or 1.0)
        outliers = outliers[share < 0.5 * np.concatenate(sizes) / np.ptp(gyro)]
    return outliers, sigma[outliers // _BLOCK]


def _none_stands_out(gyro: FloatArray) -> bool:
    """Whether every block has so many samples near its greatest that sigma, which is dear, can't matter.

    A tenth of them lie at or above the quantile of 0.9, and sigma is no less than that quantile tells.
    """
    for blocks in _blocks(_off_neighbours, gyro):
        high = blocks.max(axis=1) * (_WITHIN / OUTLIER_SIGMA * (1.0 + 1e-9))
        rank = int(_SHARE * (blocks.shape[1] - 1))
        if np.any(np.count_nonzero(blocks >= high[:, None], axis=1) < blocks.shape[1] - rank):
            return False
    return True


def _sigma(values: FloatArray) -> FloatArray:
    """Robust standard deviation of the noise about each block of samples, shape (blocks,).

    That of white noise of which 90 % deviates as little from the median of five, or of which half
    has second differences as small, whichever is greater: the first knows slow noise and coarse
    steps, the second noise on a ramp. Where both are 0, a step of the output stands for its noise.
    """
    off = np.concatenate([np.quantile(x, _SHARE, axis=1) for x in _blocks(_off_neighbours, values)])
    bent = np.concatenate([np.quantile(x, 0.5, axis=1) for x in _blocks(_bends, values)])
    sigma = np.maximum(off / _WITHIN, bent / _BEND_WITHIN)
    usual = float(np.median(sigma))
    if usual == 0.0:
        usual = large.median(lambda: (np.abs(step[step != 0.0]) for _, step in large.differences(values)))
    return np.fmax(sigma, usual)


def _blocks(measure: Callable[[FloatArray, slice], FloatArray], values: FloatArray) -> Iterator[FloatArray]:
    """A measure of blocks of samples as rows, all of one length; the last one, at the end, by itself."""
    whole = len(values) // _BLOCK * _BLOCK
    for part in large.pieces(values[:whole], least=_BLOCK):
        yield measure(values, part).reshape(-1, _BLOCK)
    if whole < len(values):
        yield measure(values, slice(max(len(values) - _BLOCK, 0), len(values)))[None]


def _bends(values: FloatArray, part: slice) -> FloatArray:
    """Sizes of a part's second differences, zero at either end of all values."""
    x = values[max(part.start - 1, 0) : part.stop + 1]
    ends = int(part.start == 0), int(part.stop == len(values))
    return np.pad(np.abs(x[2:] - 2.0 * x[1:-1] + x[:-2]), ends)


def _off_neighbours(values: FloatArray, part: slice) -> FloatArray:
    """How far each value of a part is off its neighbours."""
    size = _less_median(values, part)
    np.abs(size, out=size)
    # The first and the last sample lie on one side of all others: a line through four goes on there.
    for end, (a, b, d) in ((0, values[[1, 2, 4]]), (-1, values[[-2, -3, -5]])):
        if part.start == 0 if end == 0 else part.stop == len(values):
            size[end] = min(size[end], abs(values[end] - (a + 0.5 * (b - d))))
    return size


def _less_median(values: FloatArray, part: slice) -> FloatArray:
    """Each value of a part less the median of the five about it, mirrored at the ends of all values."""
    off = np.empty(part.stop - part.start)
    # Chunks stay in the processor's cache.
    for start in range(part.start, part.stop, _CHUNK):
        stop = min(start + _CHUNK, part.stop)
        near = values[max(start - _HALF, 0) : stop + _HALF]
        lacking = max(_HALF - start, 0), max(stop + _HALF - len(values), 0)
        if any(lacking):
            near = np.pad(near, lacking, mode="reflect")
        a, b, e, c, d = (near[i : i + stop - start] for i in range(2 * _HALF + 1))
        low = np.maximum(np.minimum(a, b), np.minimum(c, d))
        high = np.minimum(np.maximum(a, b), np.maximum(c, d))
        median = np.maximum(np.minimum(low, high), np.minimum(e, np.maximum(low, high)))
        np.subtract(e, median, out=off[start - part.start : stop - part.start])
    return off
