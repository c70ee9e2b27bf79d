"""Sample times as the window operators see them: regular grid or not, nominal interval, window rules."""

from __future__ import annotations

from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.signals import large

Number = TypeVar("Number", float, FloatArray)

EDGE_TOLERANCE = 1e-6
"""Float noise forgiven at window edges, in sample intervals."""
GAP_INTERVALS = 3.0
"""A gap is an interval longer than this many sample intervals."""
GAP_TOLERANCE = 0.01
"""Rounding of times forgiven in the length of a gap, in sample intervals: two lost samples are none."""
GAP_SHARE = 0.25
"""A gap longer than this share of the window restarts the operator."""
EXPONENTIAL_SPAN = 3.0
"""Time constants until an exponential window is full."""
LEAST_SHARE = 0.125
"""Share of its span from which on a window that fills counts. Rates are taken to be its inverse to the power
of 1.5, 23 times, the noise of a full window; below that share the noise is larger than they are. Usual
windows are better: one of 64 s on samples of 1 s in steps of 1/16 degC has 1/330 of 1 degC/min."""

_CHUNK = 1 << 15
_GRID_TOLERANCE = 2e-10


class Clock:
    """The sample times of one recording, with what the window operators need to know of them.

    Build it once and hand it to several operators in place of the times; that spares the check
    for a regular grid each time.

    Parameters
    ----------
    time
        Sample times [s], shape (n,), strictly increasing.
    sample_s
        Nominal sample interval [s]; the median interval if None.
    """

    def __init__(self, time: ArrayLike, sample_s: float | None = None) -> None:
        self.time: FloatArray = np.ascontiguousarray(time, dtype=np.float64)
        if self.time.ndim != 1:
            raise InputError(f"sample times: an array of one dimension was expected, not {self.time.ndim}")
        self._nominal_s = sample_s

    def __len__(self) -> int:
        return len(self.time)

    @cached_property
    def sample_s(self) -> float:
        """Nominal sample interval [s]; where none was given, the median (0 for fewer than two samples)."""
        if self._nominal_s is not None:
            return self._nominal_s
        if len(self.time) < 2:
            return 0.0
        # On a grid all intervals are the median, and telling that is much quicker than sorting.
        return self.grid_s or large.median(lambda: (steps for _, steps in large.differences(self.time)))

    @cached_property
    def grid_s(self) -> float | None:
        """Interval [s] of the regular grid that the times lie on, or None where they don't.

        Regular means: no time is off the grid by more than float noise, so that index arithmetic
        gives the same rates as true times do to better than 1e-9.
        """
        time, n = self.time, len(self.time)
        if n < 2 or time[-1] <= time[0]:
            return None
        interval = float(time[-1] - time[0]) / (n - 1)
        nominal = interval if self._nominal_s is None else self._nominal_s
        noise = float(np.spacing(max(abs(time[0]), abs(time[-1]))))
        tolerance = _GRID_TOLERANCE * nominal + 2.0 * noise
        if abs(interval - nominal) > EDGE_TOLERANCE * nominal + 4.0 * noise:
            return None
        grid = interval * np.arange(min(_CHUNK, n))
        for part in large.pieces(time, least=_CHUNK):
            for low in range(part.start, part.stop, _CHUNK):
                off = time[low : min(low + _CHUNK, part.stop)] - (time[0] + low * interval)
                off -= grid[: len(off)]
                if off.max() > tolerance or off.min() < -tolerance:
                    return None
        return interval


def gap_starts(time: FloatArray, sample_s: float, longest_s: float = 0.0) -> IndexArray:
    """Indices of the samples that follow a gap longer than `longest_s`.

    Parameters
    ----------
    time
        Sample times [s], shape (n,).
    sample_s
        Nominal sample interval [s]; an interval is a gap if longer than three of them.
    longest_s
        Longest interval [s] that counts as none.
    """
    limit = max(longest_gap_s(0.0, sample_s), longest_s)
    found = [at + np.flatnonzero(steps > limit) + 1 for at, steps in large.differences(time)]
    return np.concatenate(found) if found else np.empty(0, dtype=np.intp)


def longest_gap_s(window_s: float, sample_s: float) -> float:
    """Longest interval [s] that a window of `window_s` may span."""
    return max(GAP_SHARE * window_s, GAP_INTERVALS * sample_s) + GAP_TOLERANCE * sample_s


def needed_s(span_s: float, sample_s: float) -> float:
    """Time from a restart until a window of that span is full [s]: one sample interval less."""
    return span_s - sample_s * (1.0 + EDGE_TOLERANCE)


def counting_s(span_s: float, sample_s: float) -> float:
    """Time from a restart until what a window of that span holds counts [s], float noise forgiven."""
    return LEAST_SHARE * span_s - EDGE_TOLERANCE * sample_s


def told_share(share: Number, least: float) -> Number:
    r"""What a window that holds a share s of its span tells of its rate: :math:`(1+q)g/(g+q)`.

    The variance of a rate goes with one over the cube of the time that it is taken over, so
    :math:`g = s^3` is that of the full window as a share of its own. With :math:`q` the full window's
    variance over that of the rates, :math:`g/(g+q)` times what was measured is the expected rate given it:
    put in its place, it does not pull at coefficients (regression calibration: Carroll, Ruppert, Stefanski &
    Crainiceanu, Measurement Error in Nonlinear Models, 2006, ch. 4). It is 1 at a share of 1, and a half
    at the share `least`, whose cube is q.
    """
    g, q = share**3, least**3
    return (1.0 + q) * g / (g + q)


def check_interval(sample_s: float, what: str) -> None:
    """Refuse a sample interval [s] that is no positive number."""
    if not (np.isfinite(sample_s) and sample_s > 0.0):
        raise InputError(f"{what}: a sample interval of {sample_s} s; it must be positive")


def check_window(window_s: float, sample_s: float, intervals: int, what: str) -> None:
    """Refuse a window that is no positive number, or shorter than so many sample intervals."""
    if not window_s > 0.0 or not np.isfinite(window_s):
        raise InputError(f"{what} of {window_s:g} s: a positive number of seconds was expected")
    if window_s < intervals * sample_s * (1.0 - EDGE_TOLERANCE):
        raise InputError(
            f"{what} of {window_s:g} s is too short for samples {sample_s:g} s apart; "
            f"widen it to at least {intervals * sample_s:g} s"
        )
