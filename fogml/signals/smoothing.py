"""Readings of slow quantities without their noise and steps: splines whose roughness cross-validation picks.

A reading is a smooth course and white noise. The smooth course minimises
``sum (reading - smooth)^2 + penalty sum (third difference)^2`` (E. T. Whittaker, Proc. Edinburgh Math. Soc.
41 (1923) 63), the penalty the generalised cross-validation (P. Craven and G. Wahba, Numer. Math. 31 (1979)
377).

What a record in whole steps hides: the smoothest course that runs through its stairs.

Where a slow quantity is read in coarse steps, each reading bounds it to half a step either way, and
the times of the edges tell more than that. The course minimises the squares of its third
differences, which a steady change of rate does not have, of what it leaves the bounds by, and, weakly,
of its distance from the middle of each stair. It is a smoother after Whittaker with bounds.

References: E. T. Whittaker, Proc. Edinburgh Math. Soc. 41 (1923) 63; P. H. C. Eilers, Anal. Chem. 75
(2003) 3631.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.clock import Clock, gap_starts

PENALTIES = np.geomspace(1e-3, 1e8, 23)
LEAST_PASSED = 0.1
"""Share of a mode that the smoother lets through under which it is taken for none."""
_ORDER = 3
_THIRD = np.array([-1.0, 3.0, -3.0, 1.0])


@dataclass(frozen=True)
class Smoothness:
    """What cross-validation found: the readings' noise, a standard deviation, and the penalty."""

    noise: float
    penalty: float

    def errors(self, n: int) -> FloatArray:
        """What the smooth course may differ by from the true one: columns of unit priors, shape (n, k).

        The posterior covariance of a spline is the noise's variance times the smoother (G. Wahba, J. R.
        Statist. Soc. B 45 (1983) 133); of its modes those are left out that it hardly lets through.
        """
        passed, modes = _modes(n, self.penalty)
        return self.noise * np.sqrt(passed) * modes


@lru_cache(maxsize=8)
def _modes(n: int, penalty: float) -> tuple[FloatArray, FloatArray]:
    """Modes of the smoother of n readings, shape (n, k), and the share of each that it lets through."""
    from scipy.linalg import eig_banded

    roughest = (1.0 / LEAST_PASSED - 1.0) / penalty if penalty > 0.0 else np.inf
    # No third difference is rougher than 64 times its square.
    values, modes = eig_banded(_bands(n), select="v", select_range=(-1.0, min(roughest, 4.0**_ORDER + 1.0)))
    return 1.0 / (1.0 + penalty * np.maximum(values, 0.0)), modes


def smoothed(values: FloatArray, share: float = 1.0) -> tuple[FloatArray, Smoothness]:
    """Evenly spaced readings smoothed, shape (n,), and what cross-validation found.

    With a share of the penalty, less so.
    """
    n = len(values)
    if n < 16 or float(np.ptp(values)) == 0.0:
        return values, Smoothness(0.0, 0.0)
    bands = _bands(n)
    waves = (2.0 - 2.0 * np.cos(np.pi * np.arange(n) / n)) ** _ORDER
    offset = float(values[0])
    best: tuple[float, FloatArray, Smoothness] | None = None
    for penalty in PENALTIES.tolist():
        smooth = _solved(bands, penalty, values - offset) + offset
        free = float(np.sum(1.0 / (1.0 + penalty * waves)))
        square = float(np.sum((values - smooth) ** 2))
        score = n * square / (n - free) ** 2
        if best is None or score < best[0]:
            best = score, smooth, Smoothness(float(np.sqrt(square / max(n - free, 1.0))), penalty)
    assert best is not None
    if share != 1.0:
        return _solved(bands, share * best[2].penalty, values - offset) + offset, best[2]
    return best[1], best[2]


def _solved(bands: FloatArray, penalty: float, values: FloatArray) -> FloatArray:
    from scipy.linalg import solveh_banded

    system = penalty * bands
    system[-1] += 1.0
    return np.asarray(solveh_banded(system, values, check_finite=False))


def _bands(n: int, lower: bool = False) -> FloatArray:
    """Upper or lower bands of D'D for third differences, as `scipy.linalg.solveh_banded` takes them."""
    bands = np.zeros((_ORDER + 1, n))
    for i in range(_ORDER + 1):
        for j in range(i, _ORDER + 1):
            row, first = (j - i, i) if lower else (_ORDER - (j - i), j)
            bands[row, first : n - _ORDER + first] += _THIRD[i] * _THIRD[j]
    return bands


def window_difference(
    time: FloatArray, values: FloatArray, window_s: float, ahead_s: float = 0.0
) -> FloatArray:
    """Mean over the last window less the mean over the one before, as integrals over time; shape as given.

    Values are a cubic spline between samples, and what they first were before. Samples that stand for the
    interval that ends at them hold what was half of it `ahead_s`.
    """
    from scipy.interpolate import CubicSpline

    total = CubicSpline(time, values).antiderivative()

    def integral(at: FloatArray) -> FloatArray:
        before = np.multiply.outer(np.minimum(at - time[0], 0.0), values[0])
        return np.asarray(before + total(np.maximum(at, time[0])))

    end = time + ahead_s
    here, before = integral(end), integral(end - window_s)
    return np.asarray((here - 2.0 * before + integral(end - 2.0 * window_s)) / window_s)


