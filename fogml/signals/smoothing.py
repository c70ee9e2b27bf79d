"""Readings of slow quantities without their noise and steps: splines whose roughness cross-validation picks.

A reading is a smooth course and white noise. The smooth course minimises
``sum (reading - smooth)^2 + penalty sum (third difference)^2`` (E. T. Whittaker, Proc. Edinburgh Math. Soc.
41 (1923) 63), the penalty the generalised cross-validation (P. Craven and G. Wahba, Numer. Math. 31 (1979)
377).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded

from fogml.arrays import FloatArray

PENALTIES = np.geomspace(1e-3, 1e8, 23)
LEAST_PASSED = 0.1
"""Share of a wave that the smoother lets through under which it is taken for none."""
_ORDER = 3
_THIRD = np.array([-1.0, 3.0, -3.0, 1.0])


@dataclass(frozen=True)
class Smoothness:
    """What cross-validation found: the readings' noise, a standard deviation, and the penalty."""

    noise: float
    penalty: float

    def errors(self, n: int) -> FloatArray:
        """What the smooth course may differ by from the true one: columns of unit priors, shape (n, k).

        The posterior covariance of a spline is the noise's variance times the smoother; waves that it hardly
        lets through are left out.
        """
        waves = np.arange(n)
        passed = 1.0 / (1.0 + self.penalty * (2.0 - 2.0 * np.cos(np.pi * waves / n)) ** _ORDER)
        kept = waves[(passed > LEAST_PASSED)]
        basis = np.cos(np.pi * np.outer(np.arange(n) + 0.5, kept) / n)
        basis *= np.where(kept == 0, np.sqrt(1.0 / n), np.sqrt(2.0 / n))
        return np.asarray(self.noise * np.sqrt(passed[kept]) * basis)


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
    system = penalty * bands
    system[-1] += 1.0
    return np.asarray(solveh_banded(system, values, check_finite=False))


def _bands(n: int) -> FloatArray:
    """Upper bands of D'D for third differences, as `scipy.linalg.solveh_banded` takes them."""
    bands = np.zeros((_ORDER + 1, n))
    for i in range(_ORDER + 1):
        for j in range(i, _ORDER + 1):
            bands[_ORDER - (j - i), j : n - _ORDER + j] += _THIRD[i] * _THIRD[j]
    return bands


def window_difference(
    time: FloatArray, values: FloatArray, window_s: float, ahead_s: float = 0.0
) -> FloatArray:
    """Mean over the last window less the mean over the one before, as integrals over time; shape as given.

    Values are a cubic spline between samples, and what they first were before. Samples that stand for the
    interval that ends at them hold what was half of it `ahead_s`.
    """
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
