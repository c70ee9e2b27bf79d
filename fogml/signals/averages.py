"""Averages over consecutive windows of time, gaps respected, and what noise leaves in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.signals import large
from fogml.signals.clock import Clock, gap_starts, longest_gap_s
from fogml.signals.noise_spectrum import Spectrum
from fogml.signals.output_filters import SpectrumTerms, term_shapes

AVERAGING_S = 100.0
"""Averaging time of figures unless another is asked for [s]: long beside white noise, short beside thermal
times of a coil."""
_ROUNDING = 1e-6
"""Share of a sample interval by which a window's edge gives way to rounded times."""


@dataclass(frozen=True)
class BlockAverages:
    """Averages over m consecutive windows.

    Attributes
    ----------
    time_s
        Mean time of the samples in each window [s], shape (m,).
    values
        One array for each column that was given, in order: shape (m,), or (m, k) where the
        column had shape (n, k); in the column's unit.
    counts
        Samples in each window, shape (m,).
    starts, stops
        Each window holds the samples ``starts[i]:stops[i]``, shape (m,).
    """

    time_s: FloatArray
    values: tuple[FloatArray, ...]
    counts: IndexArray
    starts: IndexArray
    stops: IndexArray

    def __len__(self) -> int:
        return len(self.time_s)


def block_averages(time: ArrayLike, *columns: ArrayLike, window_s: float) -> BlockAverages:
    """Average columns over consecutive windows of `window_s` seconds.

    Windows begin with the first sample of each stretch, half a sample interval before its time: edges lie
    between samples, where times that are not quite even move none across. A gap is an interval longer than 3
    median sample intervals. A gap longer than a quarter of the window cuts the series and the windows begin
    anew after it; a shorter one is spanned.
    A window is kept if its samples cover at least half of it, from the first to the last of
    them plus one sample interval; so the rest at the end of a stretch is dropped if short.
    Takes O(n) time.

    Parameters
    ----------
    time
        Sample times [s], not decreasing, shape (n,).
    *columns
        Values to average, each of shape (n,) or (n, k).
    window_s
        Length of a window [s].

    Returns
    -------
    BlockAverages
        Empty if no window is at least half full.

    Raises
    ------
    InputError
        If the window is not a positive length or the columns differ in length from `time`.
    """
    time = np.asarray(time, dtype=np.float64)
    arrays = [np.asarray(column, dtype=np.float64) for column in columns]
    if not (np.isfinite(window_s) and window_s > 0):
        raise InputError(f"averages over {window_s} s: the window must be a positive length in seconds")
    for position, array in enumerate(arrays, start=1):
        if array.shape[:1] != time.shape:
            raise InputError(f"column {position} has {len(array)} samples, time has {len(time)}")
    starts, stops = _windows(time, float(window_s))
    counts = stops - starts
    return BlockAverages(
        time_s=window_means(time, starts, stops),
        values=tuple(window_means(array, starts, stops) for array in arrays),
        counts=counts,
        starts=starts,
        stops=stops,
    )


def window_numbers(
    time: FloatArray, origin: FloatArray | float, sample_s: float, window_s: float
) -> FloatArray:
    """Which window each sample is in, shape (n,); the first begins with a sample at `origin`."""
    return np.asarray(np.floor((time - origin + (0.5 + _ROUNDING) * sample_s) / window_s))


def _windows(time: FloatArray, window_s: float) -> tuple[IndexArray, IndexArray]:
    """First and past-the-last samples of the windows that are at least half full."""
    if len(time) == 0:
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    sample_s = Clock(time).sample_s
    cuts = gap_starts(time, sample_s, longest_gap_s(window_s, sample_s))
    edges = np.concatenate(([0], cuts, [len(time)]))
    opens = [edges[:-1]]
    for part in large.pieces(time, overlap=1):
        rows = np.arange(part.start, part.stop)
        origin = time[edges[np.searchsorted(edges, rows, side="right") - 1]]
        number = window_numbers(time[part], origin, sample_s, window_s)
        opens.append(part.start + np.flatnonzero(np.diff(number)) + 1)
    starts = np.unique(np.concatenate(opens))
    stops = np.append(starts[1:], len(time))
    covered = time[stops - 1] - time[starts] + sample_s
    full = covered >= 0.5 * window_s - _ROUNDING * sample_s
    if sample_s == 0.0:
        # One sample, or all at one time: nothing tells the interval that a sample stands for.
        full = np.ones_like(full)
    return starts[full].astype(np.intp), stops[full].astype(np.intp)


