"""Where the table turns, and how noisy its recorded rate is."""

from __future__ import annotations

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.intervals import MEDIAN_SIZE
from fogml.runs.run import Run
from fogml.signals import large

LEAST_RATE_DEG_S = 1e-3
"""Table rates below this count as zero [deg/s]."""


def white_noise(values: FloatArray) -> float:
    """Standard deviation of white noise on a series of plateaus, by the median of second differences."""
    if len(values) < 4:
        return 0.0
    bends = large.median(lambda: (np.abs(part) for _, part in large.differences(values, 2)))
    return bends / MEDIAN_SIZE / float(np.sqrt(6.0))


def turning(run: Run) -> BoolArray:
    """True where the table rate is not zero, shape (n,).

    A measured rate counts as zero within six times its own noise.
    """
    slowest, fastest = large.extremes(run.rate)
    if slowest >= -LEAST_RATE_DEG_S and fastest <= LEAST_RATE_DEG_S:
        return np.zeros(len(run), dtype=bool)
    least = least_rate_deg_s(run)
    return large.each(lambda rate: np.abs(rate) > least, run.rate, kind=bool)


def least_rate_deg_s(run: Run, noises: float = 6.0) -> float:
    """The least table rate that is not rest [deg/s]: `LEAST_RATE_DEG_S`, or so many times its own noise."""
    return max(LEAST_RATE_DEG_S, noises * white_noise(run.rate))
