"""Power spectral density of a series in one pass: cosine transform, lines told apart, bins in frequency.

The coefficients of the cosine transform (DCT-II) are independent for white noise and for a random walk
alike, to the letter (the walk's Karhunen-Loeve basis), and nearly so in between: no taper is needed, and
none of the run's information is lost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError, counted
from fogml.settings_check import check_numbers
from fogml.signals import large
from fogml.signals.clock import check_interval
from fogml.signals.cosine import cosine_transform
from fogml.signals.spectral_lines import SpectralLine, lines_of, one_of_each

Rows = Callable[[slice], FloatArray]
"""Columns of a stretch, told for some of its rows at a time."""

POINTS = 4
"""Frequencies at which a model is asked in a bin."""
_BLOCKS = 4096
_ROUNDING = 1e-12
"""A column moves by rounding alone if it is nearer than this, relative to its size, to its mean."""
_LONG = 1 << 16
"""Samples from which a series may lose a few at its end so that its transform is quick."""


@dataclass(frozen=True)
class Resolution:
    """How finely a spectrum is told.

    Attributes
    ----------
    single
        Lowest coefficients of a stretch that stand alone, each with its columns.
    most_single
        Such coefficients of all stretches together, at most; few of each are kept in any case.
    per_octave
        Bins in an octave of frequency above them: S may change by a tenth in one.
    line_chance
        Chance of taking noise for a line, of the whole spectrum.
    line_fewest
        Coefficients whose median tells the noise about a line: that of fewer is known worse than to 40 %, so
        that smaller bins are joined.
    line_near
        Coefficients on either side whose median a line's are compared with: few, as a density that is steep
        or has zeros is no line, and more than a line covers. Lines of the single coefficients are told from a
        model of the noise (`fogml.signals.slow_lines`).
    line_widest
        Single coefficients that hold most of a sinusoid whose cycles are no whole number of halves.
    line_cycles
        Cycles in a stretch from which on single coefficients make a sinusoid: fewer are told from no drift.
    collinear
        Share of the greatest singular value of the columns, each of length 1, from which a direction is told.
        Thermometers of one make whose readings agree to a few counts differ by more; what is below is the
        rounding of columns that are sums of others, of no physical meaning.
    """

    single: int = 64
    most_single: int = 1024
    per_octave: int = 16
    line_chance: float = 1e-3
    line_fewest: int = 32
    line_near: int = 50
    line_widest: int = 4
    line_cycles: float = 2.0
    collinear: float = 1e-5

    def __post_init__(self) -> None:
        check_numbers(self, chances=("line_chance",), shares=("collinear",))


@dataclass(frozen=True)
class Spectrum:
    """Estimated one-sided density of a series, row by row, with rising frequency in two parts.

    Attributes
    ----------
    sample_s
        Sample interval [s].
    frequency_hz
        Frequencies inside each row, shape (rows, POINTS).
    power
        Mean density of each row [(deg/h)^2/Hz], shape (rows,).
    count
        Coefficients behind each row: degrees of freedom, shape (rows,).
    stretch_s
        Length of the stretch that they are of, of several the mean by their coefficients [s], shape (rows,).
    values
        Signed coefficients of the first rows, whose count is 1, shape (single,); their squares are its power.
    columns
        Coefficients of given columns in the same rows, shape (single, p).
    removed
        Constants of the columns that were taken out beforehand by ordinary least squares, shape (p,).
    lines
        Sinusoids whose coefficients are left out, the largest first.
    collinear
        As of `Resolution`.
    """

    sample_s: float
    frequency_hz: FloatArray
    power: FloatArray
    count: FloatArray
    stretch_s: FloatArray
    values: FloatArray
    columns: FloatArray
    removed: FloatArray
    lines: tuple[SpectralLine, ...] = ()
    collinear: float = Resolution.collinear

    @cached_property
    def basis(self) -> tuple[FloatArray, FloatArray]:
        """Orthonormal basis of the columns, and what takes its coefficients to their constants.

        Found once, and not for each density: a likelihood whose columns come and go with it has steps.
        """
        lengths = np.linalg.norm(self.columns, axis=0)
        lengths[lengths == 0.0] = 1.0
        left, sizes, right = np.linalg.svd(self.columns / lengths, full_matrices=False)
        kept = sizes > self.collinear * sizes.max(initial=0.0)
        return left[:, kept], right[kept].T / sizes[kept] / lengths[:, None]


def spectrum_of(
    stretches: Sequence[FloatArray],
    sample_s: float,
    columns: Sequence[FloatArray | Rows] | None = None,
    resolution: Resolution | None = None,
) -> Spectrum:
    """Spectrum of stretches of one series or of several, each about a mean of its own.

    Parameters
    ----------
    stretches
        Evenly sampled values [deg/h], shape (n,) each, without gaps.
    sample_s
        Sample interval [s].
    columns
        Regressors of each stretch, shape (n, p), that vary slowly: only the single coefficients know them.
        Of a long stretch a function that gives them at some of its rows.
    resolution
        How finely.

    Raises
    ------
    InputError
        If the sample interval is not positive, no stretch has 3 samples, or a value is not finite.
    """
    check_interval(sample_s, "spectrum")
    fine = resolution or Resolution()
    kept = [i for i, y in enumerate(stretches) if len(y) >= 3]
    if not kept:
        longest = max(map(len, stretches), default=0)
        raise InputError(f"spectrum: the longest stretch has {counted(longest, 'sample')}; it takes 3")
    single = max(min(fine.single, fine.most_single // max(len(kept), 1)), 4)
    lengths = [_good_length(len(stretches[i])) for i in kept]
    total, longest = sum(lengths), max(lengths)
    columns = [np.empty((len(y), 0)) for y in stretches] if columns is None else columns
    tables = [_rows_of(one) for one in columns]
    # Columns vary slowly: means over blocks tell all of them.
    least = 64 * single
    coarse = [
        (_block_means(tables[i], n, least), _block_means(_rows_of(stretches[i][:, None]), n, least), n)
        for i, n in zip(kept, lengths)
    ]
    if not all(np.isfinite(means).all() for _, means, _ in coarse):
        raise InputError("spectrum: values that are not finite; leave them out first")
    told = _told(coarse)
    coarse = [(x * told, means, n) for x, means, n in coarse]
    removed = _least_squares(coarse)
    edges = _edges((single + 0.5) / longest, fine.per_octave)
    sums = np.zeros(len(edges) - 1)
    counts = np.zeros(len(edges) - 1)
    ends = np.zeros(len(edges) - 1)
    low_f, low_v, low_x, low_s = [], [], [], []
    lines: list[tuple[int, list[SpectralLine]]] = []
    for i, n, (x, means, _) in zip(kept, lengths, coarse):
        y, middle = large.empty(n), means.mean()
        for part in large.pieces(y):
            y[part] = stretches[i][part] - middle
            if len(removed):
                y[part] -= tables[i](part) @ removed
        coefficients = cosine_transform(y)
        coefficients *= np.sqrt(2.0 * sample_s)
        alone = min(single, n - 1)
        low_f.append(np.arange(1, alone + 1) / (2.0 * n * sample_s))
        low_s.append(np.full(alone, n * sample_s))
        low_v.append(coefficients[1 : alone + 1].copy())
        scale = np.sqrt(2.0 * sample_s * n / len(x))
        low_x.append(scale * np.array([cosine_transform(c)[1 : alone + 1] for c in x.T]).reshape(-1, alone).T)
        square = coefficients[alone + 1 :]
        square *= square
        # In shares of the highest frequency, coefficient k of n is at k / n.
        at = np.clip(np.ceil(edges * n).astype(np.int64) - alone - 1, 0, len(square))
        square = square[: at[-1]]
        used = np.flatnonzero(np.diff(at) > 0)
        first = at[used]
        if not len(used):
            continue
        chance = fine.line_chance / total
        masked, found = lines_of(
            square, at, sample_s, n, alone + 1, chance, fewest=fine.line_fewest, near=fine.line_near
        )
        lines.append((n, found))
        count = np.diff(at)
        if masked is not None:
            square[masked] = 0.0
            lost = np.searchsorted(at, np.flatnonzero(masked), side="right") - 1
            count = count - np.bincount(lost, minlength=len(at) - 1)
        counts[used] += count[used]
        ends[used] += count[used] / (n * sample_s)
        sums[used] += np.add.reduceat(square, first)
        large.release()
    seen = counts > 0
    half = 0.5 / sample_s
    points = (np.arange(POINTS) + 0.5) / POINTS
    low, high = edges[:-1, None] * half, np.minimum(edges[1:, None], 1.0) * half
    binned = low + (high - low) * points
    below = np.concatenate(low_f)
    values = np.concatenate(low_v)
    return Spectrum(
        sample_s,
        np.vstack((np.repeat(below[:, None], POINTS, axis=1), binned[seen])),
        np.concatenate((values**2, sums[seen] / counts[seen])),
        np.concatenate((np.ones(len(values)), counts[seen])),
        np.concatenate((*low_s, counts[seen] / ends[seen])),
        values,
        np.vstack(low_x),
        removed,
        one_of_each(lines, sample_s),
        fine.collinear,
    )


def _good_length(samples: int) -> int:
    """Length of nearly all of a series that is quickly transformed."""
    from scipy.fft import next_fast_len

    if samples < _LONG:
        return samples
    length = samples // 2 * 2
    while next_fast_len(length, real=True) != length:
        length -= 2
    return length


def _rows_of(columns: FloatArray | Rows) -> Rows:
    return columns.__getitem__ if isinstance(columns, np.ndarray) else columns


def _block_means(rows: Rows, n: int, least: int) -> FloatArray:
    """Means of n rows over blocks of equal length, at least so many and enough for what varies slowly."""
    blocks = max(_BLOCKS, least)
    if n <= 2 * blocks:
        return rows(slice(0, n))
    edges = np.linspace(0, n, blocks + 1).astype(np.intp)
    at_once = blocks if n <= large.HELD_VALUES else max(large.PIECE * blocks // n, 1)
    sums = []
    for first in range(0, blocks, at_once):
        part = edges[first : first + at_once + 1]
        sums.append(np.add.reduceat(rows(slice(part[0], part[-1])), part[:-1] - part[0], axis=0))
        large.release()
    return np.asarray(np.concatenate(sums) / np.diff(edges)[:, None])


def _told(stretches: Sequence[tuple[FloatArray, FloatArray, int]]) -> BoolArray:
    """Which columns say anything: not those that move by rounding alone, nor any if they fit all values."""
    centred = np.concatenate([x - x.mean(axis=0) for x, _, _ in stretches])
    size = np.linalg.norm(np.concatenate([x for x, _, _ in stretches]), axis=0)
    moving = np.linalg.norm(centred, axis=0) > _ROUNDING * size
    unit = centred[:, moving] / np.linalg.norm(centred[:, moving], axis=0)
    values = len(centred) - len(stretches)
    if unit.shape[1] >= values and np.linalg.matrix_rank(unit, tol=_ROUNDING) >= values:
        return np.zeros_like(moving)
    return np.asarray(moving)


def _least_squares(stretches: Sequence[tuple[FloatArray, FloatArray, int]]) -> FloatArray:
    """Constants of the columns by ordinary least squares, each stretch about its mean."""
    width = stretches[0][0].shape[1]
    gram, image = np.zeros((width, width)), np.zeros(width)
    for x, y, n in stretches:
        centred = x - x.mean(axis=0)
        gram += n / len(x) * centred.T @ centred
        image += n / len(x) * centred.T @ (y[:, 0] - y.mean())
    size, found = np.sqrt(np.diag(gram)), np.zeros(width)
    moving = np.flatnonzero(size)
    size, image = size[moving], image[moving]
    unit = gram[np.ix_(moving, moving)] / np.outer(size, size)
    found[moving] = np.linalg.lstsq(unit, image / size, rcond=1e-12)[0] / size
    return found


def _edges(begin: float, per_octave: int) -> FloatArray:
    """Edges of bins as shares of the highest frequency: even in its logarithm, and in that of its distance.

    A digital filter may have a zero at half the sampling rate; the last few coefficients are left out.
    """
    if begin >= 0.5:
        return np.array([min(begin, 1.0), 1.0])
    octaves = -np.log2(2.0 * begin)
    low = begin * 2.0 ** np.linspace(0.0, octaves, max(int(np.ceil(per_octave * octaves)), 1) + 1)
    return np.concatenate((low, 1.0 - low[-2::-1]))