def window_means(values: FloatArray, starts: IndexArray, stops: IndexArray) -> FloatArray:
    """Means of the samples ``starts[i]:stops[i]`` of values of shape (n,) or (n, k); no window is empty.

    Windows follow each other and don't overlap; samples between them are left out. What is not finite is in
    its own window alone.
    """
    if len(starts) == 0:
        return np.empty((0, *values.shape[1:]))
    # Without its first value, a time or a rate far from zero loses no digits in the sums.
    origin = np.nan_to_num(values[starts[0]], posinf=0.0, neginf=0.0)
    # reduceat sums between neighbouring edges, so dropped windows are summed and left out.
    edges = np.unique(np.concatenate((starts, stops, [len(values)])))
    sums = np.empty((len(edges) - 1, *values.shape[1:]))
    first = 0
    while first < len(sums):
        # Windows of a piece of a long series, one at least.
        last = len(sums)
        if len(values) > large.HELD_VALUES:
            last = max(int(np.searchsorted(edges, edges[first] + large.PIECE, side="right")) - 1, first + 1)
        part = values[edges[first] : edges[last]]
        sums[first:last] = np.add.reduceat(part - origin, edges[first:last] - edges[first], axis=0)
        large.release()
        first = last
    chosen = sums[np.searchsorted(edges, starts)]
    counts = (stops - starts).reshape(-1, *([1] * (values.ndim - 1)))
    return np.asarray(chosen / counts + origin)


def freedom_of_deviation(values: FloatArray) -> float:
    """Degrees of freedom of a standard deviation of n values, shape (n,): n - 1 where they are independent.

    Coefficients P of the cosine transform are nearly independent whatever the spectrum, and of a normal
    series the squares of P have three times the squared mean, so that the deviation's square has
    ``3 sum(P)**2 / sum(P**2) - 2`` by F. E. Satterthwaite, Biometrics Bulletin 2 (1946); less 2, so that a
    single coefficient is one.
    """
    from scipy.fft import dct

    n = len(values)
    power = dct(values - values.mean(), norm="ortho")[1:] ** 2
    squares = float(power @ power)
    if not squares > 0.0:
        return n - 1.0
    return float(np.clip(3.0 * power.sum() ** 2 / squares - 2.0, 1.0, n - 1.0))


_SMALL = 0.05


def mean_cosine(before: FloatArray, after: FloatArray) -> FloatArray:
    """Mean of cos(x) while x moves evenly from `before` to `after` [rad], shape (n,).

    ``(sin(after) - sin(before)) / (after - before)``, in a form that holds for equal ends.
    """
    half = 0.5 * (after - before)
    return np.cos(before + half) * _sine_ratio(half)


def covered_share(step_s: FloatArray, gap: float = 1.5, over: int = 101) -> FloatArray:
    """Share of the time since the sample before that each sample covers, shape (n,).

    Parameters
    ----------
    step_s
        Time since the sample before [s], shape (n,).
    gap
        Of the usual step: a longer one is a gap, and the sample after it as long as usual.
    over
        The usual step is the median of so many from each on, so that records of other intervals may follow
        one another; odd.
    """
    share = np.ones(len(step_s))
    if len(step_s) and step_s.max() > gap * step_s[1:].min(initial=step_s.max()):
        from scipy.ndimage import median_filter

        usual = median_filter(step_s, over, origin=-(over // 2), mode="reflect")
        np.divide(usual, step_s, out=share, where=step_s > gap * usual)
    return share


def with_whole_turns(turned_deg: FloatArray, told_deg: FloatArray) -> FloatArray:
    """Differences of an angle [deg] with the whole turns that its record may have left out, shape (n,).

    Parameters
    ----------
    turned_deg
        Differences of neighbouring samples of an angle that may begin anew after each turn. Over a turn
        they are whole already.
    told_deg
        The same by the rate, good to half a turn.
    """
    turns = np.rint((told_deg - turned_deg) / 360.0)
    return np.where(np.abs(turned_deg) > 360.0, turned_deg, turned_deg + 360.0 * turns)


def _sine_ratio(x: FloatArray) -> FloatArray:
    """sin(x) / x, shape (n,), exact to rounding."""
    if not max(float(x.max(initial=0.0)), -float(x.min(initial=0.0))) <= _SMALL:
        return np.sinc(x / np.pi)
    # Slow motion, the usual case, needs no sine.
    square = x * x
    return 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0))


