"""Single samples of the gyro that stand out from their neighbours."""

from __future__ import annotations

from collections.abc import Iterator

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
    if len(gyro) <= 2 * _HALF:
        return none
    size = _off_neighbours(gyro)
    for part in large.pieces(size):
        np.abs(size[part], out=size[part])
    # The first and the last sample lie on one side of all others: a line through four goes on there.
    for end, (a, b, d) in ((0, gyro[[1, 2, 4]]), (-1, gyro[[-2, -3, -5]])):
        size[end] = min(size[end], abs(gyro[end] - (a + 0.5 * (b - d))))
    if _none_stands_out(size):
        return none
    sigma = _sigma(size, gyro)
    # Values of one block share their sigma.
    found = np.concatenate(
        [
            part.start
            + np.flatnonzero(size[part] > OUTLIER_SIGMA * sigma[np.arange(part.start, part.stop) // _BLOCK])
            for part in large.pieces(size)
        ]
    )
    if len(found) and rate_deg_s is not None:
        moved = np.abs(_off_neighbours(rate_deg_s)[found])
        # The output may be in counts: stand-outs are compared with each column's own span.
        shares = moved / (np.ptp(rate_deg_s) or 1.0), size[found] / np.ptp(gyro)
        found = found[shares[0] < 0.5 * shares[1]]
    return found, sigma[found // _BLOCK]


def _none_stands_out(size: FloatArray) -> bool:
    """Whether every block has so many samples near its greatest that sigma, which is dear, can't matter.

    A tenth of them lie at or above the quantile of 0.9, and sigma is no less than that quantile tells.
    """
    for blocks in _blocks(size):
        high = blocks.max(axis=1) * (_WITHIN / OUTLIER_SIGMA * (1.0 + 1e-9))
        rank = int(_SHARE * (blocks.shape[1] - 1))
        if np.any(np.count_nonzero(blocks >= high[:, None], axis=1) < blocks.shape[1] - rank):
            return False
    return True


def _sigma(size: FloatArray, values: FloatArray) -> FloatArray:
    """Robust standard deviation of the noise about each block of samples, shape (blocks,).

    That of white noise of which 90 % deviates as little from the median of five, or of which half
    has second differences as small, whichever is greater: the first knows slow noise and coarse
    steps, the second noise on a ramp. Where both are 0, a step of the output stands for its noise.
    """
    bends = large.empty(len(values))
    bends[[0, -1]] = 0.0
    for part in large.pieces(values, overlap=2):
        x = values[part]
        bends[part.start + 1 : part.stop - 1] = np.abs(x[2:] - 2.0 * x[1:-1] + x[:-2])
    sigma = np.maximum(_of_blocks(size, _SHARE) / _WITHIN, _of_blocks(bends, 0.5) / _BEND_WITHIN)
    usual = float(np.median(sigma))
    if usual == 0.0:
        usual = large.median(lambda: (np.abs(step[step != 0.0]) for _, step in large.differences(values)))
    return np.fmax(sigma, usual)


def _of_blocks(size: FloatArray, share: float) -> FloatArray:
    """Quantile of each block of samples."""
    return np.concatenate([np.quantile(blocks, share, axis=1) for blocks in _blocks(size)])


def _blocks(size: FloatArray) -> Iterator[FloatArray]:
    """Blocks of samples as rows, all of one length; the last one, which ends at the end, by itself."""
    whole = len(size) // _BLOCK * _BLOCK
    for part in large.pieces(size[:whole], least=_BLOCK) if whole else ():
        yield size[part].reshape(-1, _BLOCK)
    if whole < len(size):
        yield size[None, -_BLOCK:]


def _off_neighbours(values: FloatArray) -> FloatArray:
    """Each value less the median of the five about it, mirrored at the ends; shape (n,)."""
    n = len(values)
    off = large.empty(n)
    # Chunks stay in the processor's cache.
    for part in large.pieces(values[_HALF : n - _HALF], least=_CHUNK):
        for start in range(part.start + _HALF, part.stop + _HALF, _CHUNK):
            stop = min(start + _CHUNK, part.stop + _HALF)
            _less_median(values[start - _HALF : stop + _HALF], off[start:stop])
    ends = min(2 * _HALF, n)
    _less_median(np.pad(values[:ends], (_HALF, 0), mode="reflect"), off[: ends - _HALF])
    _less_median(np.pad(values[-ends:], (0, _HALF), mode="reflect"), off[_HALF - ends :])
    return off


def _less_median(values: FloatArray, out: FloatArray) -> None:
    """Each value but two at either end less the median of the five about it."""
    a, b, e, c, d = (values[i : i + len(out)] for i in range(2 * _HALF + 1))
    low = np.maximum(np.minimum(a, b), np.minimum(c, d))
    high = np.minimum(np.maximum(a, b), np.maximum(c, d))
    median = np.maximum(np.minimum(low, high), np.minimum(e, np.maximum(low, high)))
    np.subtract(e, median, out=out)
