"""What a record in whole steps hides: the smoothest course that runs through its stairs.

Where a slow quantity is read in coarse steps, each reading bounds it to half a step either way, and
the times of the edges tell more than that. The course minimises the squares of its third
differences, which a steady change of rate does not have, of what it leaves the bounds by, and, weakly,
of its distance from the middle of each stair. It is a smoother after Whittaker with bounds.

References: E. T. Whittaker, Proc. Edinburgh Math. Soc. 41 (1923) 63; P. H. C. Eilers, Anal. Chem. 75
(2003) 3631.
"""

from __future__ import annotations

from math import comb

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.clock import Clock, gap_starts

CELL_S = 10.0
"""Readings are averaged over this time first; a thermometer's place knows nothing quicker."""
SMOOTHED_S = 100.0
"""Time over which readings that are a step apart each are smoothed [s]."""
_ORDER = 3
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
    rough = stiffness * _squared_differences(len(readings))
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


def _squared_differences(count: int) -> FloatArray:
    """Lower bands of D'D, D the differences of order `_ORDER`; shape (`_ORDER` + 1, count)."""
    taps = [(-1.0) ** k * comb(_ORDER, k) for k in range(_ORDER + 1)]
    bands = np.zeros((_ORDER + 1, count))
    for a, left in enumerate(taps):
        for b, right in enumerate(taps[a:], start=a):
            bands[b - a, a : count - _ORDER + a] += left * right
    return bands