@dataclass(frozen=True)
class FastNoise:
    """Noise too fast for a drift, as it was measured: no model of it has to hold.

    Attributes
    ----------
    from_hz
        Where it begins [Hz].
    frequency_hz, power, count
        Rows of a spectrum, as in `fogml.signals.noise_spectrum.Spectrum`.
    per_hz
        Coefficients in a hertz.
    sample_s
        Sample interval [s].
    """

    from_hz: float
    frequency_hz: FloatArray
    power: FloatArray
    count: FloatArray
    per_hz: float
    sample_s: float

    def averages_variance(self, averaging_s: float, windows: int) -> tuple[float, float]:
        """Its part of the variance of averages about their mean, and the variance of that."""
        if not len(self.power):
            return 0.0, 0.0
        cycles = np.minimum(self.frequency_hz * self.sample_s, 0.5)
        response = averages_response(cycles, max(averaging_s / self.sample_s, 1.0), windows).mean(axis=1)
        each = response * self.power / self.per_hz
        return float(each @ self.count), float(2.0 * each**2 @ self.count)


def fast_noise(spectrum: Spectrum, rows: BoolArray, from_hz: float, samples: int) -> FastNoise:
    """The rows of a spectrum of so many samples that are noise too fast for a drift."""
    per_hz = 2.0 * samples * spectrum.sample_s
    return FastNoise(
        from_hz,
        spectrum.frequency_hz[rows],
        spectrum.power[rows],
        spectrum.count[rows],
        per_hz,
        spectrum.sample_s,
    )


def averages_variance(
    name: str, sample_s: float, averaging_s: float, windows: int, up_to_hz: float | None = None
) -> float:
    """Expected variance about their mean of so many averages, of a term of coefficient 1.

    Parameters
    ----------
    name
        N, B, K or Q, as in `fogml.signals.spectrum_fit.Terms`.
    sample_s
        Interval of the samples that are averaged [s].
    averaging_s
        Averaging time [s].
    windows
        Consecutive averages.
    up_to_hz
        Where the noise ends [Hz]; at half the sampling rate if None.
    """
    m = max(averaging_s / sample_s, 1.0)
    lowest = 1.0 / (50.0 * m * windows)
    highest = 0.5 if up_to_hz is None else min(up_to_hz * sample_s, 0.5)
    cycles = np.geomspace(lowest, highest, int(64 * np.log2(highest / lowest)) + 1)
    density = term_shapes(cycles / sample_s, sample_s, SpectrumTerms((name,)))[..., 0]
    response = averages_response(cycles, m, windows)
    each = density * response * cycles / sample_s
    # Below the grid a random walk's is even in frequency, and that of the others next to nothing.
    return float(np.trapezoid(each, np.log(cycles)) + each[0])


def averages_response(cycles: FloatArray, m: float, windows: int) -> FloatArray:
    """Share of a density that is in the variance of averages of m samples about their mean.

    ``cycles`` are cycles per sample. Where a grid no longer follows a square, its mean does.
    """
    sine = np.sin(np.pi * cycles)
    one = np.where(m * cycles < 8.0, np.sin(np.pi * m * cycles) ** 2, 0.5) / (m * sine) ** 2
    all_m = m * windows
    whole = np.where(all_m * cycles < 8.0, np.sin(np.pi * all_m * cycles) ** 2, 0.5) / (all_m * sine) ** 2
    return np.asarray(np.maximum(one - whole, 0.0))