def at_points(
    time: FloatArray, means: Mapping[str, FloatArray], at: FloatArray, spread: float
) -> dict[str, FloatArray]:
    """Smooth courses at points, from their means over spans about `time`.

    A mean over a span exceeds the middle's value by half the second derivative times `spread`, the mean
    square of the span's samples about its middle [s^2].
    """
    if not means or (spread == 0.0 and np.array_equal(time, at)):
        return {name: values.copy() for name, values in means.items()}
    from scipy.interpolate import CubicSpline

    # One spline of all: building one costs far more than a column more.
    course = CubicSpline(time, np.column_stack(list(means.values())))
    return dict(zip(means, np.ascontiguousarray((course(at) - 0.5 * spread * course(at, 2)).T)))


def centred_rate(time: FloatArray, x: FloatArray, window_s: float) -> FloatArray:
    """Rate of x per second: mean over the window after each sample less that over the window before.

    Divided by the distance of the two mean times. Both windows, [t, t + w) and (t - w, t], hold the
    sample itself and its neighbour at least, so that on even samples the rate is that at t, without
    delay; at an end, or beside a gap, they take what there is.

    Parameters
    ----------
    time
        Sample times [s], shape (n,), strictly increasing.
    x
        Values, shape (n,).
    window_s
        Length w of each window [s]; 0 takes the neighbours.

    Returns
    -------
    FloatArray
        Rates per second, shape (n,); 0 for a single sample.
    """
    n = len(time)
    if n < 2:
        return np.zeros(n)
    here = np.arange(n)
    # Samples on a grid must not fall on either side of a window's edge by rounding.
    edge_s = max(window_s * (1.0 - 1e-8), 0.0)
    stop = np.clip(np.searchsorted(time, time + edge_s), here + 2, n)
    start = np.clip(np.searchsorted(time, time - edge_s, side="right"), 0, np.maximum(here - 1, 0))

    def distance(values: FloatArray) -> FloatArray:
        """Mean after less mean before; sums are taken about the mean, which keeps them small."""
        total = np.concatenate([[0.0], np.cumsum(values - values.mean())])
        after = (total[stop] - total[here]) / (stop - here)
        return np.asarray(after - (total[here + 1] - total[start]) / (here + 1 - start))

    return distance(x) / distance(time)


CELL_S = 10.0
"""Readings are averaged over this time first; a thermometer's place knows nothing quicker."""
SMOOTHED_S = 100.0
"""Time over which readings that are a step apart each are smoothed [s]."""
_BOUND = 100.0
"""Weight of leaving the bounds, over that of the distance from a stair of one cell."""
_ROUNDS = 30


def course_through_steps(time: FloatArray, values: FloatArray, step: float) -> FloatArray:
    """The course behind a record in whole steps, within half a step of each reading.

    In time that is linear in the samples.

    Parameters
    ----------
    time
        Sample times [s], shape (n,), increasing; what lies between gaps is a record of its own, and one of
        a minute or less its own course.
    values
        The record, shape (n,).
    step
        Its step, in the same unit; above 0.

    Returns
    -------
    ndarray
        In the unit of the record, shape (n,).
    """
    sample_s = Clock(time).sample_s
    gaps = gap_starts(time, sample_s)
    parts = zip(np.split(time, gaps), np.split(values, gaps))
    width = max(round(CELL_S / sample_s), 1) if sample_s > 0.0 else 1
    return np.concatenate([_course(t, v, step, width) for t, v in parts])


def _course(time: FloatArray, values: FloatArray, step: float, width: int) -> FloatArray:
    """The course of a record without gaps, worked out for cells of `width` samples."""
    cells = len(values) // width
    if cells <= 2 * _ORDER:
        return values.copy()
    # What is left over at the end is in the last cell.
    starts = width * np.arange(cells)
    counts = np.diff(np.append(starts, len(values)))
    middles = np.add.reduceat(time, starts) / counts
    base = values[0]
    # Readings of one stair are equal, whatever rounding makes of their means.
    readings = np.round(np.add.reduceat(values - base, starts) / counts / step, 9)
    smooth = _within_bounds(readings, (SMOOTHED_S * (cells - 1) / (middles[-1] - middles[0])) ** (2 * _ORDER))
    if width > 1:
        from scipy.interpolate import CubicSpline

        smooth = CubicSpline(middles, smooth)(time)
    return np.clip(base + step * smooth, values - 0.5 * step, values + 0.5 * step)


def _within_bounds(readings: FloatArray, stiffness: float) -> FloatArray:
    """The smoothest course through readings in steps, shape (n,), by Newton steps on the bounds it meets."""
    from scipy.linalg import solveh_banded

    edges = np.flatnonzero(np.diff(readings)) + 1
    lengths = np.diff([0, *edges, len(readings)])
    # A stair is one reading, however long it is.
    central = 1.0 / np.repeat(lengths, lengths)
    rough = stiffness * _bands(len(readings), lower=True)
    side = np.zeros(len(readings))
    course = readings
    for _ in range(_ROUNDS):
        bound = _BOUND * np.abs(side)
        bands = rough.copy()
        bands[0] += central + bound
        wanted = central * readings + bound * (readings + 0.5 * side)
        course = solveh_banded(bands, wanted, lower=True, overwrite_ab=True, check_finite=False)
        beyond = np.sign(course - readings) * (np.abs(course - readings) > 0.5)
        if np.array_equal(beyond, side):
            break
        side = beyond
    return course
